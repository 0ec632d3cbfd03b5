"""Messages at their own times, in place of lines between them at the instants of a grid.

A value on a line between two readings has less noise than either, and shares it with its neighbours: to the
likelihood, which takes each for a reading, a sensor whose error wanders. So the readings of pitch and depth
stand at the times at which they were made (of many the nearest to each step of the grid), and the plane at
its mean angle over each of the rows that come of that. Methods that are fed at every step need the grid.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from host.recordings.plane_readings import step_means
from host.recordings.recording import Array, Recording

FEW, OFTEN = 10, 0.7  # messages; of a step, from one to the next, below which not all are needed
SAME_ROW = 0.05  # of a step: readings that are not further apart share a row


class Sent(NamedTuple):
    """Times s, on the recording's axis, and values of a channel's messages, as they advance."""

    time: Array
    value: Array


def at_own_times(grid: Recording, sent: dict[str, Sent], is_heard: NDArray[np.bool_]) -> Recording:
    """The recording with a row for each reading of pitch or depth, or one for each step of the grid.

    sent      by channel; a measured speed or pitch rate goes to the nearest row
    is_heard  (N,) whether the plane's angle was known over a step; elsewhere that of the grid stands
    """
    kept = {name: _nearest(grid, sent[name]) for name in ("pitch", "depth")}
    time = _rows(kept["pitch"].time, kept["depth"].time, SAME_ROW * grid.step)
    plane = sent["rudder"]
    if time.size == 0 or plane.time.size == 0:
        return grid
    ends = np.append(time[1:], time[-1] + grid.step)
    step = np.clip(np.searchsorted(grid.time, time, side="right") - 1, 0, grid.time.size - 1)
    angles = np.append(plane.value[:1], plane.value)  # the first stood before it was sent
    rudder = np.where(is_heard[step], step_means(plane.time, angles, time, ends), grid.rudder[step])
    columns: dict[str, Any] = {name: _placed(time, one, grid.step) for name, one in kept.items()}
    for name in ("speed", "pitch_rate"):
        columns[name] = _placed(time, _nearest(grid, sent[name]), grid.step)
    return replace(grid, time=time, rudder=rudder, **columns)


def _nearest(grid: Recording, sent: Sent) -> Sent:
    """Of a channel's messages those that are the nearest to a step of the grid; all of a few."""
    if sent.time.size < FEW or np.median(np.diff(sent.time)) > OFTEN * grid.step:
        inside = (sent.time >= grid.time[0]) & (sent.time <= grid.time[-1])
        return Sent(sent.time[inside], sent.value[inside])
    after = np.clip(np.searchsorted(sent.time, grid.time), 1, sent.time.size - 1)
    before = after - 1
    is_after = np.abs(sent.time[after] - grid.time) < np.abs(sent.time[before] - grid.time)
    place = np.unique(np.where(is_after, after, before))
    inside = (sent.time[place] >= grid.time[0]) & (sent.time[place] <= grid.time[-1])
    return Sent(sent.time[place][inside], sent.value[place][inside])


def _rows(pitch: Array, depth: Array, apart: float) -> Array:
    """All times of pitch, and those of depth that are not next to one."""
    if pitch.size == 0 or depth.size == 0:
        return np.sort(np.concatenate([pitch, depth]))
    after = np.clip(np.searchsorted(pitch, depth), 1, max(pitch.size - 1, 1))
    near = np.minimum(
        np.abs(pitch[after - 1] - depth), np.abs(pitch[np.minimum(after, pitch.size - 1)] - depth)
    )
    return np.sort(np.concatenate([pitch, depth[near > apart]]))


def _placed(time: Array, sent: Sent, step: float) -> Array:
    """The values in the rows nearest to them, NaN elsewhere."""
    column = np.full(time.size, np.nan)
    if sent.time.size:
        after = np.clip(np.searchsorted(time, sent.time), 0, time.size - 1)
        before = np.maximum(after - 1, 0)
        is_after = np.abs(time[after] - sent.time) < np.abs(time[before] - sent.time)
        row = np.where(is_after, after, before)
        near = np.abs(time[row] - sent.time) <= step / 2.0
        column[row[near]] = sent.value[near]
    return column
