"""When which message is due, and how simulated time is held to the clock on the wall."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field


def regular() -> float:
    """No deviation."""
    return 0.0


@dataclass(slots=True)
class Timetable:
    """One message's regular times since a boot; each may be off by a random share of a sample.

    rate_hz  0: never
    off      the deviation of the next time, s
    """

    rate_hz: float
    off: Callable[[], float] = regular
    count: int = 0
    due_s: float = field(init=False, default=math.inf)

    def __post_init__(self) -> None:
        self.set_rate(self.rate_hz, -1.0)

    def set_rate(self, rate_hz: float, now_s: float) -> None:
        """From the next whole multiple of the new interval on."""
        self.rate_hz = rate_hz
        self.count = max(math.floor(now_s * rate_hz + 1e-6), -1)
        self.advance()

    def advance(self) -> None:
        """Moves on to the next time."""
        self.count += 1
        self.due_s = max(self.count / self.rate_hz + self.off(), 0.0) if self.rate_hz > 0.0 else math.inf


class Pace:
    """Simulated seconds on a monotonic clock, `speed` times as fast, without drift."""

    def __init__(self, speed: float, clock: Callable[[], float]) -> None:
        self.speed = speed
        self.clock = clock
        self.start = clock()

    def seconds_until(self, t_s: float) -> float:
        """Seconds on the wall until simulated time `t_s`; negative when late."""
        return t_s / self.speed - (self.clock() - self.start)
