"""A log played at its own pace by a clock that is passed in."""

from collections import Counter
from math import inf

import pytest

from bridge.errors import LinkClosed
from bridge.log_source import LogSource
from bridge.logs import LogReading
from bridge.measurement import Measurement, Quantity

MEASUREMENTS = [
    Measurement(quantity=Quantity.PITCH, value=0.0, t_us=7_000_000 + 100_000 * k, source="x")
    for k in range(25)
]


class Clock:
    """Time that passes only while somebody sleeps."""

    def __init__(self) -> None:
        self.now_us = 123

    def __call__(self) -> int:
        return self.now_us

    def sleep(self, seconds: float) -> None:
        assert seconds >= 0.0
        self.now_us += round(seconds * 1e6)


def playing(speed: float, measurements: list[Measurement] = MEASUREMENTS) -> tuple[LogSource, Clock]:
    clock = Clock()
    reading = LogReading(measurements=measurements, counts=Counter(), notes=[])
    return LogSource(reading, speed=speed, clock_us=clock, sleep=clock.sleep), clock


def play(source: LogSource, timeout_s: float = 0.25) -> list[Measurement]:
    out: list[Measurement] = []
    while True:
        try:
            out += source.read(timeout_s)
        except LinkClosed:
            return out


@pytest.mark.parametrize("speed", [0.5, 1.0, 10.0])
def test_log_lasts_its_own_time_over_the_speed(speed: float) -> None:
    source, clock = playing(speed)
    assert play(source) == MEASUREMENTS
    assert clock.now_us - 123 == pytest.approx(2_400_000 / speed, abs=10)


def test_nothing_comes_early_and_a_read_waits_at_most_its_timeout() -> None:
    source, clock = playing(1.0)
    assert source.read(0.0) == MEASUREMENTS[:1]
    assert source.read(0.04) == []
    assert clock.now_us - 123 == 40_000
    assert source.read(1.0) == MEASUREMENTS[1:2]
    assert clock.now_us - 123 == 100_000


def test_late_reader_gets_everything_that_was_due() -> None:
    source, clock = playing(1.0)
    source.read(0.0)
    clock.now_us += 550_000
    assert source.read(0.0) == MEASUREMENTS[1:6]


def test_infinite_speed_never_waits() -> None:
    source, clock = playing(inf)
    assert play(source) == MEASUREMENTS
    assert clock.now_us == 123


def test_closed_or_empty_log_has_ended() -> None:
    source, _ = playing(1.0)
    source.close()
    source.close()
    assert play(source) == []
    assert play(playing(1.0, [])[0]) == []


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan")])
def test_bad_speed_is_named(speed: float) -> None:
    with pytest.raises(ValueError, match=r"^log_speed must be > 0 \(got "):
        playing(speed)


def test_publishing_into_a_log_does_nothing() -> None:
    playing(1.0)[0].publish(0, {"a1": 1.0})
