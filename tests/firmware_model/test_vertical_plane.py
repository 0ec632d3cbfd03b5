"""Both channels together: what they recover, and every guard and status made to act."""

import gc
import json
import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from car_data import ALPHA, BETA, SPEED, STEP, TABLE_1, car_signals, random_rudder
from mils_estimator import CONFIG, dive, learnt, run, samples_of, with_mils

from firmware_model import PARAMETERS, Sample, Status, VerticalPlaneEstimator


@pytest.mark.parametrize("innovation_length", [1, 5, 8])
def test_noise_free_data_give_table_1(innovation_length):
    estimator = VerticalPlaneEstimator(with_mils(innovation_length=innovation_length))
    statuses = run(estimator, dive(1200))
    assert set(statuses) == {Status.WAITING, Status.NOT_EXCITED, Status.UPDATED}
    estimate = estimator.estimate()
    for name in PARAMETERS:
        assert estimate.values[name] == pytest.approx(TABLE_1[name], rel=2e-3)
        assert estimate.valid[name]
    assert estimate.u0 == SPEED
    assert estimate.std["u0"] == 0.0
    np.testing.assert_allclose(estimate.car_pitch, ALPHA, atol=1e-3)
    np.testing.assert_allclose(estimate.car_depth, BETA, atol=3e-3)
    assert estimate.samples == 1200
    assert estimate.updates == statuses.count(Status.UPDATED)
    assert estimate.seconds == pytest.approx(estimate.updates * STEP)
    assert estimate.status is Status.UPDATED
    assert not any(estimate.refused.values())


def test_std_is_the_scatter_of_the_estimates():
    scores = []
    for seed in range(8):
        estimator = VerticalPlaneEstimator(CONFIG)
        run(estimator, dive(1500, seed, noise=5e-4))
        estimate = estimator.estimate()
        scores.append([(estimate.values[name] - TABLE_1[name]) / estimate.std[name] for name in PARAMETERS])
    assert 0.7 < np.sqrt(np.mean(np.square(scores))) < 1.4


def test_single_precision_gives_the_same_estimate():
    double, single = VerticalPlaneEstimator(CONFIG), VerticalPlaneEstimator(CONFIG, real=np.float32)
    for estimator in (double, single):
        run(estimator, dive(600, noise=5e-4))
    for name in PARAMETERS:
        expected = double.estimate()
        assert abs(single.estimate().values[name] - expected.values[name]) < 0.2 * expected.std[name]


def test_before_anything_is_learnt_everything_is_unknown():
    estimate = VerticalPlaneEstimator(CONFIG).estimate()
    assert all(math.isnan(estimate.values[name]) and math.isnan(estimate.std[name]) for name in PARAMETERS)
    assert not any(estimate.valid[name] for name in PARAMETERS)
    assert estimate.status is Status.WAITING


def test_pitch_is_learnt_without_a_depth_sensor():
    estimator = VerticalPlaneEstimator(CONFIG)
    run(estimator, [replace(sample, depth=math.nan) for sample in dive(800)])
    estimate = estimator.estimate()
    for name in ("a2", "a3", "b2"):
        assert estimate.values[name] == pytest.approx(TABLE_1[name], rel=1e-2)
        assert 0.0 < estimate.std[name] < 0.1
    assert math.isnan(estimate.a1)
    assert math.isnan(estimate.std["b1"])


@pytest.mark.parametrize("field", ["depth", "pitch", "rudder", "speed", "pitch_rate"])
@pytest.mark.parametrize("value", [math.inf, -math.inf])
def test_infinite_value_is_refused_and_changes_nothing(field, value):
    samples = dive(60)
    estimator, untouched = VerticalPlaneEstimator(CONFIG), VerticalPlaneEstimator(CONFIG)
    for sample in samples:
        assert estimator.update(replace(sample, **{field: value})) is Status.REFUSED_NON_FINITE
        assert estimator.update(sample) is untouched.update(sample)
    assert learnt(estimator) == learnt(untouched)
    assert estimator.estimate().refused["non_finite"] == 60


def test_time_that_does_not_advance_is_refused_and_changes_nothing():
    samples = dive(60)
    estimator, untouched = VerticalPlaneEstimator(CONFIG), VerticalPlaneEstimator(CONFIG)
    for sample in samples:
        assert estimator.update(sample) is untouched.update(sample)
        assert estimator.update(replace(sample, pitch=9.0)) is Status.REFUSED_STALE
        assert estimator.update(replace(sample, t_us=sample.t_us - 100_000)) is Status.REFUSED_STALE
    assert learnt(estimator) == learnt(untouched)
    assert estimator.estimate().refused["stale"] == 120


