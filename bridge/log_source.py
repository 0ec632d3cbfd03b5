"""Plays a log at its own pace, or faster, as if it came over a link."""

import time
from bisect import bisect_right
from collections.abc import Callable, Mapping
from math import isinf

from bridge.errors import LinkClosed
from bridge.links.udp import monotonic_us
from bridge.logs import LogReading
from bridge.measurement import Measurement

_BATCH = 1000  # measurements per read at infinite speed


class LogSource:
    """A Source of the measurements of one log; nothing can be published into it.

    speed     log seconds per second; inf gives everything as fast as it is read
    clock_us  monotonic clock; `sleep` waits on the same clock
    """

    def __init__(
        self,
        reading: LogReading,
        *,
        speed: float = 1.0,
        clock_us: Callable[[], int] = monotonic_us,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        if not speed > 0.0:
            raise ValueError(f"log_speed must be > 0 (got {speed})")
        self.counts = reading.counts
        self.notes = reading.notes
        self._measurements = reading.measurements
        self._times = [item.t_us for item in reading.measurements]
        self._speed = speed
        self._clock_us = clock_us
        self._sleep = sleep
        self._started_us: int | None = None
        self._next = 0

    def read(self, timeout_s: float) -> list[Measurement]:
        """What is due by now, waiting at most `timeout_s`; LinkClosed after the last measurement."""
        if self._next >= len(self._measurements):
            raise LinkClosed("the log has ended")
        if isinf(self._speed):
            return self._up_to(self._next + _BATCH)
        if self._started_us is None:
            self._started_us = self._clock_us()
        wait_s = self._seconds_until(self._times[self._next])
        if wait_s > 0.0:
            self._sleep(min(wait_s, max(0.0, timeout_s)))
        elapsed_us = (self._clock_us() - self._started_us) * self._speed
        return self._up_to(bisect_right(self._times, self._times[0] + elapsed_us))

    def publish(self, t_us: int, values: Mapping[str, float]) -> None:
        """A log hears nothing."""

    def warn(self, t_us: int, notice: str, values: Mapping[str, float]) -> None:
        """A log hears nothing."""

    def close(self) -> None:
        self._next = len(self._measurements)

    def _seconds_until(self, t_us: int) -> float:
        assert self._started_us is not None
        log_s = (t_us - self._times[0]) * 1e-6 / self._speed
        return log_s - (self._clock_us() - self._started_us) * 1e-6

    def _up_to(self, stop: int) -> list[Measurement]:
        batch = self._measurements[self._next : stop]
        self._next += len(batch)
        return batch
