"""A depth that comes more seldom than pitch, in messages at times of its own.

On the grid of pitch it would be a line between two readings, with less noise than the sensor has and measured
in several rows, or missing where it comes too seldom for that. Maximum likelihood needs no grid: there the
readings stand in rows of their own. Methods that are fed at every step need one.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from host.recordings.recording import Array, Recording

SLOW = 1.5  # steps from reading to reading, beyond which not every step has one
SAME_ROW = 0.01  # of a step, between a row and a reading in it
FEWEST = 10  # readings
LONGEST_LINE = 2.5  # steps between two readings, over which depth is a line, as host.live.align has it


def with_own_rows(recording: Recording, time: Array, depth: Array) -> Recording:
    """The recording with rows for the readings of depth, m, at these times, s; itself where they are many.

    Nothing else is measured in them, and the plane stands as in the row before.
    """
    inside = (time >= recording.time[0]) & (time <= recording.time[-1])
    time, depth = time[inside], depth[inside]
    if time.size < FEWEST or np.median(np.diff(time)) <= SLOW * recording.step:
        return recording
    before = np.searchsorted(recording.time, time, side="right") - 1
    after = np.minimum(before + 1, recording.time.size - 1)
    is_after = np.abs(recording.time[after] - time) < np.abs(recording.time[before] - time)
    nearest = np.where(is_after, after, before)
    is_new = np.abs(recording.time[nearest] - time) > SAME_ROW * recording.step
    on_grid, nan = np.full(recording.time.size, np.nan), np.full(int(is_new.sum()), np.nan)
    on_grid[nearest[~is_new]] = depth[~is_new]
    columns = {
        "time": (recording.time, time[is_new]),
        "depth": (on_grid, depth[is_new]),
        "pitch": (recording.pitch, nan),
        "rudder": (recording.rudder, recording.rudder[before[is_new]]),
        "speed": (recording.speed, nan),
        "pitch_rate": (recording.pitch_rate, nan),
        "own_rows": (np.zeros(recording.time.size, dtype=bool), np.ones(nan.size, dtype=bool)),
    }
    whole: dict[str, Any] = {name: np.concatenate(parts) for name, parts in columns.items()}
    order = np.argsort(whole["time"], kind="stable")
    return replace(recording, **{name: column[order] for name, column in whole.items()})


def on_the_grid(recording: Recording) -> Recording:
    """The recording without rows of depth's own: between two readings that are not far apart on a line."""
    if recording.own_rows is None:
        return recording
    grid = ~recording.own_rows
    read = np.isfinite(recording.depth)
    time, depth, rows = recording.time[read], recording.depth[read], recording.time[grid]
    line = np.full(rows.size, np.nan)
    if time.size > 1:
        after = np.clip(np.searchsorted(time, rows), 1, time.size - 1)
        is_near = time[after] - time[after - 1] <= LONGEST_LINE * recording.step
        is_inside = (rows >= time[0]) & (rows <= time[-1])
        line = np.where(is_near & is_inside, np.interp(rows, time, depth), np.nan)
    own = recording.depth[grid]
    kept: dict[str, Any] = {
        name: getattr(recording, name)[grid] for name in ("time", "pitch", "rudder", "speed", "pitch_rate")
    }
    return replace(recording, **kept, depth=np.where(np.isfinite(own), own, line), own_rows=None)
