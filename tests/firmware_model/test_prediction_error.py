"""The filter against dense Kalman algebra, and the window against the information it may use."""

import math
from dataclasses import replace

import numpy as np
import pytest
from linear_dive import dive

from firmware_model import EstimatorConfig, RobustConfig
from firmware_model.innovation_window import InnovationWindow
from firmware_model.noise_levels import ForceNoise, SensorNoise
from firmware_model.prediction_error import PredictionError
from firmware_model.propagation import COUNT, GAMMA, KAPPA, PATTERN, THETA, ZETA, Propagation, Q, W
from firmware_model.second_order import SecondOrder
from firmware_model.ud_factors import UdFactors

CONFIG = EstimatorConfig(step=0.1, speed=2.0)


def dense(ud):
    L = np.array(ud.L).T
    return L @ np.diag(ud.D) @ L.T


def fed(samples, **settings):
    own = PredictionError(replace(CONFIG, robust=RobustConfig(**settings)))
    for k, sample in enumerate(samples):
        if k > 0:
            own.predict(samples[k - 1].rudder, is_excited=True)
        own.window.learn(own.ud)
        own.learn(own.pitch, sample.pitch)
        own.learn(own.depth, sample.depth)
        own.settle()
    return own


def test_a_step_is_that_of_a_dense_extended_kalman_filter():
    samples = dive(200)
    own = fed(samples[:150])
    x, P = np.array(own.ud.x), dense(own.ud)
    moments = SecondOrder()
    moments.update(own.ud)
    noise = [
        0.1 * (min(4.0 * moments.heave_variance, 0.0125 * 4.0) + own.depth.force.density),
        0.1 * (min(moments.pitch_variance, 0.02) + own.pitch.force.density),
    ]
    propagation = Propagation(0.1)
    moved = x.tolist()
    propagation.advance(moved, samples[149].rudder, 2.0, moments.heave_mean, moments.pitch_mean)
    F = np.vstack([np.eye(COUNT)[:W], propagation.F])
    x, P = np.array(moved), F @ P @ F.T
    P[W, W] += noise[0]
    P[Q, Q] += noise[1]
    for sensor, value in ((own.pitch, samples[150].pitch), (own.depth, samples[150].depth)):
        h = np.eye(COUNT)[sensor.entry]
        K = P @ h / (P[sensor.entry, sensor.entry] + sensor.noise.variance)
        x, P = x + K * (value - h @ x), P - np.outer(K, h @ P)
    own.predict(samples[149].rudder, is_excited=True)
    own.learn(own.pitch, samples[150].pitch)
    own.learn(own.depth, samples[150].depth)
    np.testing.assert_allclose(own.ud.x, x, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(dense(own.ud), P, rtol=1e-6, atol=1e-12)


def test_second_moments_are_those_of_gaussian_samples():
    rng = np.random.default_rng(0)
    ud = UdFactors(COUNT, PATTERN, driven=(0, 1))
    for j in range(COUNT):
        ud.D[j] = 0.5 + rng.random()
        ud.L[j][j + 1 :] = (0.3 * rng.normal(size=COUNT - j - 1)).tolist()
    e = rng.multivariate_normal(np.zeros(COUNT), dense(ud), size=400_000).T
    heave = e[0] * e[W] + e[GAMMA] * e[THETA] - e[KAPPA] * e[Q]
    pitch = e[1] * e[Q] + e[2] * e[THETA]
    moments = SecondOrder()
    moments.update(ud)
    assert moments.heave_mean == pytest.approx(heave.mean(), abs=0.02)
    assert moments.pitch_mean == pytest.approx(pitch.mean(), abs=0.02)
    assert moments.heave_variance == pytest.approx(heave.var(), rel=0.02)
    assert moments.pitch_variance == pytest.approx(pitch.var(), rel=0.02)


@pytest.mark.parametrize("p", [2, 5])
def test_a_window_uses_the_information_of_each_sample_exactly_once(p):
    """Without noise on the way, p uses of weight 1/p make the covariance of one use of weight 1."""
    rng = np.random.default_rng(p)
    propagation = Propagation(0.1)
    one, many = (UdFactors(COUNT, PATTERN, driven=(0, 1)) for _ in range(2))
    for ud in (one, many):
        ud.D[:] = [1.0] * COUNT
    window = InnovationWindow(p)
    quiet = [0.0, 0.0]
    truth = [-0.6, -3.4, -8.2, 0.4, -3.9, 0.5, -0.3, 0.01, 0.02, 0.1, 0.2, 0.1, 5.0]
    for k in range(60):
        samples = rng.normal(size=2) if k < 60 - p + 1 else None  # the last samples live through all uses
        propagation.advance(list(truth), float(rng.uniform(-0.2, 0.2)), 2.0, 0.0, 0.0)
        for ud in (one, many):
            # A linear system: the mean moves by F as well.
            ud.x[W:] = [sum(f * x for f, x in zip(row, ud.x, strict=True)) for row in propagation.F]
            ud.move(propagation.F, quiet)
        window.carry(propagation.F, quiet)
        window.learn(many)
        if samples is not None:
            for entry, value in zip((THETA, ZETA), samples.tolist(), strict=True):
                one.observe_entry(entry, value - one.x[entry], 0.01)
                many.observe_entry(entry, value - many.x[entry], 0.01 * p)
                window.add(entry, value - window.before(entry), 0.01)
        window.settle(many)
    np.testing.assert_allclose(dense(many), dense(one), rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(many.x, one.x, rtol=1e-5, atol=1e-7)


def test_innovation_lengths_find_the_same():
    samples = dive(1500)
    one, five = fed(samples), fed(samples, innovation_length=5)
    for entry in range(KAPPA + 1):
        std = math.sqrt(one.ud.covariance(entry, entry))
        assert abs(five.ud.x[entry] - one.ud.x[entry]) < std
        assert 0.5 < math.sqrt(five.ud.covariance(entry, entry)) / std < 2.0


def test_the_product_gamma_is_learnt_in_the_end():
    own = fed(dive(3000))
    assert own.ud.x[GAMMA] == pytest.approx(own.ud.x[0] * own.ud.x[KAPPA], abs=1e-3)
    free = fed(dive(3000), heave_pitch_rate_coupling=True)
    assert free.coupling[0] == pytest.approx(0.0, abs=4.0 * free.coupling[1])
    assert free.coupling[1] > 1e-3


def test_a_sensor_s_noise_is_found_from_a_wrong_start():
    rng = np.random.default_rng(0)
    for first in (0.1, 1.0, 20.0):
        noise = SensorNoise(first, 1e-6, 1000.0)
        for e in rng.normal(size=4000):
            noise.learn(noise.variance + 0.01, e * e / (noise.variance + 0.01))
        assert noise.variance == pytest.approx(1.0, rel=0.15)
    for _ in range(20_000):
        noise.learn(noise.variance, 0.0)
    assert noise.variance == 1e-6


def test_forces_rise_with_alike_innovations_and_fade_with_white_ones():
    rng = np.random.default_rng(0)
    force = ForceNoise(0.1, first=1e-4, highest=1e-2, target=0.02, time=0.5)
    u, levels = 0.0, []
    for e in rng.normal(size=600):
        u = 0.8 * u + 0.6 * e
        force.learn(float(u))
        levels.append(force.density)
    assert levels[-1] == 1e-2
    for e in rng.normal(size=6000):
        force.learn(float(e))
    assert force.density < 1e-4
