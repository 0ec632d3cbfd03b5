"""Rounded readings: the likelihood of the intervals in which the sensor's values lay."""

from dataclasses import replace

import numpy as np
import pytest
from exact_dive import Dive, fly
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from host.dynamics.equations import BASE
from host.dynamics.propagate import inputs_of
from host.identification.uncertainty import covariance
from host.likelihood.gauss_newton import Point
from host.likelihood.interval_likelihood import (
    LEAST_DEVIATION,
    likeliest_deviation,
    log_probability,
    score_and_information,
)
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.likelihood.output_error import free_run_cost, output_error
from host.noise.noise_floor import resolution

STEP = 0.1
ERRORS = np.linspace(-0.4, 0.4, 161)


def test_probabilities_of_all_readings_add_up_to_one() -> None:
    readings = STEP * np.arange(-200, 201)
    for deviation in (0.004, 0.03, 0.5):
        assert np.exp(log_probability(readings - 0.0137, STEP, deviation)).sum() == pytest.approx(1.0)


def test_far_tails_keep_their_digits() -> None:
    far = np.array([5.0, 50.0])
    expected = norm.logsf(far - 0.5 * STEP, scale=0.05)
    np.testing.assert_allclose(log_probability(far, STEP, 0.05), expected, rtol=1e-9)
    np.testing.assert_allclose(log_probability(-far, STEP, 0.05), expected, rtol=1e-9)


def test_small_steps_leave_the_normal_density() -> None:
    expected = norm.logpdf(ERRORS, scale=0.2) + np.log(1e-4)
    np.testing.assert_allclose(log_probability(ERRORS, 1e-4, 0.2), expected, atol=1e-6)
    score, information = score_and_information(ERRORS, 1e-4, 0.2)
    np.testing.assert_allclose(score, ERRORS / 0.04, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(information, 1.0 / 0.04, rtol=1e-5)


@given(st.floats(0.004, 0.3), st.floats(-0.5, 0.5))
def test_derivatives_are_those_of_the_probability(deviation: float, error: float) -> None:
    h = 1e-4 * deviation
    # The prediction rises where the error falls.
    ahead, at, back = log_probability(error - h * np.array([1.0, 0.0, -1.0]), STEP, deviation)
    score, information = score_and_information(np.array([error]), STEP, deviation)
    assert score[0] == pytest.approx((ahead - back) / (2.0 * h), rel=1e-5, abs=1e-6 / deviation)
    curvature = -(ahead - 2.0 * at + back) / h**2
    assert 0.0 < information[0] <= 1.0 / deviation**2
    assert information[0] == pytest.approx(curvature, rel=1e-2, abs=1e-3 / deviation**2 * max(1.0, abs(at)))


@pytest.mark.parametrize("deviation", [0.005, 0.01, 0.03, 0.1])
def test_noise_beneath_the_rounding_is_found(deviation: float) -> None:
    rng = np.random.default_rng(4)
    true = np.cumsum(rng.normal(0.0, 0.02, 5000))
    read = STEP * np.round((true + rng.normal(0.0, deviation, true.size)) / STEP)
    found, cost = likeliest_deviation(read - true, STEP)
    assert found == pytest.approx(deviation, rel=0.12)
    assert cost <= -log_probability(read - true, STEP, deviation).sum()


@given(st.floats(0.001, 1.0), st.floats(-0.2, 0.2), st.sampled_from([0.0, 5.0]), st.integers(0, 2**16))
def test_no_other_deviation_is_likelier(deviation: float, bias: float, spike: float, seed: int) -> None:
    errors = np.random.default_rng(seed).normal(bias, deviation, 100) + spike * (np.arange(100) == 50)
    found, cost = likeliest_deviation(errors, STEP)
    assert found >= 0.999 * LEAST_DEVIATION * STEP
    assert cost == pytest.approx(-log_probability(errors, STEP, found).sum())
    others = np.geomspace(LEAST_DEVIATION * STEP, 20.0, 60)
    least = min(-log_probability(errors, STEP, other).sum() for other in others)
    assert cost <= least + 1e-3 * max(1.0, abs(least))


def test_readings_that_fit_without_noise_end_at_the_least_deviation() -> None:
    found, cost = likeliest_deviation(np.zeros(100), STEP)
    assert found < 0.2 * STEP
    assert cost < 1e-6
    edges, _ = likeliest_deviation(np.linspace(-0.5, 0.5, 100) * STEP * 0.999, STEP)
    assert edges == pytest.approx(LEAST_DEVIATION * STEP, rel=0.02)


def test_a_fit_to_readings_in_coarse_steps_is_unbiased_and_knows_its_accuracy() -> None:
    dive = Dive(duration=120.0)
    off = []
    for seed in range(6):
        recording, _ = fly(replace(dive, seed=seed))
        read = replace(recording, depth=STEP * np.round(recording.depth / STEP))
        fit = fit_maximum_likelihood([read], noise_model="output_error")
        deviations = np.sqrt(np.diag(covariance(fit)))
        off.append((fit.parameters[:6] - np.array(dive.vehicle)) / deviations[:6])
        assert np.sqrt(fit.noise[1] - STEP**2 / 12.0) == pytest.approx(dive.depth_noise, rel=0.3)
    assert np.abs(off).max() < 3.5
    assert 0.5 < np.std(off) < 1.5


def test_a_start_that_runs_away_from_rounded_readings_is_given_up() -> None:
    recording, _ = fly(Dive(duration=30.0))
    read = replace(recording, depth=STEP * np.round(recording.depth / STEP))
    inputs = [inputs_of(read, steps=resolution([read]))]
    assert inputs[0].steps[1] == pytest.approx(STEP)
    wild = np.array([0.5, 20.0, 200.0, 0.1, 5.0, 1.0, 0.0, 0.0])
    start = Point(BASE, wild, [np.array([0.0, 0.0, 0.1, 10.0, 0.0])], np.zeros(4))
    lost = output_error(start, inputs, np.ones(wild.size, dtype=bool))
    assert lost.log_likelihood == -np.inf
    assert free_run_cost(start, inputs) > 1e5
