"""What the errors of a measured speed do to the depth of a free run, and how to whiten what they leave.

    zeta' = w - u theta:    n(k+1) = n(k) - theta_k h_k v(k),   v(k+1) = a v(k) + ...,   e(k) = n(k) + noise

The depth error n integrates the speed's error v (host.speed) for as long as the hull is pitched, so residuals
of depth drift together, and physics would be named for them. A Kalman filter for n and v in the residual
whitens it, and its sensitivities: generalised least squares (Durbin, Biometrika 47, 1960). It depends on the
measurements alone, not on the parameters.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from host.recording import Array, Recording
from host.rounding import thinned
from host.speed import smoothed_speed

SLIGHT = 0.001  # of the depth sensor's variance: less makes no difference, over thousands of rows either


@dataclass(frozen=True, slots=True)
class SpeedError:
    """The filter over one recording's residuals of depth.

    gain      (2, N) of n and v, 0 where no depth was measured
    leverage  (N,) theta h, by which n loses v from row to row
    decay     a
    spread    (N,) innovation variance over that of the depth sensor, 1 where no depth was measured
    """

    gain: Array
    leverage: Array
    decay: float
    spread: Array

    @property
    def charge(self) -> float:
        """By how much the spread lowers the log-likelihood."""
        return 0.5 * float(np.sum(np.log(self.spread)))

    def whitened(self, values: Array) -> Array:
        """Residuals or sensitivities of depth (c, N), filtered; white residuals keep the sensor's variance.

        The state x = [n, v] goes x(k+1) = A_k (x(k) + K_k (y(k) - n(k))), A_k = [1, -l_k; 0, a]: linear in
        y, one banded system in all rows' states.
        """
        (kn, kv), lever, a = self.gain[:, :-1], self.leverage[:-1], self.decay
        rows = values.shape[1]
        bands = np.zeros((4, 2 * rows))
        bands[0] = 1.0
        # -A (I - K [1, 0]), by columns: n feeds n and v of the next row, v as well.
        bands[2, 0:-2:2] = -(1.0 - kn + lever * kv)
        bands[3, 0:-2:2] = a * kv
        bands[1, 1:-2:2] = lever
        bands[2, 1:-2:2] = -a
        driven = np.zeros((2 * rows, values.shape[0]))
        driven[2::2] = ((kn - lever * kv) * values[:, :-1]).T
        driven[3::2] = (a * kv * values[:, :-1]).T
        # A trial may run away: what is infinite is refused by its likelihood.
        states = solve_banded((3, 0), bands, driven, check_finite=False)
        return np.asarray((values - states[::2].T) / np.sqrt(self.spread))


def speed_error(recording: Recording, depth_variance: float) -> SpeedError | None:
    """The filter for one recording; None without a speed sensor, and where its errors make no difference.

    depth_variance  of the depth sensor, m^2
    """
    if not recording.has_speed:
        return None
    _, variance, decay = smoothed_speed(recording.speed)
    known = np.isfinite(recording.pitch)
    if variance == 0.0 or not known.any():
        return None
    pitch = np.interp(recording.time, recording.time[known], recording.pitch[known])
    leverage = pitch * recording.intervals
    gain, spread = _gains(np.isfinite(recording.depth), leverage, decay, variance / depth_variance)
    if spread.max() < 1.0 + SLIGHT:
        return None
    return SpeedError(gain, leverage, decay, spread)


def speed_errors(
    recordings: list[Recording], depth_variance: float, steps: Array
) -> tuple[list[SpeedError | None], Array]:
    """Of each recording, and the steps (2,) of pitch and depth by whose rounding they can still be told.

    The likelihood of intervals takes each reading's error for its own: where the speed's errors move depth, a
    hundredth of a step, together is more than it allows, and depth is told as if its rounding were noise.
    """
    told = steps * [1.0, 0.0]
    errors = [speed_error(one, depth_variance) for one in thinned(recordings, told)]
    if steps[1] > 0.0 and not any(errors):
        return [None] * len(recordings), steps
    return errors, told


def _gains(present: Array, leverage: Array, a: float, variance: float) -> tuple[Array, Array]:
    """Kalman gain (2, N) and innovation variance (N,), variances in units of the depth sensor's."""
    gains, spreads = np.zeros((2, present.size)), np.ones(present.size)
    nn, nv, vv = 0.0, 0.0, variance
    for k, (is_present, lever) in enumerate(zip(present.tolist(), leverage.tolist(), strict=True)):
        if is_present:
            spreads[k] = spread = nn + 1.0
            gains[:, k] = nn / spread, nv / spread
            nn, nv, vv = nn - nn * nn / spread, nv - nn * nv / spread, vv - nv * nv / spread
        nn, nv = nn - 2.0 * lever * nv + lever * lever * vv, a * (nv - lever * vv)
        vv = a * a * vv + (1.0 - a * a) * variance
    return gains, spreads
