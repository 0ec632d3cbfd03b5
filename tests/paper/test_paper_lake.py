"""Section 6: cleaning, identification, free run."""

import numpy as np
import pytest

from tools.paper.lake import LENGTH, errors_of, fly_lake, identify_lake
from tools.paper.lake_data import (
    STEP,
    derivative,
    lake_hull,
    rudder_force,
    solved_form,
    trial,
    without_outliers,
)


@pytest.fixture(scope="module")
def clean():
    return trial(1, 80.0, spoilt=False)


@pytest.mark.parametrize("p", [1, LENGTH])
def test_clean_data_give_the_simulated_coefficients_back(clean, p):
    np.testing.assert_allclose(identify_lake(clean, p).solved, solved_form(lake_hull()), rtol=0.02)


def test_free_run_of_the_true_coefficients_meets_the_plant(clean):
    mean, _ = errors_of(fly_lake(solved_form(lake_hull()), clean), clean)
    assert mean["w"] < 2e-3
    assert mean["theta"] < 0.2


def test_spoilt_data_still_predict_a_trial_never_seen():
    learnt, other = trial(1, 120.0), trial(2, 60.0)
    mean, _ = errors_of(fly_lake(identify_lake(learnt, LENGTH).solved, other), other)
    assert mean["w"] < 0.02
    assert mean["theta"] < 2.0


def test_rudder_force_is_that_of_table_7():
    force, moment = rudder_force()
    assert force == pytest.approx(-0.5 * 1000.0 * 4.90e-3 * 2.5**2 * 3.0980)
    assert moment == pytest.approx(0.7240 * force)


def test_outliers_and_frozen_stretches_are_taken_out_and_little_else():
    rng = np.random.default_rng(0)
    t = np.arange(1000) * STEP
    values = np.sin(t) + 0.01 * rng.standard_normal(t.size)
    values[100] += 1.0
    values[500:510] = values[500]
    removed = np.isnan(without_outliers(values))
    assert removed[100]
    assert removed[500:510].all()
    assert removed.mean() < 0.03


def test_derivative_is_exact_for_what_the_filter_passes():
    t = np.arange(200) * STEP
    np.testing.assert_allclose(derivative(np.sin(4.0 * t))[5:-5], 4.0 * np.cos(4.0 * t)[5:-5], atol=1e-3)
