from dataclasses import replace

import numpy as np
import pytest
from exact_dive import TABLE_1, Dive, fly
from scipy.signal import lfilter

from host.identification.uncertainty import covariance
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.noise.whiteness import autocovariance, clustering, crosscovariance, is_even, is_white


def test_white_noise_is_white_and_filtered_noise_is_not() -> None:
    rng = np.random.default_rng(1)
    white = rng.standard_normal((2, 2000))
    assert is_white(white)
    assert not is_white(np.asarray(lfilter([1.0], [1.0, -0.3], white)))


@pytest.mark.parametrize("constant", [0.0, 0.1, np.nan])
def test_what_never_changes_tells_nothing_against_whiteness(constant: float) -> None:
    white = np.random.default_rng(5).normal(size=(1, 500))
    assert is_white(np.vstack([white, np.full(500, constant)]))
    assert not is_white(np.vstack([np.full(500, constant), np.cumsum(white)]))


def test_white_noise_whose_variance_comes_and_goes_is_white_and_what_it_hides_is_not() -> None:
    rng = np.random.default_rng(4)
    rejected = 0
    for _ in range(50):
        near_an_edge = np.repeat(rng.random(200) < 0.2, 10)  # of a step of rounding
        white = rng.standard_normal((1, 2000)) * np.where(near_an_edge, 1.0, 0.05)
        rejected += not is_white(white)
    assert rejected <= 2
    assert clustering(white[0]) > 1.3
    assert clustering(rng.standard_normal(2000)) == pytest.approx(1.0, abs=0.1)
    assert not is_white(np.asarray(lfilter([1.0], [1.0, -0.5], white)))
    by_large_stretches = rng.standard_normal((300, 2000)) * np.repeat(
        rng.random((300, 20)) < 0.15, 100, axis=1
    )
    assert sum(not is_even(row[None]) for row in by_large_stretches) <= 3
    assert not is_even(white + 0.3 * np.sin(np.arange(2000) / 300.0))


def test_correlations_up_to_the_slack_are_let_pass_and_no_larger_ones() -> None:
    noise = np.random.default_rng(3).standard_normal((1, 20000))
    slight, more = (np.asarray(lfilter([1.0, c], [1.0], noise)) for c in (0.04, 0.15))
    assert not is_white(slight)
    assert is_white(slight, slack=0.05)
    assert not is_white(more, slack=0.05)


def test_gaps_do_not_colour_white_noise() -> None:
    rng = np.random.default_rng(2)
    rejected = 0
    for _ in range(50):
        white = rng.standard_normal((2, 2000))
        white[rng.random(white.shape) < 0.5] = np.nan
        rejected += not is_white(white)
    assert rejected <= 2


def test_autocovariance_equals_its_definition() -> None:
    values = np.array([1.0, -2.0, np.nan, 0.5, 3.0])
    covariance_, pairs = autocovariance(values, 2)
    x = values - np.nanmean(values)
    assert pairs.tolist() == [4.0, 2.0, 1.0]
    expected = [np.nanmean(x**2), (x[0] * x[1] + x[3] * x[4]) / 2.0, x[1] * x[3]]
    assert np.allclose(covariance_, expected)


def test_coloured_sensor_noise_widens_the_deviations() -> None:
    """Depth noise with a correlation time of a second: white-noise deviations would claim too much."""
    recording, states = fly(Dive(duration=200.0, depth_noise=0.0))
    rng = np.random.default_rng(3)
    coloured = lfilter([np.sqrt(1 - 0.9**2)], [1.0, -0.9], rng.standard_normal(recording.time.size)) * 0.03
    recording.depth[:] = states[3] + coloured
    fit = fit_maximum_likelihood([recording], noise_model="output_error")
    free = fit.free
    naive = np.linalg.inv(fit.information[np.ix_(free, free)])
    assert np.isfinite(covariance(fit)).all()
    std = np.sqrt(np.diag(covariance(fit)))[free]
    error = np.abs(fit.parameters[:6] - np.array(list(TABLE_1.values())))
    assert (error < 4.0 * std[:6]).all()
    assert std[0] > 1.5 * np.sqrt(naive[0, 0])


def test_no_variance_is_negative_where_two_parameters_cannot_be_told_apart() -> None:
    recording, states = fly(Dive(duration=120.0, depth_noise=0.0))
    rng = np.random.default_rng(4)
    recording.depth[:] = states[3] + np.cumsum(rng.standard_normal(recording.time.size)) * 0.003
    fit = fit_maximum_likelihood([recording], noise_model="output_error")
    a, b = np.flatnonzero(fit.free)[:2]
    for parallel in np.geomspace(1e-9, 1e-6, 12):
        scores = [np.array(S) for S in fit.scores]
        for S in scores:
            S[:, 1] = S[:, 0] + parallel * S[:, 1]
        M = sum(np.einsum("opk,oqk->pq", S, S) for S in scores)
        information = np.array(fit.information)
        information[np.ix_(fit.free, fit.free)] = M
        variances = np.diag(covariance(replace(fit, scores=scores, information=information, rivals=())))
        assert (variances >= 0.0).all()
        assert variances[[a, b]].min() > 0.0


def test_crosscovariance_equals_its_definition() -> None:
    one, other = np.array([1.0, -2.0, np.nan, 0.5, 3.0]), np.array([0.5, 1.0, 2.0, np.nan, -1.0])
    x, y = one - np.nanmean(one), other - np.nanmean(other)
    got = crosscovariance(one, other, 2)
    expected = [
        np.mean([x[0] * y[0], x[1] * y[1], x[4] * y[4]]),
        np.mean([x[1] * y[0], x[3] * y[2]]),
        np.mean([x[3] * y[1], x[4] * y[2]]),
    ]
    assert np.allclose(got, expected)
