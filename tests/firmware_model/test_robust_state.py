"""The noise-proof estimator started anew, saved and restored."""

import json
import math
from dataclasses import replace

import pytest
from linear_dive import dive
from robust_estimator import CONFIG, assert_found, assert_starts, estimator_of, learnt, run, with_robust

from firmware_model import PARAMETERS, RobustEstimator, Sample, Status, VerticalPlaneEstimator, make_estimator


def test_reboot_joins_nothing_across_it(trained):
    estimator = estimator_of(trained)
    run(estimator, dive(50, first=10_000))
    rebooted = dive(100, seed=1)
    assert estimator.update(rebooted[0]) is Status.REFUSED_STALE
    estimator.forget_rows()
    assert_starts(run(estimator, rebooted))
    assert_found(estimator)


def test_reset_is_as_constructed():
    estimator = RobustEstimator(CONFIG)
    run(estimator, [replace(sample, speed=2.0) for sample in dive(300)])
    estimator.update(Sample(t_us=0))
    estimator.freeze()
    estimator.reset()
    fresh = RobustEstimator(CONFIG)
    assert estimator.state() == fresh.state()
    samples = [replace(sample, speed=2.5) for sample in dive(200, seed=4)]
    assert run(estimator, samples) == run(fresh, samples)
    assert estimator.state() == fresh.state()


@pytest.mark.parametrize("speed", [math.nan, 2.4])
def test_state_goes_through_json_and_goes_on_with_the_same_bits(speed):
    samples = [replace(sample, speed=speed) for sample in dive(500)]
    config = with_robust(innovation_length=3)
    estimator, other = RobustEstimator(config), RobustEstimator(config)
    run(estimator, samples[:300])
    run(other, samples[100:200])
    other.restore(json.loads(json.dumps(estimator.state(), allow_nan=False)))
    estimator.forget_rows()
    assert run(estimator, samples[300:]) == run(other, samples[300:])
    assert learnt(estimator) == learnt(other)
    one, two = estimator.estimate(), other.estimate()
    assert {name: one.values[name] for name in PARAMETERS} == {name: two.values[name] for name in PARAMETERS}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": 0}, r"state.schema must be 1 \(got 0\)"),
        ({"method": "mils"}, r"state.method must be robust \(got mils\)"),
        ({"step": 0.2}, r"state.step must be 0.1 \(got 0.2\)"),
        ({"heave_pitch_rate_coupling": True}, "state.heave_pitch_rate_coupling must be None"),
        ({"samples": -1}, r"state.samples must be a count \(got -1\)"),
        ({"refused": None}, "state.refused must be a dict"),
        ({"is_frozen": 0}, "state.is_frozen must be a bool"),
        ({"filter": None}, "state.filter must be a dict"),
        ({"filter": {}}, "state.mean must be a list"),
    ],
)
def test_state_that_does_not_fit_is_refused_and_changes_nothing(trained, change, message):
    estimator = RobustEstimator(CONFIG)
    run(estimator, dive(100))
    before = estimator.state()
    with pytest.raises(ValueError, match=message):
        estimator.restore({**trained, **change})
    assert estimator.state() == before


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mean": [0.0]}, "state.mean must hold 9 numbers"),
        ({"variance": [-1.0] * 9}, "state.variance must not be negative"),
        ({"noise": [0.0, 1.0, 1.0, 1.0]}, "state.noise must be above 0"),
        ({"force": [1.0, 0.0]}, "state.force must be above 0"),
        ({"factor": [math.nan] * 36}, "state.factor must hold finite numbers"),
        ({"speed": [1.0, 2.0]}, "state.speed must hold at most one number"),
    ],
)
def test_numbers_of_a_state_that_do_not_fit_are_refused(trained, change, message):
    estimator = RobustEstimator(CONFIG)
    with pytest.raises(ValueError, match=message):
        estimator.restore({**trained, "filter": {**trained["filter"], **change}})


def test_the_state_of_one_method_is_refused_by_the_other(trained):
    mils = make_estimator(replace(CONFIG, method="mils"))
    assert isinstance(mils, VerticalPlaneEstimator)
    assert isinstance(make_estimator(CONFIG), RobustEstimator)
    with pytest.raises(ValueError, match=r"state.method must be mils \(got robust\)"):
        mils.restore(trained)
