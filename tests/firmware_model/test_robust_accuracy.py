"""Two hundred dives: bias, deviation and honesty of the noise-proof estimator."""

import math
from multiprocessing import get_context

import numpy as np
import pytest
from linear_dive import TRUTH, dive, held_levels

from firmware_model import EstimatorConfig, RobustEstimator

NAMES = tuple(TRUTH)


def learn(seed, count=3000):
    estimator = RobustEstimator(EstimatorConfig(step=0.1, speed=2.0))
    for sample in dive(count, seed, rudder=held_levels(np.random.default_rng(seed), count)):
        estimator.update(sample)
    estimate = estimator.estimate()
    return [estimate.values[name] for name in NAMES], [estimate.std[name] for name in NAMES]


@pytest.mark.long
def test_two_hundred_dives_meet_the_bars():
    with get_context("spawn").Pool() as pool:
        values, stds = (np.array(column) for column in zip(*pool.map(learn, range(200)), strict=True))
    truth = np.array([TRUTH[name] for name in NAMES])
    errors = values - truth
    assert (np.abs(errors) < 0.25 * np.abs(truth)).all()  # none diverged
    bias, spread = errors.mean(axis=0), errors.std(axis=0, ddof=1)
    assert (np.abs(bias) < 0.01 * np.abs(truth)).all()
    assert (np.abs(bias) < spread).all()
    honesty = np.sqrt(np.mean(stds**2, axis=0)) / spread
    assert ((honesty > 0.8) & (honesty < 1.3)).all(), honesty
    coverage = (np.abs(errors) < 1.96 * stds).mean()
    assert 0.92 < coverage < 0.98, coverage
    # 1.5 Cramér-Rao bounds of such dives: percent of a1, a2, a3, b1, b2, u0
    limits = 1.5 * np.array([0.63, 0.33, 0.28, 1.4, 0.3, 0.42])
    assert (100.0 * spread < limits * np.abs(truth)).all(), 100.0 * spread / np.abs(truth)
    assert math.isfinite(honesty.sum())
