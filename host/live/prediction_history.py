"""What the reference missed before, while the vehicle moved at least as much."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from host.live.prediction_window import NAMES, Array, Comparison

SMALLEST = 60  # windows that judge; where fewer moved as much, the most active ones, stretched
SIMILAR = 0.8  # of the present activity: the least that counts as moving as much
HELD_BACK = 60  # windows that are not yet history: the beginning of a fault must not set its own level
OVERLAP = 10.0  # windows that share their samples, and count as one
CAUTION = 4.0  # over the number of separate windows: by so much more is the spread that few of them show

DETECTING = ("heave_force", "pitch_moment", "plane_force")
"""The changes whose evidence alone may raise an alarm: the least heavy-tailed at sea."""

_EVIDENCE = slice(2, 2 + len(NAMES))
_LEVERAGE = slice(2 + len(NAMES), 2 + 2 * len(NAMES))
_DETECTING = [2 + NAMES.index(name) for name in DETECTING]
SPREAD_FLOOR = np.array([0.1, 0.1, 1.0, 1.0, 1.0])
"""Least spread of the logarithm of an error, 10 %, and of an evidence, that of white noise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Past:
    """What is usual: windows of the past, a row each as in `_row`.

    stretch  by which their errors must be multiplied for a vehicle that moves more than it did in them
    """

    rows: Array
    stretch: float = 1.0

    def deviations(self, found: Comparison) -> Array:
        """Of the logarithm of both errors and of the evidence of `DETECTING`, in robust spreads.

        Less error than usual is no deviation.
        """
        rows = _judged(self.stretch * self.rows)
        usual = np.median(rows, axis=0)
        spread = np.maximum(1.4826 * np.median(np.abs(rows - usual), axis=0), SPREAD_FLOOR)
        spread *= 1.0 + CAUTION * OVERLAP / len(rows)
        deviation: Array = (_judged(_row(found)[None, :])[0] - usual) / spread
        deviation[:2] = np.maximum(deviation[:2], 0.0)
        return deviation

    @property
    def errors(self) -> Array:
        """Rms prediction error of pitch and depth, (2,)."""
        errors: Array = self.stretch * np.sqrt(np.mean(self.rows[:, :2] ** 2, axis=0))
        return errors

    @property
    def squares(self) -> float:
        """Sum of the squared errors of a window."""
        return float(self.stretch**2 * np.mean(self.rows[:, -2]))

    @property
    def sizes(self) -> Array:
        """Size of each change that the reference lacked already."""
        sizes: Array = np.median(self.rows[:, _EVIDENCE] / self.rows[:, _LEVERAGE], axis=0)
        return sizes


class PredictionHistory:
    """The last `length` windows, but for the newest."""

    def __init__(self, length: int) -> None:
        self._rows = np.empty((length, 4 + 2 * len(NAMES)))
        self._newest: deque[Array] = deque()
        self.clear()

    def clear(self) -> None:
        self.size = 0
        """Windows that count."""
        self._newest.clear()

    def add(self, found: Comparison) -> None:
        """Takes a window; it counts after `HELD_BACK` more."""
        self._newest.append(_row(found))
        if len(self._newest) > HELD_BACK:
            self._rows[self.size % len(self._rows)] = self._newest.popleft()
            self.size += 1

    def like(self, found: Comparison) -> Past | None:
        """The windows that moved at least about as much. None before there are any to judge by.

        An error that is quadratic in the motion, as of drag, is the worst that a smooth hull can hide.
        """
        rows = self._rows[: min(self.size, len(self._rows))]
        if len(rows) < SMALLEST:
            return None
        alike = rows[rows[:, -1] >= SIMILAR * found.activity]
        if len(alike) >= SMALLEST:
            return Past(rows=alike)
        alike = rows[np.argpartition(rows[:, -1], -SMALLEST)[-SMALLEST:]]
        return Past(rows=alike, stretch=max(1.0, found.activity / float(np.median(alike[:, -1]))) ** 2)


def _row(found: Comparison) -> Array:
    return np.concatenate([found.errors, found.evidence, found.leverage, [found.squares, found.activity]])


def _judged(rows: Array) -> Array:
    """What may raise an alarm."""
    return np.column_stack([np.log(np.maximum(rows[:, :2], 1e-6)), rows[:, _DETECTING]])
