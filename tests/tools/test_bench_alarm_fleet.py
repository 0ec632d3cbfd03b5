"""The alarm on other vehicles: what is drawn is a dive that can be copied, and faults fit its hull."""

import copy

import numpy as np
import pytest

from tools.bench_alarm import FAULTS, STEP, Dive
from tools.bench_alarm_fleet import draw_cruise, scaled


@pytest.mark.parametrize("number", range(4))
def test_a_drawn_dive_goes_on_and_can_be_copied(number: int) -> None:
    kind, vehicle, scenario = draw_cruise(5, number)
    assert (kind == "linear") == (number % 2 == 1)
    dive = Dive(scenario, number)
    samples = [dive.sample() for _ in range(300)]
    assert np.diff([sample.t_us for sample in samples]) == pytest.approx(1e6 * STEP)
    assert np.ptp([sample.rudder for sample in samples]) > 0.0
    other = copy.deepcopy(dive)
    for _ in range(50):
        dive.sample(), other.sample()
    assert other.plant.motion == dive.plant.motion
    assert draw_cruise(5, number)[1:] == (vehicle, scenario)


def test_faults_are_scaled_to_the_hull() -> None:
    for number in (0, 1):
        _, vehicle, _ = draw_cruise(5, number)
        faults = scaled(vehicle)
        assert faults.keys() == FAULTS.keys()
        assert faults["ballast drop"].largest == pytest.approx(0.1 * vehicle.hull.mass)
        assert faults["fin damage"].largest == FAULTS["fin damage"].largest


@pytest.mark.parametrize("title", sorted(FAULTS))
def test_every_fault_moves_a_whole_hull(title: str) -> None:
    _, vehicle, scenario = draw_cruise(5, 0)
    dive = Dive(scenario, 0)
    for _ in range(300):
        dive.sample()
    struck = copy.deepcopy(dive)
    fault = scaled(vehicle)[title]
    fault.happens(struck.plant, 0.5 * fault.largest)
    for _ in range(100):
        dive.sample(), struck.sample()
    assert struck.plant.motion != dive.plant.motion
