"""The noise-proof estimator: what it recovers, and every guard and status made to act."""

import gc
import json
import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from linear_dive import PITCH_NOISE, TRUTH, dive, held_levels, transition

from firmware_model import (
    PARAMETERS,
    EstimatorConfig,
    RobustConfig,
    RobustEstimator,
    Sample,
    Status,
    VerticalPlaneEstimator,
    car_from_physical,
    make_estimator,
)

CONFIG = EstimatorConfig(step=0.1, speed=2.0)
NAMES = (*PARAMETERS, "u0")


def with_robust(config=CONFIG, **settings):
    return replace(config, robust=replace(config.robust, **settings))


def run(estimator, samples):
    return [estimator.update(sample) for sample in samples]


def assert_found(estimator, names=NAMES, within=4.0, truth=TRUTH):
    estimate = estimator.estimate()
    for name in names:
        error = estimate.values[name] - truth[name]
        assert abs(error) < within * estimate.std[name], (name, error, estimate.std[name])


def learnt(estimator):
    return estimator.state()["filter"]


@pytest.fixture(scope="module")
def trained():
    """The state of an estimator after 120 s; `estimator_of` brings it back."""
    estimator = RobustEstimator(CONFIG)
    run(estimator, dive(1200))
    return estimator.state()


def estimator_of(state, config=CONFIG):
    estimator = RobustEstimator(config)
    estimator.restore(state)
    return estimator


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noisy_data_give_the_vehicle_and_its_speed(seed):
    estimator = RobustEstimator(CONFIG)
    samples = dive(1500, seed)
    assert set(run(estimator, samples)) == {Status.UPDATED}
    assert_found(estimator)
    estimate = estimator.estimate()
    assert all(estimate.valid[name] for name in NAMES)
    assert all(estimate.std[name] < 0.03 * abs(TRUTH[name]) for name in ("a1", "a2", "a3", "b2", "u0"))
    assert (estimate.samples, estimate.updates) == (1500, 1500)
    assert estimate.seconds == pytest.approx(150.0)
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


@pytest.mark.parametrize("field", ["depth", "pitch", "rudder", "speed", "pitch_rate"])
def test_infinite_value_is_refused_and_changes_nothing(trained, field):
    estimator, untouched = estimator_of(trained), estimator_of(trained)
    for sample in dive(20, first=1200):
        for value in (math.inf, -math.inf):
            assert estimator.update(replace(sample, **{field: value})) is Status.REFUSED_NON_FINITE
        assert estimator.update(sample) is untouched.update(sample)
    assert learnt(estimator) == learnt(untouched)
    assert estimator.estimate().refused["non_finite"] == 40


def test_time_that_stands_still_or_leaves_the_grid_is_refused_and_changes_nothing(trained):
    estimator, untouched = estimator_of(trained), estimator_of(trained)
    for sample in dive(20, first=1200):
        assert estimator.update(replace(sample, t_us=sample.t_us + 4_000)) is untouched.update(sample)
        assert estimator.update(replace(sample, pitch=9.0)) is Status.REFUSED_STALE
        assert estimator.update(replace(sample, t_us=sample.t_us + 50_000)) is Status.REFUSED_OFF_GRID
    assert learnt(estimator) == learnt(untouched)
    refused = estimator.estimate().refused
    assert (refused["stale"], refused["off_grid"]) == (20, 20)


def test_missing_samples_are_passed_over_with_the_rudder_held(trained):
    held = held_levels(np.random.default_rng(4), 600)
    samples = dive(600, 4, rudder=np.repeat(held[::20], 20))
    gaps, hollow = estimator_of(trained), estimator_of(trained)
    for k, sample in enumerate(samples):
        if k % 20 in (5, 6, 7):
            assert hollow.update(Sample(t_us=sample.t_us)) is Status.WAITING
        else:
            assert gaps.update(sample) is hollow.update(sample)
    assert_found(gaps)
    for one, other in zip(learnt(gaps)["mean"], learnt(hollow)["mean"], strict=True):
        assert one == pytest.approx(other, rel=1e-9)


