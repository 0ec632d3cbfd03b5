"""The last values of a sensor, which tell among themselves whether the newest is one of them."""

import math

NORMAL = 1.4826
"""Standard deviation over median distance, normal errors."""
GATE, NOISE_GATE = 2.5, 5.0
"""Standard deviations, of the spread about the line and of the sensor's noise, within which values belong."""


class RecentValues:
    """Up to `size` values and their instants, and the line on which most of them lie.

    The line is that of the least median of squares through any two of them (P. J. Rousseeuw, J. American
    Statistical Association 79(388), 1984): fewer than half of the values may be anything. Their spread about
    it is 1.4826 (1 + 5/(size - 2)) times the median distance, and what is more than 2.5 times that off does
    not belong to them (Rousseeuw and Leroy, Robust Regression and Outlier Detection, 1987, ch. 5).

    size  3 or more
    """

    def __init__(self, size: int) -> None:
        self._instants = [0] * size
        self._values = [0.0] * size
        self._distances = [0.0] * size
        self._majority = size // 2  # index of the median distance
        self._spread = NORMAL * (1.0 + 5.0 / (size - 2))
        self.clear()

    def clear(self) -> None:
        """Forgets them."""
        self._count = 0
        self._newest = 0

    def put(self, instant: int, value: float) -> None:
        """Takes a value; instants rise from one to the next."""
        size = len(self._values)
        self._newest = self._newest + 1 if self._newest + 1 < size else 0
        self._instants[self._newest] = instant
        self._values[self._newest] = value
        if self._count < size:
            self._count += 1

    def newest_belongs(self, std: float, is_strict: bool = False) -> bool:
        """Whether there are `size` values and the newest lies where most do.

        std        of the sensor's noise: values that lie on a line by chance do not make a narrower one
        is_strict  no if most are themselves further off than noise takes them: motion, or spikes upon spikes
        """
        size = len(self._values)
        if self._count < size:
            return False
        least, off = math.inf, math.inf
        t, y, distances = self._instants, self._values, self._distances
        for i in range(size):
            for j in range(i):
                slope = (y[i] - y[j]) / (t[i] - t[j])
                for k in range(size):
                    distances[k] = abs(y[k] - y[i] - slope * (t[k] - t[i]))
                newest = distances[self._newest]
                distances.sort()
                if distances[self._majority] < least:
                    least, off = distances[self._majority], newest
        if is_strict:
            return max(off, least) <= NOISE_GATE * std
        return off <= max(GATE * self._spread * least, NOISE_GATE * std)
