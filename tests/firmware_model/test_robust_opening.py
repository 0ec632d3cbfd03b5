"""The first values after a start, when nothing is known yet by which to tell a spike from a movement."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from linear_dive import dive
from robust_estimator import CONFIG, assert_found, estimator_of, run

from firmware_model import RobustEstimator, Status
from firmware_model.propagation import THETA
from firmware_model.recent_values import RecentValues
from firmware_model.sensor import OPENING

NOISE = 0.01


def filled(values, instants=None):
    recent = RecentValues(len(values))
    for k, value in enumerate(values):
        recent.put(k if instants is None else instants[k], value)
    return recent


@given(
    st.floats(-10.0, 10.0),
    st.floats(-1.0, 1.0),
    st.sets(st.integers(0, 4), max_size=2),
    st.floats(5.0, 1e6),
    st.lists(st.integers(1, 9), min_size=5, max_size=5),
)
def test_the_newest_belongs_to_a_line_unless_it_is_spiked(level, slope, spiked, spike, gaps):
    instants = np.cumsum(gaps)
    values = [level + slope * float(t) for t in instants]
    for k in spiked:
        values[k] += spike * (1.0 + 0.37 * k * k)  # no line through two spikes meets another value
    assert filled(values, instants.tolist()).newest_belongs(NOISE) == (4 not in spiked)


def test_noise_is_no_spike_and_too_few_values_say_nothing():
    rng = np.random.default_rng(1)
    recent = RecentValues(5)
    belongs = []
    for k in range(1000):
        recent.put(k, NOISE * rng.normal())
        belongs.append(recent.newest_belongs(NOISE))
    assert belongs[:4] == [False] * 4
    assert np.mean(belongs[4:]) > 0.97
    recent.clear()
    assert not recent.newest_belongs(NOISE)


def test_scatter_is_motion_or_spikes_upon_spikes():
    """Three spikes of five: the two left, and one that happens to lie near, are no start to be sure of."""
    recent = filled([0.313, -0.213, -0.003, -0.002, 0.353])
    assert recent.newest_belongs(0.003)
    assert not recent.newest_belongs(0.003, is_strict=True)


@pytest.mark.parametrize("value", [1e300, -1.7e308])
def test_values_that_overflow_belong_to_none(value):
    recent = filled([0.0, value, 0.1, -value, value])
    assert not recent.newest_belongs(NOISE)


@pytest.mark.parametrize(
    ("field", "size"), [("pitch", 0.3), ("pitch", -0.06), ("depth", 0.8), ("depth", -0.2)]
)
@pytest.mark.parametrize("seed", [0, 5])
def test_a_spike_among_the_first_values_does_not_make_it_confidently_wrong(field, size, seed):
    samples = dive(600, seed)
    for k in range(2 * OPENING):
        spiked = list(samples)
        spiked[k] = replace(samples[k], **{field: getattr(samples[k], field) + size})
        estimator = RobustEstimator(CONFIG)
        statuses = run(estimator, spiked)
        if k >= OPENING:
            assert statuses[k] is Status.REFUSED_OUTLIER
        assert_found(estimator)


def test_a_spike_first_after_a_gap_is_not_followed(trained):
    late = dive(300, 7, first=5000)
    clean, spiked = estimator_of(trained), estimator_of(trained)
    statuses = run(clean, [replace(late[0], pitch=math.nan), *late[1:]])
    assert run(spiked, [replace(late[0], pitch=0.4), *late[1:]]) == statuses
    for name, value in clean.estimate().values.items():
        assert spiked.estimate().values[name] == pytest.approx(value, abs=0.3 * clean.estimate().std[name])


def test_another_datum_is_not_believed_from_a_spike_on(trained):
    """The value that would start the pitch anew is itself wrong: the next one does."""
    limit = CONFIG.outlier_limit
    estimator = estimator_of(trained)
    samples = dive(600, 5, first=1200)
    run(estimator, samples[:100])
    moved = [replace(sample, pitch=sample.pitch + 0.2) for sample in samples[100:]]
    moved[limit] = replace(moved[limit], pitch=1.0)
    statuses = run(estimator, moved)
    start = statuses.index(Status.RESTARTED)
    assert limit < start <= limit + 3
    assert set(statuses[:start]) == {Status.REFUSED_OUTLIER}
    assert set(statuses[start + 1 :]) == {Status.UPDATED}
    assert_found(estimator)


def test_what_is_not_known_of_the_state_lets_no_spike_pass():
    """After a second without pitch, 8 deviations off is well within the gate of 20 that the sensor has."""
    samples = dive(700, 4)
    blind, spiked = RobustEstimator(CONFIG), RobustEstimator(CONFIG)
    hidden = [replace(s, pitch=math.nan) if 60 <= k < 72 else s for k, s in enumerate(samples)]
    run(blind, hidden[:72])
    run(spiked, hidden[:71])
    spread = math.sqrt(spiked._filter.ud.covariance(THETA, THETA))
    assert spread > 5.0 * math.sqrt(spiked._filter.pitch.noise.variance)
    assert (
        spiked.update(replace(hidden[71], pitch=samples[71].pitch + 8.0 * spread)) is Status.REFUSED_OUTLIER
    )
    assert run(spiked, hidden[72:]) == run(blind, hidden[72:])
    assert spiked.estimate().values == blind.estimate().values