@pytest.mark.parametrize("rudder_is_known", [True, False])
def test_samples_lost_with_their_rudder_do_not_bias(rudder_is_known):
    """Where the plane turned is then known to the length of a gap only."""
    rng = np.random.default_rng(6)
    estimator = RobustEstimator(CONFIG)
    for sample in dive(3000, 6):
        if rng.random() < 0.5:
            continue
        hidden = not rudder_is_known and rng.random() < 0.2
        estimator.update(replace(sample, rudder=math.nan) if hidden else sample)
    assert_found(estimator)
    assert all(estimator.estimate().std[name] < 0.05 * abs(TRUTH[name]) for name in ("a2", "a3", "b2"))


def test_values_missing_at_random_cost_precision_only():
    rng = np.random.default_rng(3)
    samples = dive(3000)
    estimator = RobustEstimator(CONFIG)
    statuses = set()
    for sample in samples:
        lost = rng.random(2) < 0.6
        statuses.add(
            estimator.update(
                replace(
                    sample,
                    depth=math.nan if lost[0] else sample.depth,
                    pitch=math.nan if lost[1] else sample.pitch,
                )
            )
        )
    assert statuses == {Status.UPDATED, Status.WAITING}
    assert_found(estimator)


def test_a_long_gap_starts_the_states_anew_and_keeps_the_parameters(trained):
    estimator = estimator_of(trained)
    run(estimator, dive(50, first=1200))
    before = estimator.estimate()
    late = dive(600, 7, first=5000)
    shifted = [replace(sample, t_us=sample.t_us + 37_000, depth=sample.depth - 90.0) for sample in late]
    assert estimator.update(shifted[0]) is Status.RESTARTED
    after = estimator.estimate()
    for name in NAMES:
        assert abs(after.values[name] - before.values[name]) < before.std[name]
    assert set(run(estimator, shifted[1:])) == {Status.UPDATED}
    assert_found(estimator)


def test_a_rudder_that_stays_away_ends_the_states(trained):
    estimator = estimator_of(trained, with_robust(rudder_hold=1.0))
    samples = dive(400, first=1200)
    run(estimator, samples[:100])
    without = [replace(sample, rudder=math.nan) for sample in samples[100:130]]
    before = estimator.estimate().updates
    assert set(run(estimator, without)) == {Status.WAITING}
    assert estimator.estimate().updates == before
    assert estimator.update(samples[130]) is Status.RESTARTED
    assert set(run(estimator, samples[131:])) == {Status.UPDATED}
    assert_found(estimator)


def test_a_sample_without_a_rudder_is_used_once_it_is_known_that_it_was_held(trained):
    held = np.repeat(held_levels(np.random.default_rng(4), 600)[::20], 20)
    samples = dive(600, 4, rudder=held)
    whole, late = estimator_of(trained), estimator_of(trained)
    run(whole, samples)
    for k, sample in enumerate(samples):
        hidden = k % 20 in (5, 6, 7)
        status = late.update(replace(sample, rudder=math.nan) if hidden else sample)
        assert k == 0 or status is (Status.WAITING if hidden else Status.UPDATED)
        if k % 20 == 6:
            assert late.update(replace(sample, rudder=math.nan)) is Status.REFUSED_STALE
    assert late.estimate().updates == whole.estimate().updates
    for one, other in zip(learnt(late)["mean"], learnt(whole)["mean"], strict=True):
        assert one == pytest.approx(other, rel=1e-9)


@pytest.mark.parametrize("share", [0.0, 0.05])
def test_a_storm_of_losses_and_spikes_does_not_make_it_confidently_wrong(share):
    """60 % of each channel lost by itself, the rudder's too, and spikes of 30 deg and 5 m among the rest."""
    rng = np.random.default_rng(12)
    estimator = RobustEstimator(CONFIG)
    for sample in dive(3000, 12):
        lost, spiked = rng.random(3) < 0.6, rng.random(2) < share
        estimator.update(
            replace(
                sample,
                depth=math.nan if lost[0] else sample.depth + spiked[0] * rng.normal(0.0, 5.0),
                pitch=math.nan if lost[1] else sample.pitch + spiked[1] * rng.normal(0.0, 0.5),
                rudder=math.nan if lost[2] else sample.rudder,
            )
        )
    assert_found(estimator)


