"""Rows whose times were rounded, to whole seconds say: a steady pace tells when each of them was.

Of times that repeat only the first row of each would count: of 10 Hz in seconds nine of ten were lost; and
of 8 Hz in tenths of a second each row would be early or late by up to one. Where all rows lie within a
rounding step about a straight line, time = start + pace * row, that line is the time: rows of two sensors,
each at its own pace, do not. Where rows were lost, or none came for a while, those that share a time are
spread over the step to the next one.
"""

import numpy as np

from host.recordings.recording import Array

ROUND = (10.0, 5.0, 1.0, 0.5, 0.25, 0.1, 0.05, 0.02, 0.01, 0.001)  # s
LEAST_STEPS = 5  # distinct times, of which a pace can be told
COARSE = 0.02  # of the pace: steps finer than that shift no row by what matters
ALIKE = 1.05  # times the step, within which all rows lie about the line
SHARED = 3  # rows, that usually have a time in common: of fewer nothing tells which of them was lost


def evenly_told(time: Array) -> tuple[Array, float] | None:
    """The time (N,) of rows at a steady pace, and the step it had been rounded to, s; None if it was not."""
    if not np.isfinite(time).all() or np.unique(time).size <= LEAST_STEPS or (np.diff(time) < 0.0).any():
        return None
    rows = np.arange(time.size)
    step = next((step for step in ROUND if _are_multiples(time - time[0], step)), 0.0)
    pace, start = np.polyfit(rows, time, 1)
    told = start + pace * rows
    off = float(np.ptp(time - told))
    if off < COARSE * pace or step == 0.0:
        return None
    return (told, step) if off < ALIKE * step else _spread(time, step)


def _spread(time: Array, step: float) -> tuple[Array, float] | None:
    """Rows that share a time, spread over the step; of the first the last ones, as it began within it."""
    times, first, counts = np.unique(time, return_index=True, return_counts=True)
    usual = float(np.median(counts))
    if usual < SHARED:
        return None
    place = np.arange(time.size) - np.repeat(first, counts)
    intervals = step / counts
    ends = [0, -1]
    intervals[ends] = step / np.maximum(counts[ends], usual)
    told = np.repeat(times, counts) + place * np.repeat(intervals, counts)
    told[: counts[0]] += step - counts[0] * intervals[0]
    return told, step


def _are_multiples(values: Array, step: float) -> bool:
    return np.allclose(values / step, np.round(values / step), rtol=0.0, atol=1e-3)
