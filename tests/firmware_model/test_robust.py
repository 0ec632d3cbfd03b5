"""The noise-proof estimator: what it recovers, and from what."""

import math
from dataclasses import replace

import numpy as np
import pytest
from linear_dive import TRUTH, dive
from robust_estimator import (
    CONFIG,
    NAMES,
    assert_found,
    assert_starts,
    estimator_of,
    learnt,
    run,
    with_robust,
)

from firmware_model import PARAMETERS, EstimatorConfig, RobustEstimator, Status, car_from_physical
from firmware_model.sensor import OPENING


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noisy_data_give_the_vehicle_and_its_speed(seed):
    estimator = RobustEstimator(CONFIG)
    samples = dive(1500, seed)
    assert_starts(run(estimator, samples), Status.UPDATED)
    assert_found(estimator)
    estimate = estimator.estimate()
    assert all(estimate.valid[name] for name in NAMES)
    assert all(estimate.std[name] < 0.03 * abs(TRUTH[name]) for name in ("a1", "a2", "a3", "b2", "u0"))
    assert (estimate.samples, estimate.updates) == (1500, 1501 - OPENING)
    assert estimate.seconds == pytest.approx(150.1 - 0.1 * OPENING)
    alpha, beta = car_from_physical(**{name: estimate.values[name] for name in NAMES}, h=0.1)
    assert (estimate.car_pitch, estimate.car_depth) == (alpha, beta)
    assert math.isnan(estimate.c_wq)


def test_offsets_of_sensors_change_nothing_but_the_trim():
    samples = [replace(s, pitch=s.pitch + 0.03, depth=s.depth + 40.0) for s in dive(1500)]
    estimator = RobustEstimator(CONFIG)
    run(estimator, samples)
    assert_found(estimator)
    # a pitch that reads 0.03 too much needs the moment -a3 0.03 to be at rest
    assert estimator.estimate().pitch_offset == pytest.approx(0.03 * 8.2, abs=0.02)


def test_measured_speed_is_used_as_it_varies():
    speeds = 2.0 + 0.8 * np.sin(0.05 * np.arange(2000))
    speeds = np.round(speeds, 1)
    estimator = RobustEstimator(replace(CONFIG, speed=1.0))
    run(estimator, dive(2000, speeds=speeds))
    assert_found(estimator, PARAMETERS)
    estimate = estimator.estimate()
    assert estimate.valid["u0"]
    assert estimate.u0 == pytest.approx(2.0, abs=0.9)
    assert abs(estimate.c_wq) < 4.0 * estimate.std["c_wq"]


def test_one_wrong_speed_does_nothing():
    samples = dive(800, speeds=np.full(800, 2.5))
    estimator, spared = RobustEstimator(CONFIG), RobustEstimator(CONFIG)
    run(spared, samples)
    samples[400] = replace(samples[400], speed=40.0)
    run(estimator, samples)
    assert learnt(estimator) == learnt(spared)


def test_pitch_rate_coupling_is_told_from_the_rest():
    for settings_, speeds in (({"heave_pitch_rate_coupling": True}, None), ({}, np.full(2500, 2.5))):
        estimator = RobustEstimator(with_robust(**settings_))
        run(estimator, dive(2500, 1, coupling=0.6, speeds=speeds))
        estimate = estimator.estimate()
        assert_found(estimator, PARAMETERS if speeds is not None else NAMES)
        assert abs(estimate.c_wq - 0.6) < 4.0 * estimate.std["c_wq"]
        assert estimate.std["c_wq"] < 0.3
        assert set(estimate.values) == {*NAMES, "c_wq"}
    assert estimate.valid["c_wq"]


@pytest.mark.parametrize("coupling", [None, False, True])
def test_a_speed_that_is_measured_only_later_is_taken_up(coupling):
    estimator = RobustEstimator(with_robust(heave_pitch_rate_coupling=coupling))
    samples = dive(2000)
    run(estimator, samples[:800])
    run(estimator, [replace(sample, speed=2.5) for sample in samples[800:]])
    assert_found(estimator, PARAMETERS)
    assert estimator.estimate().u0 == pytest.approx(2.5)


def test_a_speed_that_is_trusted_is_not_estimated():
    estimator = RobustEstimator(with_robust(replace(CONFIG, speed=2.5), speed_std=0.0))
    run(estimator, dive(1200))
    estimate = estimator.estimate()
    assert (estimate.u0, estimate.std["u0"]) == (2.5, 0.0)
    assert estimate.valid["u0"]
    assert_found(estimator, PARAMETERS)


def test_before_anything_is_learnt_everything_is_unknown():
    estimate = RobustEstimator(CONFIG).estimate()
    assert all(math.isnan(estimate.values[name]) and math.isnan(estimate.std[name]) for name in PARAMETERS)
    assert not any(estimate.valid.values())
    assert estimate.status is Status.WAITING


def test_what_one_sensor_tells_is_learnt_without_the_other():
    pitch_only = RobustEstimator(CONFIG)
    run(pitch_only, [replace(sample, depth=math.nan) for sample in dive(1200)])
    assert_found(pitch_only, ("a2", "a3", "b2"))
    valid = pitch_only.estimate().valid
    assert (valid["a2"], valid["a3"], valid["b2"]) == (True, True, True)
    assert (valid["a1"], valid["b1"], valid["u0"]) == (False, False, False)


def test_drift_follows_a_change_of_the_vehicle(trained):
    weaker = [replace(sample, rudder=sample.rudder / 0.8) for sample in dive(2000, 9, first=1200)]
    truth = TRUTH | {"b1": 0.8 * TRUTH["b1"], "b2": 0.8 * TRUTH["b2"]}
    following = estimator_of(trained, with_robust(drift=0.1))
    remembering = estimator_of(trained)
    for estimator in (following, remembering):
        run(estimator, weaker)
    assert following.estimate().b2 == pytest.approx(truth["b2"], rel=0.03)
    assert abs(remembering.estimate().b2 / truth["b2"] - 1.0) > 0.03


def test_a_slow_vehicle_is_found_at_its_own_pace():
    slow = [
        replace(sample, t_us=10 * sample.t_us, depth=10.0 * sample.depth) for sample in dive(1500)
    ]  # every second takes ten: a1, a2 are a tenth, a3, b2 a hundredth
    estimator = RobustEstimator(
        with_robust(
            EstimatorConfig(step=1.0, speed=2.0, excitation_time=50.0),
            pitch_time=10.0, depth_noise=0.2, rudder_hold=10.0, rest_time=300.0,
        )
    )  # fmt: skip
    run(estimator, slow)
    powers = {"a1": 1, "a2": 1, "a3": 2, "b1": 1, "b2": 2, "u0": 0}
    assert_found(estimator, truth={name: value / 10.0 ** powers[name] for name, value in TRUTH.items()})
