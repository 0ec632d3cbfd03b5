"""The noise-proof estimator where samples are lost, late or wrong."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from linear_dive import TRUTH, dive, held_levels
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

from firmware_model import RobustEstimator, Sample, Status
from firmware_model.sensor import OPENING


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
    statuses = run(estimator, shifted[:OPENING])
    after = estimator.estimate()
    for name in NAMES:
        assert abs(after.values[name] - before.values[name]) < before.std[name]
    assert_starts(statuses + run(estimator, shifted[OPENING:]))
    assert_found(estimator)


def test_a_rudder_that_stays_away_ends_the_states(trained):
    estimator = estimator_of(trained, with_robust(rudder_hold=1.0))
    samples = dive(400, first=1200)
    run(estimator, samples[:100])
    without = [replace(sample, rudder=math.nan) for sample in samples[100:130]]
    before = estimator.estimate().updates
    assert set(run(estimator, without)) == {Status.WAITING}
    assert estimator.estimate().updates == before
    assert_starts(run(estimator, samples[130:]))
    assert_found(estimator)


def test_a_sample_without_a_rudder_is_used_once_it_is_known_that_it_was_held(trained):
    held = np.repeat(held_levels(np.random.default_rng(4), 600)[::20], 20)
    samples = dive(600, 4, rudder=held)
    whole, late = estimator_of(trained), estimator_of(trained)
    run(whole, samples)
    for k, sample in enumerate(samples):
        hidden = k % 20 in (5, 6, 7)
        status = late.update(replace(sample, rudder=math.nan) if hidden else sample)
        assert k < OPENING or status is (Status.WAITING if hidden else Status.UPDATED)
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
