"""What the drive of the plane makes of a command."""

from math import exp

import pytest

from tools.sitl.actuator import Actuator
from tools.sitl.effects import Effects, Timed


def planes(effects: Effects, commands: list[float]) -> list[float]:
    actuator = Actuator(effects, step_s=0.01)
    return [actuator.move(command)[2] for command in commands]


def test_ideal_drive_follows_at_once():
    assert Actuator(Effects(), 0.01).move(0.2) == (0.2, 0.2, 0.2)


def test_lag_is_exact_at_the_middle_and_the_end_of_a_step():
    begin, middle, end = Actuator(Effects(actuator_lag=0.1), 0.01).move(1.0)
    assert begin == 0.0
    assert middle == pytest.approx(1 - exp(-0.05), rel=1e-12)
    assert end == pytest.approx(1 - exp(-0.1), rel=1e-12)


def test_delay_moves_the_command_by_its_time():
    got = planes(Effects(actuator_delay=0.05), [0.1] * 20)
    assert got == [0.0] * 5 + [0.1] * 15


def test_rate_limit_makes_a_ramp():
    got = planes(Effects(actuator_rate_limit=0.5), [0.1] * 30)
    assert got[9] == pytest.approx(0.05)
    assert got[-1] == pytest.approx(0.1)


def test_stops_hold_the_plane():
    assert planes(Effects(actuator_saturation=0.15), [0.3, -0.3]) == [0.15, -0.15]


def test_backlash_swallows_a_reversal_up_to_its_width():
    got = planes(Effects(actuator_backlash=0.02), [0.1, 0.085, 0.07])
    assert got == pytest.approx([0.09, 0.09, 0.08])


def test_offset_is_added_behind_the_stops():
    assert planes(Effects(rudder_offset=0.02, actuator_saturation=0.1), [0.3]) == pytest.approx([0.12])


def test_stalled_plane_loses_lift_to_both_sides():
    actuator = Actuator(Effects(rudder_stall=0.2), 0.01)
    assert actuator.lift_angle(0.2, 0.0) == 0.2
    assert actuator.lift_angle(0.3, 0.0) == pytest.approx(0.15)
    assert actuator.lift_angle(-0.3, 0.0) == pytest.approx(-0.15)
    assert actuator.lift_angle(1.0, 0.0) == pytest.approx(0.1)


def test_damaged_plane_keeps_a_share_of_its_force():
    actuator = Actuator(Effects(rudder_effectiveness_change=Timed(size=0.35, at_s=10.0)), 0.01)
    assert actuator.lift_angle(0.2, 9.99) == 0.2
    assert actuator.lift_angle(0.2, 10.0) == pytest.approx(0.13)
