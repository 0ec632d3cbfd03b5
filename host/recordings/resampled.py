"""Channels told in more rows than they have readings: only the readings count.

Tables that bring sensors of several rates onto one clock repeat the last reading of the slower ones, or draw
straight lines between two. Taken for measurements, repeats are a sensor that answers late, and rows on a line
a sensor without noise: physics would be named for the one, and evidence counted several times for either.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.recordings.recording import Array, Recording
from host.recordings.rounding import lattice

CHANNELS = {"depth": "depth", "pitch": "pitch", "speed": "speed", "pitch_rate": "pitch rate"}
FEWEST = 20  # readings that tell how a channel came into the table
COARSE = 2.0  # times the least difference of two readings: what usually differs by less is only rounded
ROUNDED = 2.5  # steps of the last digit, by which rows on a line may be off it
SHARPLY, OFTEN = 1e-3, 0.95  # of the bend that so many rows keep below: less is how numbers are written
BENDS = 4.0  # times that, by which a line usually bends at a reading
SLIP = 0.1  # of a row, by which a clock may be off
STRAIGHT, REGULAR = 0.3, 0.8  # shares of rows on a line, and of readings that come at their usual distance


def readings_alone(recording: Recording) -> Recording:
    """The recording with what is repeated or lies between readings "not measured"; a note says where."""
    values: dict[str, Any] = {}
    notes: list[str] = []
    for name, words in CHANNELS.items():
        column = getattr(recording, name)
        for find, done in ((repeats, "repeats the last reading"), (between, "is on a line between readings")):
            if (rows := find(recording.time, column)) is not None:
                values[name] = np.where(rows, np.nan, column)
                share = rows.sum() / np.isfinite(column).sum()
                notes.append(f"{words} {done} in {100 * share:.0f} % of the rows: these are not measurements")
                break
    return replace(recording, **values, notes=(*recording.notes, *notes)) if values else recording


def repeats(time: Array, values: Array) -> NDArray[np.bool_] | None:
    """Rows (N,) that repeat the reading before; None where a channel is not told in that way.

    A reading that stands for longer than usual was made again. A coarsely rounded channel repeats as well,
    while it moves by less than its resolution in a row; a held one moves by many steps from one to the next.
    """
    rows = np.flatnonzero(np.isfinite(values))
    is_new = np.diff(values[rows], prepend=np.nan) != 0.0
    begins = np.flatnonzero(is_new)
    if begins.size < FEWEST:
        return None
    moves = np.abs(np.diff(values[rows][begins]))
    if np.median(np.diff(begins)) < 2 or np.median(moves) <= COARSE * moves.min():
        return None
    told, place = time[rows], np.arange(rows.size)
    usual = float(np.median(np.diff(told[begins])))
    since = told - told[np.maximum.accumulate(np.where(is_new, place, 0))]
    again = np.floor((since + SLIP * float(np.median(np.diff(told)))) / usual)
    return _marked(values.size, rows[~is_new & (np.diff(again, prepend=0.0) <= 0.0)])


def between(time: Array, values: Array) -> NDArray[np.bool_] | None:
    """Rows (N,) on straight lines between two readings; None where a channel is not told in that way.

    The readings are where the lines bend, or next to there, and come as evenly as a sensor's do.
    """
    rows = np.flatnonzero(np.isfinite(values))
    if rows.size < FEWEST:
        return None
    told = time[rows]
    pace = float(np.median(np.diff(told)))
    bend = np.abs(np.diff(np.diff(values[rows]) / np.diff(told))) * pace
    rounding = max(ROUNDED * lattice([values]), SHARPLY * float(np.quantile(bend, OFTEN)), 1e-9)
    corners = 1 + np.flatnonzero(bend > rounding)
    if corners.size > (1.0 - STRAIGHT) * bend.size:
        return None
    # A reading between two rows bends the line at both of them.
    first = np.diff(corners, prepend=-1) > 1
    readings = corners[first]
    if readings.size < FEWEST:
        return None
    apart = np.diff(told[readings]) / pace
    usual = np.median(apart)
    is_regular = np.mean(np.abs(apart - usual) <= 1.0 + SLIP) >= REGULAR
    if usual < 2.0 - SLIP or not is_regular or np.median(bend[corners - 1]) < BENDS * rounding:
        return None
    kept = np.concatenate([[0], readings, [rows.size - 1]])
    return _marked(values.size, np.delete(rows, kept))


def _marked(count: int, rows: NDArray[np.intp]) -> NDArray[np.bool_]:
    mask = np.zeros(count, dtype=bool)
    mask[rows] = True
    return mask
