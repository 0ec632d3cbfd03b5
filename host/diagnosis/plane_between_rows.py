"""What the plane did between two rows: held the recorded angle, or moved on evenly to the next.

A commanded angle is held until the next command; a measured one was read off a plane that moved. Taken for
the other it comes half a row too late or too early, and other physics is bent to make up for that. The mean
angle of a plane that moves on evenly from row k to k + 1 is

    delta_k + (t_(k+1) - t_k) s_k / 2,  |s_k| = min(|d_k|, 2 max(|d_(k-1)|, |d_(k+1)|)),  d_k the slope there

A plane that rests before and after has stepped: a step stays a step.
"""

from dataclasses import replace

import numpy as np

from host.diagnosis.explanation import Explanation
from host.diagnosis.fitter import Fitter
from host.diagnosis.margins import NAMING_MARGIN
from host.diagnosis.spans import divide, excerpt
from host.recording import Recording

NOTE = "the plane is taken to move evenly from row to row: the recording follows that better than angles held"


def with_moving_plane(recording: Recording) -> Recording:
    """The recording with the mean angles of a plane that moves on evenly."""
    slopes = np.diff(recording.rudder) / np.diff(recording.time)
    if slopes.size < 3:
        return recording
    beside = np.maximum(np.abs(slopes[:-2]), np.abs(slopes[2:]))
    slope = np.zeros_like(recording.rudder)
    slope[1:-2] = np.clip(slopes[1:-1], -2.0 * beside, 2.0 * beside)
    rudder = recording.rudder + 0.5 * recording.intervals * slope
    return replace(recording, rudder=rudder, notes=(*recording.notes, NOTE))


def ways(recordings: list[Recording]) -> list[list[Recording]]:
    """The recordings with a plane that held its angles and with one that moved, the likelier first.

    As the base equations see them: what is left out may favour the other.
    """
    moving = [with_moving_plane(recording) for recording in recordings]
    if all(np.array_equal(a.rudder, b.rudder) for a, b in zip(recordings, moving, strict=True)):
        return [recordings]
    return sorted((recordings, moving), key=lambda way: Fitter(_excerpt(way)).base.bic)


def is_likelier(other: list[Recording], best: Explanation) -> bool:
    """Whether an explanation fits the recordings clearly better with the plane the other way."""
    again = Fitter(divide(other).teaching, known=best).polished(best)
    return again.bic < best.bic - NAMING_MARGIN


def _excerpt(recordings: list[Recording]) -> list[Recording]:
    return excerpt(divide(recordings).teaching)
