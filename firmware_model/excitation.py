"""Do the signals move enough to tell anything?"""

import math


class MovingVariance:
    """Exponentially weighted mean and variance over `samples` samples; missing ones (NaN) are passed over."""

    def __init__(self, samples: float) -> None:
        self._weight = 1.0 - math.exp(-1.0 / samples)
        self.reset()

    def reset(self) -> None:
        self.mean = math.nan
        self.variance = 0.0

    def update(self, value: float) -> None:
        if not math.isfinite(value):
            return
        if not math.isfinite(self.mean):
            self.mean = value
            return
        change = value - self.mean
        spread = (1.0 - self._weight) * (self.variance + self._weight * change * change)
        if spread < math.inf:  # a value that overflows its square would never leave the average
            self.mean += self._weight * change
            self.variance = spread

    @property
    def std(self) -> float:
        return math.sqrt(self.variance)
