"""The bench of the live alarm: copies of a dive go on alike until a fault strikes one of them."""

import copy

import numpy as np
import pytest

from host.live.prediction_window import PredictionWindow
from host.live.reference import Reference
from tools.bench_alarm import FAULTS, STEP, Dive, errors, recorded, scenario_of, size_of

REFERENCE = Reference(a1=-0.63, a2=-3.39, a3=-8.2, b1=0.41, b2=-3.94, u0=2.5)


@pytest.mark.parametrize("title", sorted(FAULTS))
def test_a_fault_changes_the_dive_and_nothing_else_does(title: str) -> None:
    dive = Dive(scenario_of("rough"), 3)
    for _ in range(200):
        dive.sample()
    alike, struck = copy.deepcopy(dive), copy.deepcopy(dive)
    FAULTS[title].happens(struck.plant, 0.5)
    for _ in range(100):
        dive.sample(), alike.sample(), struck.sample()
    assert alike.plant.motion == dive.plant.motion
    assert struck.plant.motion != dive.plant.motion


def test_a_fault_is_sized_to_double_the_prediction_error() -> None:
    dive, window = Dive(scenario_of("calm"), 3), PredictionWindow(round(10.0 / STEP), STEP)
    usual = errors(dive, window, REFERENCE, 60.0)
    fault = FAULTS["current"]
    size = size_of(fault, dive, window, REFERENCE, usual)
    assert size is not None
    fault.happens(dive.plant, size)
    assert errors(dive, window, REFERENCE, 30.0).max() > np.min(1.5 * usual)


def test_an_alarmed_dive_is_recorded_as_its_journal_would_be_read() -> None:
    dive = Dive(scenario_of("calm"), 3)
    samples = [dive.sample() for _ in range(50)]
    recording = recorded(samples, samples[30].t_us)
    assert recording.alarms == (pytest.approx(recording.time[30]),)
    assert np.diff(recording.time) == pytest.approx(STEP)
    assert recording.depth[7] == samples[7].depth
    assert recording.rudder[7] == samples[7].rudder
