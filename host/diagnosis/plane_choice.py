"""Whether a plane held its angles between rows or moved on (host.plane_between_rows): asked of the motion."""

import numpy as np

from host.diagnosis.explanation import Explanation
from host.diagnosis.fitter import Fitter
from host.diagnosis.margins import NAMING_MARGIN
from host.diagnosis.spans import divide, excerpt
from host.plane_between_rows import with_moving_plane
from host.recording import Recording


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
