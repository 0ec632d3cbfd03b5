"""Rows whose times were rounded, to whole seconds say: a steady pace tells when each of them was.

Of times that repeat only the first row of each would count: of 10 Hz in seconds nine of ten were lost; and
of 8 Hz in tenths of a second each row would be early or late by up to one. Where all rows lie within a
rounding step about a straight line, time = start + pace * row, that line is the time: rows of two sensors,
each at its own pace, do not.
"""

import numpy as np

from host.recordings.recording import Array

ROUND = (10.0, 5.0, 1.0, 0.5, 0.25, 0.1, 0.05, 0.02, 0.01, 0.001)  # s
LEAST_STEPS = 5  # distinct times, of which a pace can be told
COARSE = 0.02  # of the pace: steps finer than that shift no row by what matters
UNEVEN, ALIKE = 2.0, 1.05  # times the step, within which rows lie: of an uneven clock; of an even one


def evenly_told(time: Array) -> tuple[Array, float] | None:
    """The time (N,) of rows at a steady pace, and the step it had been rounded to, s; None if it was not."""
    if not np.isfinite(time).all() or np.unique(time).size <= LEAST_STEPS or (np.diff(time) < 0.0).any():
        return None
    rows = np.arange(time.size)
    step = next((step for step in ROUND if _are_multiples(time - time[0], step)), 0.0)
    pace, start = np.polyfit(rows, time, 1)
    told = start + pace * rows
    off = float(np.ptp(time - told))
    most = (UNEVEN if step > pace else ALIKE) * step
    return (told, step) if COARSE * pace < off < most else None


def _are_multiples(values: Array, step: float) -> bool:
    return np.allclose(values / step, np.round(values / step), rtol=0.0, atol=1e-3)
