"""The rudder as a mix of outputs, and back."""

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.mavlink_map import ServoTerm
from bridge.servo_mix import ServoMix, pulses_for

THRUSTERS = tuple(
    ServoTerm(channel=channel, rad_per_us=sign * 6.25e-4)
    for channel, sign in ((5, 1), (6, 1), (7, -1), (8, -1))
)


def test_two_planes_and_thrusters_are_linear_mixes() -> None:
    mix = ServoMix(THRUSTERS, Counter())
    assert mix.rudder({5: 1900, 6: 1900, 7: 1100, 8: 1100}) == pytest.approx(1.0)
    # All four alike push the vehicle up or down and pitch nothing.
    assert mix.rudder({5: 1700, 6: 1700, 7: 1700, 8: 1700}) == pytest.approx(0.0)


@pytest.mark.parametrize("off", [0, 65535, 499, 2501])
def test_output_that_is_off_gives_no_rudder(off: int) -> None:
    counts: Counter[str] = Counter()
    assert ServoMix(THRUSTERS, counts).rudder({5: 1500, 6: 1500, 7: 1500, 8: off}) is None
    assert counts == {"refused.servo_off": 1}


def test_channels_above_16_come_with_their_own_message() -> None:
    terms = (ServoTerm(channel=20, rad_per_us=1e-3), ServoTerm(channel=2, rad_per_us=-1e-3))
    mix = ServoMix(terms, Counter())
    assert mix.rudder({2: 1400}) is None
    assert mix.rudder({20: 1600}) == pytest.approx(0.2)


@given(rudder=st.floats(-1.0, 1.0))
def test_pulses_for_a_rudder_mix_back_to_it(rudder: float) -> None:
    pulses = pulses_for(rudder, THRUSTERS)
    assert ServoMix(THRUSTERS, Counter()).rudder(pulses) == pytest.approx(rudder, abs=4 * 6.25e-4 * 0.5)


def test_vehicle_without_rudder_outputs_has_none() -> None:
    assert ServoMix((), Counter()).rudder({1: 1500}) is None
