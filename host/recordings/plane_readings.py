"""What a plane did between its readings, where these are further apart than the rows.

A command that is logged, or sent, less often than pitch stands in several rows, and rows may be lost. Where
the plane went from delta_i to delta_(i+1) unseen, it either moved on evenly, or it stepped at a moment
T_i + f_i (T_(i+1) - T_i) that nobody recorded. One that repeats its readings steps; another is taken to have
moved as evenly as it did beside, as in host.recordings.plane_between_rows, and the rest is a step. A row's
angle is the mean until the next row.

What a table tells steps at its rows, as where each row has a reading: of the k rows up to the next reading it
may have been any, and f_i has the mean (1 + 1/k) / 2 and the variance (1 - 1/k^2) / 12. A message may come at
any time, k without end.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
UNSEEN = 1.5  # steps between two readings, beyond which one is missing
STEPPING = 0.3  # of the readings that repeat the one before: no plane that moves on evenly does


@dataclass(frozen=True, slots=True, eq=False)
class PlaneReadings:
    """Readings of a plane that was not read in every row.

    time   s (K,), increasing, on the recording's axis
    angle  rad (K,)
    step   s, of the recording's rows
    pace   s, of the instants at which it may have stepped; 0 for any
    """

    time: Array
    angle: Array
    step: float
    pace: float = 0.0

    @property
    def is_slow(self) -> bool:
        """Whether there is no reading in most of the rows, and not just in some that were lost."""
        return bool(np.median(np.diff(self.time)) > UNSEEN * self.step)

    @property
    def steps(self) -> NDArray[np.intp]:
        """The intervals between two readings in which the plane stepped unseen."""
        return np.flatnonzero(self._is_unseen & (np.abs(self._rest()) > 0.0))

    @property
    def mean_moments(self) -> Array:
        """Of each of `steps`, before anything is known of it."""
        return (1.0 + self._share_of_a_pace()) / 2.0

    @property
    def moment_variances(self) -> Array:
        """The same."""
        return (1.0 - self._share_of_a_pace() ** 2) / 12.0

    def _share_of_a_pace(self) -> Array:
        return np.minimum(self.pace / np.diff(self.time)[self.steps], 1.0)

    @property
    def _is_unseen(self) -> NDArray[np.bool_]:
        return np.diff(self.time) > UNSEEN * self.step

    def _even(self) -> Array:
        """rad/s in each interval (K - 1,), of what moved on evenly; 0 where the plane was seen to hold."""
        changes = np.diff(self.angle)
        if np.mean(changes == 0.0) > STEPPING:
            return np.zeros_like(changes)
        slopes = changes / np.diff(self.time)
        padded = np.abs(np.pad(slopes, 1, mode="edge"))
        beside = 2.0 * np.maximum(padded[:-2], padded[2:])
        return np.where(self._is_unseen, np.clip(slopes, -beside, beside), 0.0)

    def _rest(self) -> Array:
        return np.diff(self.angle) - self._even() * np.diff(self.time)

    def means(
        self, begins: Array, ends: Array, moments: Array | None = None, holds_between: bool = False
    ) -> Array:
        """Mean angle, rad (N,), from each of `begins` to each of `ends`, s.

        moments  f of each of `steps`, 0 to 1; left out, their means. What was seen steps at a reading.
        holds_between  whether what moved evenly from reading to reading was held from `begins` to `ends`
        """
        gaps, at = np.diff(self.time), np.ones(self.time.size - 1)
        at[self.steps] = self.mean_moments if moments is None else moments
        jumps, rest = self.time[:-1] + at * gaps, self._rest()
        levels = self.angle[0] + np.append(0.0, np.cumsum(rest))
        areas = np.append(0.0, np.cumsum(levels[1:-1] * np.diff(jumps)))

        def area(t: Array) -> Array:
            """Under the steps, from the first of them on."""
            passed = np.searchsorted(jumps, t, side="right")
            since = t - jumps[np.maximum(passed - 1, 0)]
            return np.asarray(areas[np.maximum(passed - 1, 0)] + levels[passed] * since)

        evenly = np.append(0.0, np.cumsum(self._even() * gaps))
        reached = np.interp(begins, self.time, evenly)
        if not holds_between:
            reached = (reached + np.interp(ends, self.time, evenly)) / 2.0
        return np.asarray((area(ends) - area(begins)) / (ends - begins) + reached)