def test_time_off_the_grid_is_refused_and_changes_nothing():
    samples = dive(60)
    estimator, untouched = VerticalPlaneEstimator(CONFIG), VerticalPlaneEstimator(CONFIG)
    run(estimator, samples[:1])
    run(untouched, samples[:1])
    for sample in samples[1:]:
        for offset in (-89_000, -50_000, -11_000):
            off = replace(sample, t_us=sample.t_us + offset, pitch=9.0)
            assert estimator.update(off) is Status.REFUSED_OFF_GRID
        jitter = replace(sample, t_us=sample.t_us + 4_000)
        assert estimator.update(jitter) is untouched.update(sample)
    assert learnt(estimator) == learnt(untouched)
    assert estimator.estimate().refused["off_grid"] == 3 * 59


def test_missing_entry_and_missing_sample_leave_the_same_rows_out():
    samples = dive(400)
    gap, nans = VerticalPlaneEstimator(CONFIG), VerticalPlaneEstimator(CONFIG)
    gone = {150, 151, 230}
    statuses = {}
    for k, sample in enumerate(samples):
        if k in gone:
            hollow = Sample(t_us=sample.t_us)
            assert nans.update(hollow) is Status.WAITING
        else:
            statuses[k] = gap.update(sample)
            assert nans.update(sample) is statuses[k]
    assert learnt(gap) == learnt(nans)
    # The pitch row is complete again from the third sample after a gap.
    waiting = {k for k, status in statuses.items() if k > 100 and status is not Status.UPDATED}
    assert waiting == {152, 153, 231, 232}


def test_missing_values_cost_rows_but_not_truth():
    rng = np.random.default_rng(3)
    estimator = VerticalPlaneEstimator(CONFIG)
    for sample in dive(3000):
        lost = rng.random(3) < 0.04
        estimator.update(
            replace(
                sample,
                depth=math.nan if lost[0] else sample.depth,
                pitch=math.nan if lost[1] else sample.pitch,
                rudder=math.nan if lost[2] else sample.rudder,
            )
        )
    for name in PARAMETERS:
        assert estimator.estimate().values[name] == pytest.approx(TABLE_1[name], rel=5e-3)


def test_long_gap_starts_the_grid_anew_at_any_phase():
    estimator = VerticalPlaneEstimator(CONFIG)
    first, second = dive(300), dive(300, seed=1)
    run(estimator, first)
    before = learnt(estimator)
    shifted = [replace(sample, t_us=sample.t_us + 60_037_000) for sample in second]
    assert run(estimator, shifted[:2]) == [Status.WAITING, Status.WAITING]
    assert learnt(estimator) == before
    assert Status.UPDATED in run(estimator, shifted[2:])
    assert estimator.estimate().refused["off_grid"] == 0
    for name in PARAMETERS:
        assert estimator.estimate().values[name] == pytest.approx(TABLE_1[name], rel=1e-2)


def test_freeze_stops_learning_and_enable_goes_on_at_once():
    samples = dive(400)
    estimator = VerticalPlaneEstimator(CONFIG)
    run(estimator, samples[:200])
    before = learnt(estimator)
    estimator.freeze()
    assert estimator.is_frozen
    assert set(run(estimator, samples[200:300])) == {Status.FROZEN}
    assert learnt(estimator) == before
    estimator.enable()
    assert estimator.update(samples[300]) is Status.UPDATED


def test_rest_is_not_learnt_from():
    estimator = VerticalPlaneEstimator(CONFIG)
    run(estimator, dive(400))
    rest = samples_of(np.zeros(2000), np.full(2000, 3.0), np.full(2000, 0.02), start=400)
    statuses = run(estimator, rest)
    before = learnt(estimator)
    assert statuses[-1] is Status.NOT_EXCITED
    first = statuses.index(Status.NOT_EXCITED)
    assert set(statuses[first:]) == {Status.NOT_EXCITED}
    assert first < 60 / STEP
    run(estimator, samples_of(np.zeros(9), np.full(9, 3.0), np.full(9, 0.02), start=2400))
    assert learnt(estimator) == before
    moving = VerticalPlaneEstimator(replace(CONFIG, excitation_threshold=0.0))
    assert set(run(moving, rest)[4:]) == {Status.UPDATED}


