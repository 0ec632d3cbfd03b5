"""What was usual before: the windows of the past, by which a new one is judged."""

from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from host.live.evidence import Evidence, Lacking
from host.live.innovations import MARKS, NAMES
from host.live.reference import Array

SMALLEST = 60  # windows that judge
HELD_BACK = 40  # windows that are not yet history: the beginning of a fault must not set its own level
CAUTION = 400.0  # windows; over the number of those known, by so much more may yet be usual
WILDEST = 4  # the largest of the past but for three is the most that is usual
WHITE = 2.7  # the least that it can be for a ratio: white noise has as much
OVERLAP = 40.0  # windows that tell no more of what the reference lacks than one, for they share their samples
RIDGE = 20.0  # windows' worth of belief that the reference lacks nothing

DETECTING = [NAMES.index(name) for name in ("heave_force", "pitch_moment", "plane_force")]
"""The changes whose evidence alone may raise an alarm: the least heavy-tailed at sea."""


class Comparison(NamedTuple):
    """One window: rms prediction error of pitch and depth, (2,), by their levels, and the evidence."""

    errors: Array
    evidence: Evidence

    @property
    def activity(self) -> float:
        """By how much the plane moves the vehicle."""
        return float(self.evidence.leverage[0, NAMES.index("plane_force")])


@dataclass(frozen=True, slots=True, kw_only=True)
class Past:
    """What is usual: windows of the past, by the first index.

    stretch  by which what they missed must be multiplied for a vehicle that moves more than it did in them
    """

    errors: Array
    ratios: Array
    squares: Array
    stretch: float = 1.0

    def strength(self, found: Comparison) -> Array:
        """The ratios of `DETECTING`, (moments, 3), by the largest that are usual."""
        usual = np.partition(np.abs(self.ratios[:, :, DETECTING]), -WILDEST, axis=0)[-WILDEST]
        most = self.stretch * np.maximum(usual, WHITE) * (1.0 + CAUTION / len(self.ratios))
        strength: Array = found.evidence.ratios[:, DETECTING] / most
        return strength

    def growth(self, found: Comparison) -> Array:
        """Both errors, (2,), by twice the largest that are usual."""
        usual = np.partition(self.errors, -WILDEST, axis=0)[-WILDEST]
        growth: Array = found.errors / (2.0 * self.stretch * usual * (1.0 + CAUTION / len(self.errors)))
        return growth

    @property
    def usual_errors(self) -> Array:
        """Rms prediction error of pitch and depth, (2,)."""
        errors: Array = self.stretch * np.sqrt(np.mean(self.errors**2, axis=0))
        return errors


class PredictionHistory:
    """The last `length` windows, each with the evidence since so many `moments`, but for the newest."""

    def __init__(self, length: int, moments: int) -> None:
        self._errors = np.empty((length, 2))
        self._ratios = np.empty((length, moments, len(NAMES)))
        self._squares = np.empty((length, moments))
        self._activity = np.empty(length)
        self._keep = 1.0 - 1.0 / length
        self._newest: deque[Comparison] = deque()
        self.clear()

    def clear(self) -> None:
        self.size = 0
        """Windows that count."""
        self._newest.clear()
        self.begin_lacking()

    def begin_lacking(self) -> None:
        """Another reference lacks other things."""
        self._gram, self._products, self._weight = np.zeros((len(MARKS),) * 2), np.zeros(len(MARKS)), 0.0

    @property
    def lacking(self) -> Lacking:
        """What the reference lacked in all windows, by least squares; little where there were few."""
        if not self._weight:
            return Lacking(self._products, self._gram)
        belief = RIDGE / self._weight * np.diag(self._gram)
        inverse: Array = np.asarray(np.linalg.inv(self._gram + np.diag(belief + 1e-12)))
        return Lacking(inverse @ self._products, OVERLAP * inverse)

    def add(self, found: Comparison) -> None:
        """Takes a window; it counts after `HELD_BACK` more."""
        self._newest.append(found)
        if len(self._newest) <= HELD_BACK:
            return
        known = self._newest.popleft()
        k = self.size % len(self._errors)
        self._errors[k], self._activity[k] = known.errors, known.activity
        self._ratios[k], self._squares[k] = known.evidence.ratios, known.evidence.squares
        self.size += 1
        self._gram = self._keep * self._gram + known.evidence.gram
        self._products = self._keep * self._products + known.evidence.products
        self._weight = self._keep * self._weight + 1.0

    def usual_for(self, found: Comparison) -> Past | None:
        """The windows so far. None before there are enough to judge by.

        An error that is quadratic in the motion, as of drag, is the worst that a smooth hull can hide.
        """
        known = min(self.size, len(self._errors))
        if known < SMALLEST:
            return None
        return Past(
            errors=self._errors[:known],
            ratios=self._ratios[:known],
            squares=self._squares[:known],
            stretch=max(1.0, found.activity / float(self._activity[:known].max())) ** 2,
        )