@pytest.mark.parametrize(("field", "spike"), [("depth", 2.0), ("pitch", 0.5)])
def test_an_outlier_is_left_out_and_the_rest_of_its_sample_used(trained, field, spike):
    samples = dive(300, first=1200)
    estimator, spared = estimator_of(trained), estimator_of(trained)
    for k, sample in enumerate(samples):
        if k in (100, 200):
            spiked = replace(sample, **{field: getattr(sample, field) + spike})
            assert estimator.update(spiked) is Status.REFUSED_OUTLIER
            spared.update(replace(sample, **{field: math.nan}))
        else:
            assert estimator.update(sample) is spared.update(sample)
    assert learnt(estimator) == learnt(spared)
    assert estimator.estimate().refused["outlier"] == 2


@pytest.mark.parametrize(("field", "jump"), [("depth", 3.0), ("pitch", 0.2)])
def test_a_sensor_set_to_another_datum_is_believed_after_a_while(trained, field, jump):
    samples = dive(1200, 5, first=1200)
    estimator = estimator_of(trained)
    run(estimator, samples[:300])
    moved = [replace(sample, **{field: getattr(sample, field) + jump}) for sample in samples[300:]]
    statuses = run(estimator, moved)
    limit = CONFIG.outlier_limit
    assert statuses[: limit + 1] == [Status.REFUSED_OUTLIER] * limit + [Status.RESTARTED]
    assert set(statuses[limit + 1 :]) == {Status.UPDATED}
    assert_found(estimator)


