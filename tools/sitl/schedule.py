"""When which message is due, and how simulated time is held to the clock on the wall."""

import math
from collections.abc import Callable

import numpy as np


class Timetable:
    """One message's regular times since a boot, each off by up to `jitter_s`; a rate of 0 means never."""

    def __init__(self, rate_hz: float, jitter_s: float, rng: np.random.Generator) -> None:
        self.jitter_s = jitter_s
        self.rng = rng
        self.rate_hz = rate_hz
        self.count = 0
        self.due_s = 0.0 if rate_hz > 0.0 else math.inf

    def set_rate(self, rate_hz: float, now_s: float) -> None:
        """From the next whole multiple of the new interval on."""
        self.rate_hz = rate_hz
        self.count = math.floor(now_s * rate_hz + 1e-6)
        self.advance()

    def advance(self) -> None:
        """Moves on to the next time."""
        self.count += 1
        if self.rate_hz == 0.0:
            self.due_s = math.inf
            return
        self.due_s = self.count / self.rate_hz
        if self.jitter_s > 0.0:
            self.due_s += min(self.jitter_s, 0.49 / self.rate_hz) * self.rng.uniform(-1.0, 1.0)


class Pace:
    """Simulated seconds on a monotonic clock, `speed` times as fast, without drift."""

    def __init__(self, speed: float, clock: Callable[[], float]) -> None:
        self.speed = speed
        self.clock = clock
        self.start = clock()

    def seconds_until(self, t_s: float) -> float:
        """Seconds on the wall until simulated time `t_s`; negative when late."""
        return t_s / self.speed - (self.clock() - self.start)
