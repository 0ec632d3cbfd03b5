"""What the errors of a measured speed do to the depth of a free run, and whether that matters.

    zeta' = w - u theta:    n(k+1) = n(k) - theta_k h_k v(k),   v(k+1) = a v(k) + ...,   e(k) = n(k) + noise

The depth error n integrates the speed's error v (host.noise.speed) for as long as the hull is pitched, so
residuals of depth drift together, and physics would be named for them: they are whitened (host.noise.drift).
"""

import numpy as np

from host.noise.drift import Drift, Whitening, drifting_speed
from host.noise.speed import smoothed_speed
from host.recordings.recording import Array, Recording
from host.recordings.rounding import thinned

SLIGHT = 0.001  # of the depth sensor's variance: less makes no difference, over thousands of rows either


def speed_error(recording: Recording, depth_variance: float) -> Drift | None:
    """The drift of one recording; None without a speed sensor, and where its errors make no difference.

    depth_variance  of the depth sensor, m^2
    """
    if not recording.has_speed:
        return None
    _, variance, decay = smoothed_speed(recording.speed)
    if variance == 0.0 or not np.isfinite(recording.pitch).any():
        return None
    drift = drifting_speed(recording, variance / depth_variance, decay)
    return None if Whitening(drift).spread.max() < 1.0 + SLIGHT else drift


def speed_errors(
    recordings: list[Recording], depth_variance: float, steps: Array
) -> tuple[list[Drift | None], Array]:
    """Of each recording, and the steps (2,) of pitch and depth by whose rounding they can still be told.

    The likelihood of intervals takes each reading's error for its own: where the speed's errors move depth, a
    hundredth of a step, together is more than it allows, and depth is told as if its rounding were noise.
    """
    told = steps * [1.0, 0.0]
    errors = [speed_error(one, depth_variance) for one in thinned(recordings, told)]
    if steps[1] > 0.0 and not any(errors):
        return [None] * len(recordings), steps
    return errors, told
