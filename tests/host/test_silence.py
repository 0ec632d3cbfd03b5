"""Silences are said once each, and their end too."""

from bridge.measurement import Quantity
from host.live.silence import SilenceWatch


def test_a_silence_and_its_end_are_said_once() -> None:
    watch = SilenceWatch(5.0, 0.0)
    assert watch.check(5.0) == []
    assert watch.check(5.1) == ["no depth, no pitch, no rudder for 5 s"]
    assert watch.check(9.0) == []
    assert watch.hear(Quantity.PITCH, 9.0) == ["pitch is back after 9.0 s"]
    assert watch.hear(Quantity.PITCH, 9.1) == []
    assert watch.check(14.2) == ["no pitch for 5 s"]


def test_what_was_never_heard_is_known() -> None:
    watch = SilenceWatch(5.0, 0.0)
    watch.hear(Quantity.SPEED, 1.0)
    watch.hear(Quantity.PITCH, 1.0)
    watch.hear(Quantity.PITCH, 2.0)
    assert watch.never_heard == [Quantity.DEPTH, Quantity.RUDDER]
