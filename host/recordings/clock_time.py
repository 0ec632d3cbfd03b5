"""Times as a calendar and a clock have them: 2026-03-01T12:00:00.5Z, 2026-03-01 12:00:00, 12:00:00.5."""

from collections.abc import Sequence
from datetime import UTC, datetime, time

import numpy as np

from host.recordings.recording import Array

DAY = 86400.0  # s


def clock_seconds(cells: Sequence[str]) -> Array:
    """Seconds (N,) on one scale; NaN for a cell that is no such time. ISO 8601, with or without its date.

    Without a zone a time is taken as UTC; a clock without a date goes on at midnight.
    """
    seconds = np.array([_seconds(cell.strip().replace(",", ".")) for cell in cells], dtype=float)
    known = np.flatnonzero(np.isfinite(seconds))
    if known.size and seconds[known].max() < DAY:
        fallen = np.diff(seconds[known]) < -0.5 * DAY
        seconds[known[1:]] += DAY * np.cumsum(fallen)
    return seconds


def _seconds(cell: str) -> float:
    try:
        moment = datetime.fromisoformat(cell)
    except ValueError:
        return _of_the_day(cell)
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def _of_the_day(cell: str) -> float:
    try:
        clock = time.fromisoformat(cell)
    except ValueError:
        return float("nan")
    return 3600.0 * clock.hour + 60.0 * clock.minute + clock.second + 1e-6 * clock.microsecond
