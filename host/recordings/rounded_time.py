"""Rows whose times were rounded, to whole seconds say: a steady pace tells when each of them was.

Of times that repeat only the first row of each would count: of 10 Hz in seconds nine of ten were lost. Where
all rows lie within a rounding step of a straight line, time = start + pace * row, that line is the time.
"""

import numpy as np

from host.recordings.recording import Array

LEAST_STEPS = 5  # distinct times, of which a pace can be told
LEAST_REPEATED = 0.4  # of the rows: fewer are slips of a clock


def evenly_told(time: Array) -> tuple[Array, float] | None:
    """The time (N,) of rows at a steady pace, and the step it had been rounded to, s; None if it was not."""
    if not np.isfinite(time).all() or time.size < 2:
        return None
    steps = np.diff(time)
    if (steps < 0.0).any() or np.mean(steps == 0.0) < LEAST_REPEATED:
        return None
    step = float(np.median(steps[steps > 0.0])) if (steps > 0.0).sum() >= LEAST_STEPS else 0.0
    rows = np.arange(time.size)
    pace, start = np.polyfit(rows, time, 1)
    told = start + pace * rows
    return (told, step) if step > 0.0 and np.abs(time - told).max() < step else None
