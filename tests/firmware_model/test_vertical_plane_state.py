"""Both channels started anew, saved, restored and set up."""

import json
import math
from dataclasses import replace

import pytest
from car_data import TABLE_1
from mils_estimator import CONFIG, dive, learnt, run, with_mils

from firmware_model import PARAMETERS, Sample, Status, VerticalPlaneEstimator


def test_reboot_joins_nothing_across_it():
    estimator = VerticalPlaneEstimator(CONFIG)
    run(estimator, dive(300, start=10_000))
    before = learnt(estimator)
    rebooted = dive(300, seed=1)
    assert estimator.update(rebooted[0]) is Status.REFUSED_STALE
    estimator.forget_rows()
    assert learnt(estimator) == before
    assert run(estimator, rebooted[:2]) == [Status.WAITING, Status.WAITING]
    run(estimator, rebooted[2:])
    for name in PARAMETERS:
        assert estimator.estimate().values[name] == pytest.approx(TABLE_1[name], rel=1e-2)


def test_reset_is_as_constructed():
    estimator = VerticalPlaneEstimator(CONFIG)
    run(estimator, [replace(sample, speed=2.0) for sample in dive(300)])
    estimator.update(Sample(t_us=0))
    estimator.freeze()
    estimator.reset()
    fresh = VerticalPlaneEstimator(CONFIG)
    assert estimator.state() == fresh.state()
    samples = dive(200, seed=4)
    assert run(estimator, samples) == run(fresh, samples)
    assert estimator.state() == fresh.state()


def test_state_goes_through_json_and_goes_on_with_the_same_bits():
    samples = [replace(sample, speed=2.4) for sample in dive(500, noise=1e-3)]
    estimator, other = VerticalPlaneEstimator(CONFIG), VerticalPlaneEstimator(CONFIG)
    run(estimator, samples[:300])
    run(other, samples[100:200])
    other.restore(json.loads(json.dumps(estimator.state())))
    estimator.forget_rows()
    assert run(estimator, samples[300:]) == run(other, samples[300:])
    assert estimator.state() == other.state()
    assert estimator.estimate() == other.estimate()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": 0}, r"state.schema must be 1 \(got 0\)"),
        ({"method": "robust"}, r"state.method must be mils \(got robust\)"),
        ({"step": 0.2}, r"state.step must be 0.1 \(got 0.2\)"),
        ({"innovation_length": 4}, r"state.innovation_length must be 5 \(got 4\)"),
        ({"speed": [1.0]}, "state.speed must hold mean and variance"),
        ({"speed": [1.0, -1.0]}, "state.speed must hold a variance"),
        ({"samples": -1}, r"state.samples must be a count \(got -1\)"),
        ({"refused": {}}, "state.non_finite must be a count"),
        ({"is_frozen": 0}, "state.is_frozen must be a bool"),
        ({"valid": "a1"}, "state.valid must be a list"),
        ({"pitch": None}, "state.pitch must be a dict"),
        ({"depth": {}}, "state.schema must be 1"),
    ],
)
def test_state_that_does_not_fit_is_refused_and_changes_nothing(change, message):
    estimator, other = VerticalPlaneEstimator(CONFIG), VerticalPlaneEstimator(CONFIG)
    run(estimator, dive(100))
    run(other, dive(150, seed=1))
    before = estimator.state()
    with pytest.raises(ValueError, match=message):
        estimator.restore({**other.state(), **change})
    assert estimator.state() == before


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"step": 0.0}, r"step must be above 0 \(got 0.0\)"),
        ({"step": math.inf}, r"step must be finite \(got inf\)"),
        ({"speed": -1.0}, r"speed must be above 0 \(got -1.0\)"),
        ({"outlier_gate": 0.0}, r"outlier_gate must be above 0 \(got 0.0\)"),
        ({"outlier_limit": 0}, r"outlier_limit must be at least 1 \(got 0\)"),
        ({"excitation_threshold": -0.1}, r"excitation_threshold must be 0 or more \(got -0.1\)"),
        ({"invalid_above": 0.05}, r"invalid_above must be at least valid_below = 0.1 \(got 0.05\)"),
    ],
)
def test_setting_that_breaks_its_rule_is_refused(setting, message):
    with pytest.raises(ValueError, match=message):
        replace(CONFIG, **setting)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"innovation_length": 0}, r"innovation_length must be from 1 to 64 \(got 0\)"),
        ({"p0": math.inf}, r"p0 must be finite \(got inf\)"),
        ({"pitch_forgetting_time": 0.0}, r"pitch_forgetting_time must be above 0 \(got 0.0\)"),
        ({"depth_forgetting_time": math.nan}, r"depth_forgetting_time must be above 0 \(got nan\)"),
    ],
)
def test_setting_of_the_method_that_breaks_its_rule_is_refused(setting, message):
    with pytest.raises(ValueError, match=message):
        with_mils(**setting)
