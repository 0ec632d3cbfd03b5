"""The recent measurements of one quantity, and what they say of an instant between them."""

from bisect import bisect_right
from collections import deque
from itertools import pairwise
from math import inf, nan

# An interval longer than so many usual ones has lost a measurement: halfway between none and one.
_LOST_ONE = 1.5

# Of the last so many intervals, this share is taken for too short to have lost one, however many are lost.
_INTERVALS = 32
_SHARE = 0.2


class Channel:
    """The recent measurements of one quantity, in order of time."""

    def __init__(self) -> None:
        self.times: list[int] = []
        self.values: list[float] = []
        self._intervals: deque[int] = deque(maxlen=_INTERVALS)  # before those that are kept

    def append(self, t_us: int, value: float) -> None:
        self.times.append(t_us)
        self.values.append(value)

    def forget_before(self, t_us: int) -> None:
        """Drops what no instant from `t_us` on can need: all but the last at or before it."""
        old = bisect_right(self.times, t_us) - 1
        if old > 0:
            self._intervals.extend(after - before for before, after in pairwise(self.times[: old + 1]))
            del self.times[:old], self.values[:old]

    def interpolated(self, t_us: int, max_gap_us: int, near_us: int) -> float:
        right = bisect_right(self.times, t_us)
        near = [i for i in (right - 1, right) if 0 <= i < len(self.times)]
        best = min(near, key=lambda i: abs(self.times[i] - t_us), default=None)
        if best is None:
            return nan
        if abs(self.times[best] - t_us) <= near_us:
            return self.values[best]
        if len(near) < 2 or self.times[right] - self.times[right - 1] > max_gap_us:
            return nan
        before, after = self.values[right - 1], self.values[right]
        share = (t_us - self.times[right - 1]) / (self.times[right] - self.times[right - 1])
        # Rounding must not leave the interval between the neighbours.
        return min(max(before + share * (after - before), min(before, after)), max(before, after))

    def held_mean(self, t_us: int, until_us: int, hold_us: int, near_us: int) -> float:
        """Mean from `t_us` to `until_us` of values that each hold until the next one."""
        first = bisect_right(self.times, t_us + near_us) - 1
        if first < 0 or t_us - self.times[first] > hold_us:
            return nan
        last = bisect_right(self.times, until_us - near_us)
        mean, end_us = self.values[first], until_us
        for k in range(last - 1, first, -1):
            mean += (self.values[k] - self.values[first]) * (end_us - self.times[k]) / (until_us - t_us)
            end_us = self.times[k]
        return mean

    @property
    def _usual_interval(self) -> float:
        """Mean of the recent intervals in which nothing was lost; inf before there are any."""
        if not self._intervals:
            return inf
        short = sorted(self._intervals)[int(_SHARE * len(self._intervals))]
        whole = [interval for interval in self._intervals if interval <= _LOST_ONE * short]
        return sum(whole) / len(whole)

    def has_lost_change(self, t_us: int, until_us: int, known_to_us: int, near_us: int) -> bool:
        """Whether from `t_us` to `until_us` the value may have changed unheard.

        A value holds until the next one is due. Beyond that it holds if the next one was not lost, or says
        the same. What came after `known_to_us` is not looked at.
        """
        first = max(0, bisect_right(self.times, t_us + near_us) - 1)
        last = bisect_right(self.times, until_us - near_us)
        usual = self._usual_interval
        for k in range(first, last):
            if self.times[k] + usual >= until_us - near_us:
                continue
            is_heard = k + 1 < len(self.times) and self.times[k + 1] <= known_to_us
            next_us = self.times[k + 1] if is_heard else known_to_us
            is_same = is_heard and self.values[k + 1] == self.values[k]
            if next_us - self.times[k] > _LOST_ONE * usual and not is_same:
                return True
        return False