def test_a_sensor_that_jumps_without_end_does_not_stop_the_other(trained):
    samples = dive(2000, 5, first=1200)
    estimator = estimator_of(trained)
    wild = [replace(s, depth=s.depth + 50.0 * (k // 8 % 2)) for k, s in enumerate(samples)]
    statuses = run(estimator, wild)
    assert 5 <= statuses.count(Status.RESTARTED) <= 5 + 200 / 60 + 1
    assert statuses.count(Status.REFUSED_OUTLIER) > 500
    assert_found(estimator, ("a2", "a3", "b2"))


def test_no_gate_refuses_no_outlier(trained):
    for gate in (None, math.inf):
        estimator = estimator_of(trained, replace(CONFIG, outlier_gate=gate))
        samples = dive(50, first=1200)
        samples[20] = replace(samples[20], depth=50.0)
        assert Status.REFUSED_OUTLIER not in run(estimator, samples)


def test_overflow_is_a_fault_that_keeps_the_last_good_estimate(trained):
    estimator = estimator_of(trained, replace(CONFIG, outlier_gate=None))
    samples = dive(300, first=1200)
    run(estimator, samples[:20])
    before = learnt(estimator)
    huge = [replace(sample, depth=1e300, pitch=-1e300) for sample in samples[20:23]]
    assert run(estimator, huge) == [Status.FAULT_NUMERICAL] * 3
    after = learnt(estimator)
    assert (after["mean"], after["factor"], after["variance"]) == tuple(
        before[name] for name in ("mean", "factor", "variance")
    )
    assert set(run(estimator, samples[23:])) == {Status.UPDATED}
    assert estimator.estimate().refused["numerical"] == 3
    assert_found(estimator)


def test_faults_without_end_freeze_the_estimator_until_it_is_enabled(trained):
    estimator = estimator_of(trained, replace(CONFIG, outlier_gate=None))
    samples = dive(200, first=1200)
    run(estimator, samples[:20])
    huge = [replace(sample, depth=1e300 * (k + 1.0) * (-1) ** k) for k, sample in enumerate(samples[20:150])]
    statuses = run(estimator, huge)
    assert statuses[-1] is Status.FROZEN
    assert estimator.is_frozen
    estimator.enable()
    assert estimator.update(samples[150]) is Status.RESTARTED
    assert set(run(estimator, samples[151:])) == {Status.UPDATED}
    assert_found(estimator)


def test_rest_is_not_learnt_from_and_work_goes_on_after_it(trained):
    estimator = estimator_of(trained)
    rest = dive(1000, rudder=np.zeros(1000), first=1200)
    statuses = run(estimator, rest)
    first = statuses.index(Status.NOT_EXCITED)
    assert 299 <= first <= 450
    assert set(statuses[first:]) == {Status.NOT_EXCITED}
    before = learnt(estimator)
    run(estimator, dive(200, rudder=np.zeros(200), first=2200))
    assert learnt(estimator) == before
    statuses = run(estimator, dive(600, 8, first=2400))
    assert Status.RESTARTED in statuses[:40]
    assert statuses[-1] is Status.UPDATED
    assert_found(estimator)
    always = estimator_of(trained, replace(CONFIG, excitation_threshold=0.0))
    assert set(run(always, rest)[1:]) == {Status.UPDATED}


def test_a_plane_that_only_answers_noise_makes_nothing_valid():
    """Closed-loop depth keeping without a manoeuvre: what moves is the sensors' noise."""
    Phi, Gamma = transition()
    for seed in range(3):
        rng = np.random.default_rng(seed)
        estimator = RobustEstimator(CONFIG)
        x, before, statuses = np.array([0.0, 0.0, 0.0, 5.0]), 0.0, []
        for k in range(3000):
            pitch = x[2] + PITCH_NOISE * rng.normal()
            depth = x[3] + 0.01 * rng.normal()
            wanted = min(max(0.06 * (depth - 5.0), -0.3), 0.3)
            rudder = min(max(-(wanted - pitch) + 0.3 * (pitch - before) / 0.1, -0.25), 0.25)
            before = pitch
            sample = Sample(t_us=k * 100_000, depth=float(depth), pitch=float(pitch), rudder=float(rudder))
            statuses.append(estimator.update(sample))
            assert not any(estimator.estimate().valid[name] for name in PARAMETERS)
            x = Phi @ x + Gamma * rudder
        assert statuses[-1] is Status.NOT_EXCITED


def test_freeze_stops_learning_and_enable_goes_on(trained):
    estimator = estimator_of(trained)
    samples = dive(200, first=1200)
    run(estimator, samples[:50])
    before = learnt(estimator)
    estimator.freeze()
    assert estimator.is_frozen
    assert set(run(estimator, samples[50:100])) == {Status.FROZEN}
    assert learnt(estimator) == before
    estimator.enable()
    assert estimator.update(samples[100]) is Status.RESTARTED
    assert set(run(estimator, samples[101:])) == {Status.UPDATED}


def test_a_vehicle_beyond_the_bounds_is_held_at_them_and_never_valid():
    # Unstable in pitch: the opposite sign of a3 and a plane that works the other way.
    rng = np.random.default_rng(0)
    rudder = held_levels(rng, 600)
    pitch = np.cumsum(0.02 * rudder)
    samples = [
        Sample(
            t_us=k * 100_000, depth=20.0, pitch=float(pitch[k] + PITCH_NOISE * rng.normal()), rudder=float(d)
        )
        for k, d in enumerate(rudder)
    ]
    estimator = RobustEstimator(CONFIG)
    statuses = run(estimator, samples)
    assert Status.AT_BOUND in statuses
    estimate = estimator.estimate()
    if statuses[-1] is Status.AT_BOUND:
        assert not (estimate.valid["a2"] and estimate.valid["a1"])


def test_drift_follows_a_change_of_the_vehicle(trained):
    weaker = [replace(sample, rudder=sample.rudder / 0.8) for sample in dive(2000, 9, first=1200)]
    truth = TRUTH | {"b1": 0.8 * TRUTH["b1"], "b2": 0.8 * TRUTH["b2"]}
    following = estimator_of(trained, with_robust(drift=0.1))
    remembering = estimator_of(trained)
    for estimator in (following, remembering):
        run(estimator, weaker)
    assert following.estimate().b2 == pytest.approx(truth["b2"], rel=0.03)
    assert abs(remembering.estimate().b2 / truth["b2"] - 1.0) > 0.03


def test_validity_has_hysteresis():
    config = replace(CONFIG, valid_below=0.06, invalid_above=0.08)
    estimator = RobustEstimator(config)
    for k, sample in enumerate(dive(1500)):
        estimator.update(sample)
        if k % 10 == 9:
            estimate = estimator.estimate()
            for name in PARAMETERS:
                ratio = estimate.std[name] / abs(estimate.values[name])
                if ratio < 0.06:
                    assert estimate.valid[name]
                if ratio >= 0.08:
                    assert not estimate.valid[name]
    assert all(estimate.valid[name] for name in PARAMETERS)


def test_reboot_joins_nothing_across_it(trained):
    estimator = estimator_of(trained)
    run(estimator, dive(50, first=10_000))
    rebooted = dive(100, seed=1)
    assert estimator.update(rebooted[0]) is Status.REFUSED_STALE
    estimator.forget_rows()
    assert estimator.update(rebooted[0]) is Status.RESTARTED
    assert set(run(estimator, rebooted[1:])) == {Status.UPDATED}
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


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"innovation_length": 65}, r"innovation_length must be from 1 to 64 \(got 65\)"),
        ({"pitch_noise": 0.0}, r"pitch_noise must be above 0 and finite \(got 0.0\)"),
        ({"pitch_time": math.inf}, r"pitch_time must be above 0 and finite \(got inf\)"),
        ({"drift": -0.1}, r"drift must be 0 or more and finite \(got -0.1\)"),
        ({"speed_std": -1.0}, r"speed_std must be 0 or more and finite \(got -1.0\)"),
    ],
)
def test_setting_that_breaks_its_rule_is_refused(setting, message):
    with pytest.raises(ValueError, match=message):
        RobustConfig(**setting)


