"""The readings of a plane in a table that has rows without one, or fills such rows.

Loggers that bring a plane of a slower rate onto the clock of pitch leave its cells empty, repeat its last
reading, or draw lines between two: then it turns at every second, or fifth, row only.
"""

import numpy as np
from numpy.typing import NDArray

from host.recordings.plane_readings import UNSEEN, PlaneReadings
from host.recordings.recording import Array

LONGEST_HELD = 0.6  # s: a plane that repeats its angle for longer may have been told to
LONGEST_PACE = 2.5  # s: nor does any logger take longer
FEWEST_TURNS = 20  # that tell a logger's pace from the plane's own
ROUNDED = 0.02  # of the sharpest bend: what lines seem to bend where their points are rounded
ON_A_ROW = 0.1  # of a step


def plane_readings(time: Array, rudder: Array, step: float) -> PlaneReadings | None:
    """The readings in a table's column, rad (N,), NaN where it has none; None where each row has its own."""
    known = np.flatnonzero(np.isfinite(rudder))
    is_read, turns = _read(time[known], rudder[known], step)
    rows = known[is_read]
    if rows.size < 2 or not (np.diff(time[rows]) > UNSEEN * step).any():
        return None
    is_doubtful = rows.size < known.size and bool(np.median(np.diff(time[known[turns]])) > LONGEST_HELD)
    found = PlaneReadings(time[rows], rudder[rows], step, pace=step, is_doubtful=is_doubtful)
    return None if is_doubtful and not found.is_stepping else found


def _read(time: Array, rudder: Array, step: float) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Which of the rows were read, where a logger repeated readings in those that follow, or drew lines.

    And the rows at which the plane turned, that tell it; all and none where each row may have been read.
    """
    slopes = np.diff(rudder) / np.diff(time)
    bends = np.abs(np.diff(slopes))
    for turns in (np.flatnonzero(slopes), np.flatnonzero(bends > ROUNDED * bends.max(initial=0.0))):
        read = _every_few(time, turns + 1, step)
        if read is not None:
            return read, turns + 1
    return np.ones(time.size, dtype=bool), np.empty(0, dtype=np.intp)


def _every_few(time: Array, turns: NDArray[np.intp], step: float) -> NDArray[np.bool_] | None:
    """The rows of a pace on which all of these lie; None where each row may be one."""
    if turns.size < FEWEST_TURNS:
        return None
    places = (time - time[turns[0]]) / step
    if np.abs(places - np.rint(places))[turns].max() > ON_A_ROW:
        return None
    every = int(np.gcd.reduce(np.rint(places[turns]).astype(int)))
    if every < 2 or every * step > LONGEST_PACE:
        return None
    return np.asarray(np.rint(places).astype(int) % every == 0)