@pytest.mark.long
@pytest.mark.parametrize("threshold", [0.005, 0.0])
def test_a_day_at_rest_leaves_an_estimator_that_learns(threshold):
    config = with_mils(
        replace(CONFIG, excitation_threshold=threshold),
        innovation_length=1,
        pitch_forgetting_time=30.0,
        depth_forgetting_time=30.0,
    )
    estimator = VerticalPlaneEstimator(config)
    run(estimator, dive(600))
    for k in range(864_000):
        estimator.update(Sample(t_us=(600 + k) * 100_000, depth=3.0, pitch=0.0, rudder=0.0))
    run(estimator, dive(1500, seed=1, start=864_700))
    for name in PARAMETERS:
        assert estimator.estimate().values[name] == pytest.approx(TABLE_1[name], rel=2e-2)


def test_forgetting_is_capped_until_the_first_manoeuvre():
    config = with_mils(
        replace(CONFIG, excitation_threshold=0.0), pitch_forgetting_time=5.0, depth_forgetting_time=5.0
    )
    estimator = VerticalPlaneEstimator(config)
    statuses = run(estimator, samples_of(np.zeros(50), np.zeros(50), np.zeros(50)))
    assert set(statuses[4:]) == {Status.CAPPED}
    assert run(estimator, dive(600, start=50))[-1] is Status.UPDATED


def test_forgetting_follows_a_change_of_the_vehicle():
    rng = np.random.default_rng(5)
    rudder = random_rudder(rng, 1200)
    pitch, depth = car_signals(rudder, rng, 1e-5, 1e-5)
    config = with_mils(pitch_forgetting_time=10.0, depth_forgetting_time=10.0)
    forgetting, remembering = VerticalPlaneEstimator(config), VerticalPlaneEstimator(CONFIG)
    weaker = samples_of(pitch, depth, rudder / 0.5, start=1300)  # the plane now does half as much
    for estimator in (forgetting, remembering):
        run(estimator, samples_of(pitch, depth, rudder))
        run(estimator, weaker)
    assert forgetting.estimate().b2 == pytest.approx(TABLE_1["b2"] / 2, rel=0.02)
    assert abs(remembering.estimate().b2 / TABLE_1["b2"] - 0.5) > 0.1


@pytest.mark.parametrize(("field", "spike"), [("depth", 1.0), ("pitch", 0.5)])
def test_outlier_is_refused_and_leaves_no_trace(field, spike):
    samples = dive(700, noise=5e-4)
    estimator, spared = VerticalPlaneEstimator(CONFIG), VerticalPlaneEstimator(CONFIG)
    for k, sample in enumerate(samples):
        if k in (400, 500):
            spiked = replace(sample, **{field: getattr(sample, field) + spike})
            assert estimator.update(spiked) is Status.REFUSED_OUTLIER
        else:
            assert estimator.update(sample) is spared.update(sample)
    assert learnt(estimator) == learnt(spared)
    assert estimator.estimate().refused["outlier"] == 2


def test_lasting_outliers_are_believed_in_the_end():
    rng = np.random.default_rng(2)
    rudder = random_rudder(rng, 900)
    pitch, depth = car_signals(rudder, rng, 1e-4, 1e-4)
    estimator = VerticalPlaneEstimator(replace(CONFIG, outlier_gate=5.0))
    run(estimator, samples_of(pitch, depth, rudder))
    statuses = run(estimator, samples_of(pitch, depth, -rudder, start=1000))  # the plane was wired backwards
    assert statuses.count(Status.REFUSED_OUTLIER) >= CONFIG.outlier_limit
    assert statuses.count(Status.UPDATED) > 700
    assert Status.UPDATED in statuses[-5:]


def test_no_gate_refuses_no_outlier():
    samples = dive(300, noise=5e-4)
    samples[250] = replace(samples[250], depth=50.0)
    for gate in (None, math.inf):
        estimator = VerticalPlaneEstimator(replace(CONFIG, outlier_gate=gate))
        assert Status.REFUSED_OUTLIER not in run(estimator, samples)


