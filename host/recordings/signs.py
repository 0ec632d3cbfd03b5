"""Whether depth and pitch have the signs that the equations take them to have.

Depth positive down and pitch nose up make zeta' = w - u theta: what swims ahead rises where its nose is up.
Given the other way round, one of them would be explained by physics that no vehicle has. Over spans of some
seconds the rise d zeta and the climb along the hull d P, P' = -u theta, of which the means are left to a
current, a bias and the angle of attack in steady flight, have the correlation

    r = sum(d zeta d P) / sqrt(sum(d zeta^2) sum(d P^2)),

which a heave that leads the other way lowers, but hardly below none: of 391 simulated dives one had -0.5, and
96 in a hundred more than 0.8.
"""

import numpy as np

from host.errors import RecordingError
from host.recordings.recording import Array, Recording

SPAN = 5.0  # s
OPPOSED = -0.8


def check_signs(recordings: list[Recording]) -> None:
    """Raises RecordingError with one line where the vehicle sinks as its nose goes up, all along."""
    r = depth_by_pitch(recordings)
    if r < OPPOSED:
        raise RecordingError(
            f"{recordings[0].name}: the vehicle sinks where its nose is up (correlation {r:.2f}): depth is "
            "positive down and pitch positive nose up; put sign = -1 under [csv.depth] or [csv.pitch]"
        )


def depth_by_pitch(recordings: list[Recording]) -> float:
    """The correlation r of how depth changes with what pitch says of it; 0 where they say nothing."""
    products = np.sum([_products(recording) for recording in recordings], axis=0)
    size = np.sqrt(products[0] * products[1])
    return float(products[2] / size) if size > 0.0 else 0.0


def _products(recording: Recording) -> Array:
    """Sums over a recording (3,): of d zeta^2, of d P^2, and of their product."""
    known = np.isfinite(recording.pitch), np.isfinite(recording.depth)
    rows = max(1, round(SPAN / recording.step))
    if not (known[0].any() and known[1].any()) or rows >= recording.time.size:
        return np.zeros(3)
    speed = np.ones(recording.time.size)
    if recording.has_speed:
        speed = _filled(recording.time, recording.speed)
    climb = np.cumsum(-speed * _filled(recording.time, recording.pitch)) * recording.step
    depth = _filled(recording.time, recording.depth)
    rise, along = (values[rows:] - values[:-rows] for values in (depth, climb))
    rise, along = rise - rise.mean(), along - along.mean()
    return np.array([rise @ rise, along @ along, rise @ along])


def _filled(time: Array, values: Array) -> Array:
    known = np.isfinite(values)
    return np.interp(time, time[known], values[known])
