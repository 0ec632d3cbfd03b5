"""Whether depth, pitch and speed fit together: their signs, and their units.

Depth positive down and pitch nose up make zeta' = w - u theta: what swims ahead rises where its nose is up.
Given the other way round, one of them would be explained by physics that no vehicle has. Over spans of some
seconds the rise d zeta and the climb along the hull d P, P' = -u theta, of which the means are left to a
current, a bias and the angle of attack in steady flight, have the correlation

    r = sum(d zeta d P) / sqrt(sum(d zeta^2) sum(d P^2)),

which a heave that leads the other way lowers, but hardly below none: of 382 recordings of blind trials one
had -0.5, and 96 in a hundred more than 0.8. Where the speed is measured, d zeta is about d P: of 109 that
told it clearly the ratio was 0.25 to 1.9, and in 97 of a hundred 0.55 to 1.8; feet make it 3.3, knots 0.5
(python -m tools.bench_consistency trial/recordings/*.csv).
"""

import numpy as np

from host.errors import RecordingError
from host.recordings.recording import Array, Recording

SPAN = 5.0  # s
OPPOSED, CLEAR = -0.8, 0.95  # of r
USUAL = 0.55, 1.8  # of d zeta over d P


def check_signs(recordings: list[Recording]) -> None:
    """Raises RecordingError with one line where the vehicle sinks as its nose goes up, or goes astern."""
    speeds = np.concatenate([recording.speed for recording in recordings])
    if np.isfinite(speeds).any() and np.nanmean(speeds) < 0.0:
        raise RecordingError(
            f"{recordings[0].name}: the measured speed is negative ({np.nanmean(speeds):.2g} m/s on the "
            "mean): ahead is positive; put sign = -1 under [csv.speed]"
        )
    r, _ = depth_by_pitch(recordings)
    if r < OPPOSED:
        raise RecordingError(
            f"{recordings[0].name}: the vehicle sinks where its nose is up (correlation {r:.2f}): depth is "
            "positive down and pitch positive nose up; put sign = -1 under [csv.depth] or [csv.pitch], for a "
            "log pitch_sign = -1 under [mavlink] or [can]"
        )


def units_note(recordings: list[Recording]) -> str | None:
    """A sentence where depth does not change as speed and pitch have it; None where it does, or about so."""
    r, ratio = depth_by_pitch(recordings)
    if not recordings[0].has_speed or r < CLEAR or USUAL[0] < ratio < USUAL[1]:
        return None
    return (
        f"depth changes {ratio:.2g} times as fast as speed and pitch have it: unless this hull moves so much "
        "sideways, one of them is in another unit (feet, knots)"
    )


def depth_by_pitch(recordings: list[Recording]) -> tuple[float, float]:
    """The correlation r of d zeta with d P, and their ratio sum(d zeta d P) / sum(d P^2); 0 where untold.

    Without a measured speed the ratio is that speed, m/s.
    """
    rise, along, both = np.sum([_products(recording) for recording in recordings], axis=0).tolist()
    if not rise * along > 0.0:
        return 0.0, 0.0
    return both / (rise * along) ** 0.5, both / along


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