def test_overflow_is_a_fault_that_keeps_the_last_good_estimate():
    samples = dive(300)
    estimator = VerticalPlaneEstimator(replace(CONFIG, outlier_gate=None))
    run(estimator, samples[:200])
    before = learnt(estimator)
    huge = replace(samples[200], depth=1e300, pitch=1e300)
    assert estimator.update(huge) is Status.FAULT_NUMERICAL
    assert learnt(estimator) == before
    statuses = run(estimator, samples[201:])
    assert statuses[0] is Status.FAULT_NUMERICAL
    assert statuses[-1] is Status.UPDATED
    estimate = estimator.estimate()
    assert estimate.refused["numerical"] == statuses.count(Status.FAULT_NUMERICAL) + 1
    assert estimate.a2 == pytest.approx(TABLE_1["a2"], rel=1e-2)


def test_nan_may_come_anywhere_at_any_time():
    rng = np.random.default_rng(0)
    estimator = VerticalPlaneEstimator(CONFIG)
    values = np.array([0.0, 0.1, 5.0, math.nan, math.inf, 1e200, -1e308])
    t_us = 0
    for _ in range(3000):
        t_us += int(rng.integers(-1, 4)) * 50_000
        depth, pitch, rudder, speed = rng.choice(
            values, 4, p=[0.3, 0.3, 0.2, 0.14, 0.02, 0.02, 0.02]
        ).tolist()
        status = estimator.update(Sample(t_us=t_us, depth=depth, pitch=pitch, rudder=rudder, speed=speed))
        assert isinstance(status, Status)
    state = json.dumps(estimator.state(), allow_nan=False)
    assert "Infinity" not in state


def test_measured_speed_is_averaged_and_used():
    rng = np.random.default_rng(0)
    measured = [replace(sample, speed=2.5 + 0.2 * rng.normal()) for sample in dive(1200)]
    estimator = VerticalPlaneEstimator(with_mils(replace(CONFIG, speed=1.0), speed_time=30.0))
    assert estimator.estimate().u0 == 1.0
    run(estimator, measured)
    estimate = estimator.estimate()
    assert estimate.u0 == pytest.approx(2.5, abs=0.03)
    assert estimate.std["u0"] == pytest.approx(0.2, rel=0.2)
    assert estimate.b1 == pytest.approx(TABLE_1["b1"], rel=0.2)


def test_validity_has_hysteresis():
    samples = dive(4000, noise=1e-3)
    # The relative deviation of a1 passes the band between the limits slowly; forgetting moves it about.
    config = with_mils(replace(CONFIG, valid_below=0.25, invalid_above=0.4), depth_forgetting_time=20.0)
    estimator = VerticalPlaneEstimator(config)
    inside, changes, was_valid = {True: 0, False: 0}, 0, False
    for k, sample in enumerate(samples):
        estimator.update(sample)
        if k % 10 == 9:  # once a second, when validity is decided
            estimate = estimator.estimate()
            ratio = estimate.std["a1"] / abs(estimate.a1)
            if ratio < 0.25 and -1 < STEP * estimate.a1 < 0:
                assert estimate.valid["a1"]
            elif not ratio < 0.4:
                assert not estimate.valid["a1"]
            elif -1 < STEP * estimate.a1 < 0:
                assert estimate.valid["a1"] is was_valid
                inside[was_valid] += 1
            changes += estimate.valid["a1"] is not was_valid
            was_valid = estimate.valid["a1"]
    assert inside[True] > 0
    assert inside[False] > 0
    assert changes > 0


def test_sensor_noise_does_not_make_an_impossible_damping_valid():
    rng = np.random.default_rng(0)
    rudder = random_rudder(rng, 3000)
    pitch, depth = car_signals(rudder)
    noisy = samples_of(pitch + 0.0017 * rng.normal(size=3000), depth + 0.01 * rng.normal(size=3000), rudder)
    estimator = VerticalPlaneEstimator(CONFIG)
    run(estimator, noisy)
    estimate = estimator.estimate()
    assert STEP * estimate.a1 < -1.0  # least squares is biased by noise on its regressors
    assert estimate.std["a1"] < 0.1 * abs(estimate.a1)
    assert not estimate.valid["a1"]
    assert not estimate.valid["b1"]


def test_updates_allocate_nothing_lasting():
    samples = dive(6000, noise=1e-3)
    estimator = VerticalPlaneEstimator(with_mils(innovation_length=2, depth_forgetting_time=60.0))
    run(estimator, samples[:1000])
    gc.collect()
    blocks = sys.getallocatedblocks()
    for sample in samples[1000:]:
        estimator.update(sample)
    gc.collect()
    assert abs(sys.getallocatedblocks() - blocks) < 100  # one block a sample would be 5,000