def test_a_step_too_long_for_the_method_is_refused():
    with pytest.raises(ValueError, match=r"step must be at most 10 s with method robust \(got 11.0\)"):
        EstimatorConfig(step=11.0, speed=1.0)
    assert EstimatorConfig(method="mils", step=11.0, speed=1.0).step == 11.0


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


wild = st.one_of(st.sampled_from([math.nan, math.inf, 1e300, -1e308, 0.0]), st.floats(-1.0, 1.0))


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.integers(-1, 15), wild, wild, wild, wild), min_size=1, max_size=60),
    st.integers(1, 3),
    st.sampled_from([None, 20.0]),
    st.booleans(),
)
def test_anything_may_come_at_any_time(samples, p, gate, coupling):
    config = with_robust(
        replace(CONFIG, outlier_gate=gate), innovation_length=p, drift=0.1, heave_pitch_rate_coupling=coupling
    )
    estimator = RobustEstimator(config)
    t_us = 0
    for steps, depth, pitch, rudder, speed in samples:
        t_us += steps * 100_000
        status = estimator.update(Sample(t_us=t_us, depth=depth, pitch=pitch, rudder=rudder, speed=speed))
        assert isinstance(status, Status)
    estimator.estimate()
    json.dumps(estimator.state(), allow_nan=False)


def test_updates_allocate_nothing_lasting():
    samples = dive(1500)
    estimator = RobustEstimator(with_robust(innovation_length=2, drift=0.05))
    run(estimator, samples[:500])
    gc.collect()
    blocks = sys.getallocatedblocks()
    for sample in samples[500:]:
        estimator.update(sample)
    gc.collect()
    assert abs(sys.getallocatedblocks() - blocks) < 100  # one block a sample would be 1,000
