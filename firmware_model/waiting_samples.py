"""Samples that wait for the next measured rudder, which says whether it turned on the way to them."""

import math


class WaitingSamples:
    """Pitch and depth at up to `size` instants after the last measured rudder; NaN where there are none."""

    def __init__(self, size: int) -> None:
        self._pitch = [math.nan] * size
        self._depth = [math.nan] * size
        self.newest = 0
        """The instant of the newest one, 1 for the first after the rudder; 0 for none."""

    def clear(self) -> None:
        """Forgets them."""
        for k in range(self.newest):
            self._pitch[k] = self._depth[k] = math.nan
        self.newest = 0

    def put(self, instant: int, pitch: float, depth: float) -> None:
        """Keeps a sample, 1 <= instant <= size."""
        self._pitch[instant - 1] = pitch
        self._depth[instant - 1] = depth
        self.newest = instant

    def at(self, instant: int) -> tuple[float, float]:
        """Pitch and depth at that instant."""
        if instant > self.newest:
            return math.nan, math.nan
        return self._pitch[instant - 1], self._depth[instant - 1]
