"""What a plane did between its readings, where these are further apart than the rows.

A command that is logged, or sent, less often than pitch stands in several rows, and rows may be lost. A plane
that repeats its readings steps: from delta_i to delta_(i+1) at a moment T_i + f_i (T_(i+1) - T_i) that nobody
recorded. Another swings through its readings, as Akima's curve does, but where it moved at once. A row's
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
STEPPING = 0.3  # of the readings that repeat the one before
JUMP = 5.0  # times as fast as just before and just after: no swing


def step_means(time: Array, levels: Array, begins: Array, ends: Array) -> Array:
    """Means (N,) from `begins` to `ends` of what steps at each of `time` (J,) through `levels` (J + 1,)."""
    areas = np.append(0.0, np.cumsum(levels[1:-1] * np.diff(time)))

    def area(t: Array) -> Array:
        """Under the steps, from the first of them on."""
        passed = np.searchsorted(time, t, side="right")
        last = np.maximum(passed - 1, 0)
        return np.asarray(areas[last] + levels[passed] * (t - time[last]))

    return np.asarray((area(ends) - area(begins)) / (ends - begins))


@dataclass(frozen=True, slots=True, eq=False)
class PlaneReadings:
    """Readings of a plane that was not read in every row.

    time   s (K,), increasing, on the recording's axis
    angle  rad (K,)
    step   s, of the recording's rows
    pace   s, of the instants at which it may have stepped; 0 for any
    is_doubtful  each row may have a reading: one told to step at this pace leaves the same table
    """

    time: Array
    angle: Array
    step: float
    pace: float = 0.0
    is_doubtful: bool = False

    @property
    def is_slow(self) -> bool:
        """Whether there is no reading in most of the rows, and not just in some that were lost."""
        return bool(np.median(np.diff(self.time)) > UNSEEN * self.step)

    @property
    def steps(self) -> NDArray[np.intp]:
        """The intervals between two readings in which the plane stepped unseen."""
        return np.flatnonzero(self._is_unseen & (self._jumps() != 0.0))

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
    def is_stepping(self) -> bool:
        """Whether it holds its angle from step to step, as no plane that swings does."""
        return bool(np.mean(np.diff(self.angle) == 0.0) > STEPPING)

    @property
    def _is_unseen(self) -> NDArray[np.bool_]:
        return np.diff(self.time) > UNSEEN * self.step

    def _jumps(self) -> Array:
        """rad in each interval (K - 1,): all that a stepping plane moved, and what another did at once."""
        changes = np.diff(self.angle)
        if self.is_stepping:
            return changes
        gaps = np.diff(self.time)
        slopes = np.pad(changes / gaps, 1, mode="edge")
        before, here, after = slopes[:-2], slopes[1:-1], slopes[2:]
        is_jump = np.abs(here) > JUMP * np.maximum(np.abs(before), np.abs(after))
        return np.where(is_jump & self._is_unseen, changes - gaps * (before + after) / 2.0, 0.0)

    def means(
        self, begins: Array, ends: Array, moments: Array | None = None, holds_between: bool = False
    ) -> Array:
        """Mean angle, rad (N,), from each of `begins` to each of `ends`, s.

        moments  f of each of `steps`, 0 to 1; left out, their means. What was seen steps at a reading.
        holds_between  whether what swings was held from row to row of those that nobody read, too
        """
        from scipy.interpolate import Akima1DInterpolator  # tables are replayed where there is no scipy

        gaps, at, jumps = np.diff(self.time), np.ones(self.time.size - 1), self._jumps()
        at[self.steps] = self.mean_moments if moments is None else moments
        jumped, moved = self.time[:-1] + at * gaps, np.append(0.0, np.cumsum(jumps))
        swing = Akima1DInterpolator(self.time, self.angle - moved)
        late = self.pace / 2.0 if holds_between else 0.0
        early, middle, end = (
            swing(np.clip(t - late, self.time[0], self.time[-1]))
            for t in (begins, (begins + ends) / 2.0, ends)
        )
        return np.asarray(step_means(jumped, moved, begins, ends) + (early + 4.0 * middle + end) / 6.0)
