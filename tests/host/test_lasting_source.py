"""A lost link is opened again, nothing is joined across, and giving up has a bound."""

from collections import Counter
from collections.abc import Mapping

import pytest

from bridge.errors import LinkClosed, LinkError
from bridge.measurement import Measurement, Quantity
from host.live.lasting_source import LastingSource


class Time:
    """A clock that only `sleep` moves."""

    def __init__(self) -> None:
        self.now = 100.0

    def clock(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        assert seconds > 0
        self.now += seconds


class Scripted:
    """Gives one boot number per read, then closes."""

    def __init__(self, boots: list[int]) -> None:
        self.counts: Counter[str] = Counter()
        self.notes: list[str] = []
        self.boots = boots
        self.published: list[float] = []
        self.is_closed = False

    def read(self, timeout_s: float) -> list[Measurement]:  # noqa: ARG002
        if not self.boots:
            raise LinkClosed("unplugged")
        self.counts["ATTITUDE"] += 1
        return [Measurement(quantity=Quantity.PITCH, value=0.0, t_us=0, source="x", boot=self.boots.pop(0))]

    def warn(self, t_us: int, notice: str, values: Mapping[str, float]) -> None:  # noqa: ARG002
        if not self.boots:
            raise LinkClosed("unplugged")
        self.published.append(values["mismatch"])

    def publish(self, t_us: int, values: Mapping[str, float]) -> None:  # noqa: ARG002
        if not self.boots:
            raise LinkClosed("unplugged")
        self.published.append(values["a1"])

    def close(self) -> None:
        self.is_closed = True


class Setting:
    """A first source, and what each attempt to reopen gives."""

    def __init__(self, first: Scripted, later: list[Scripted | None], reopen_for: float = 60.0) -> None:
        self.time = Time()
        self.attempts: list[float] = []
        self.said: list[str] = []
        self.later = later
        self.source = LastingSource(
            first,
            self.reopen,
            reopen_for=reopen_for,
            clock=self.time.clock,
            sleep=self.time.sleep,
            say=self.said.append,
        )

    def reopen(self) -> Scripted:
        self.attempts.append(self.time.now)
        source = self.later.pop(0) if self.later else None
        if source is None:
            raise LinkError("no such device")
        return source

    def boots(self, reads: int) -> list[int]:
        return [m.boot for _ in range(reads) for m in self.source.read(0.1)]


def test_a_reopened_link_counts_on_and_starts_a_new_boot() -> None:
    first, second = Scripted([0, 1]), Scripted([0, 0])
    setting = Setting(first, [None, second])
    assert setting.boots(50) == [0, 1, 2, 2]
    assert first.is_closed
    counts = setting.source.counts
    assert counts["ATTITUDE"] == 4
    assert (counts["link.lost"], counts["link.reopened"]) == (2, 1)
    assert setting.said[0] == "link lost (unplugged); trying to open it again for 60 s"
    assert setting.said[1] == "measurements come again after 1.5 s"
    assert len(setting.said) == 3


def test_attempts_grow_rarer_and_end() -> None:
    setting = Setting(Scripted([0]), [])
    with pytest.raises(LinkClosed, match="given up"):
        setting.boots(10_000)
    waits = [b - a for a, b in zip([100.0, *setting.attempts], setting.attempts, strict=False)]
    assert waits == pytest.approx([0.5, 1, 2, 4, 8, *[10] * (len(waits) - 5)])
    assert 160 <= setting.time.now < 172
    assert len(setting.said) == 1
    with pytest.raises(LinkClosed, match="given up"):
        setting.source.read(0.1)


def test_a_link_that_opens_and_closes_at_once_is_still_lost() -> None:
    setting = Setting(Scripted([0]), [Scripted([]) for _ in range(100)])
    with pytest.raises(LinkClosed, match="given up"):
        setting.boots(10_000)
    assert len(setting.said) == 1
    assert setting.source.counts["link.lost"] == 1
    assert 9 <= setting.source.counts["link.reopened"] <= 12


def test_a_link_that_is_not_to_be_reopened_ends_at_once() -> None:
    setting = Setting(Scripted([0]), [Scripted([0])], reopen_for=0.0)
    setting.source.read(0.1)
    with pytest.raises(LinkClosed, match="unplugged"):
        setting.source.read(0.1)
    assert setting.attempts == []
    assert setting.said == []


def test_publishing_waits_for_the_link_and_leaves_its_loss_to_the_next_read() -> None:
    first = Scripted([0])
    setting = Setting(first, [])
    setting.source.publish(0, {"a1": 1.0})
    assert first.published == [1.0]
    setting.source.read(0.1)
    setting.source.publish(0, {"a1": 2.0})
    setting.source.publish(0, {"a1": 3.0})
    assert setting.source.counts["link.lost"] == 1
    assert setting.source.read(0.1) == []


def test_a_closed_source_stays_closed_and_keeps_its_counts() -> None:
    first = Scripted([0, 0])
    setting = Setting(first, [Scripted([0])])
    setting.source.read(0.1)
    setting.source.close()
    setting.source.close()
    assert first.is_closed
    assert setting.source.counts["ATTITUDE"] == 1
    with pytest.raises(LinkClosed):
        setting.source.read(0.1)
