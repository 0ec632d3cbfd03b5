"""A noisy speed sensor does not drive the depth."""

import numpy as np
import pytest

from host.noise.speed import smoothed_speed


def test_a_constant_speed_gives_its_mean() -> None:
    rng = np.random.default_rng(1)
    measured = 1.5 + 0.01 * rng.standard_normal(2000)
    assert np.abs(smoothed_speed(measured).speed - 1.5).max() < 0.002


def test_a_wandering_speed_is_followed() -> None:
    rng = np.random.default_rng(2)
    truth = 1.5 + 0.3 * np.sin(np.arange(2000) / 150.0)
    found = smoothed_speed(truth + 0.01 * rng.standard_normal(2000)).speed
    assert np.sqrt(np.mean((found - truth) ** 2)) < 0.004


def test_a_speed_without_noise_is_kept() -> None:
    truth = 1.5 + 0.3 * np.sin(np.arange(500) / 10.0)
    assert smoothed_speed(truth).speed == pytest.approx(truth, abs=2e-3)
    assert smoothed_speed(np.full(100, 2.0)).speed == pytest.approx(np.full(100, 2.0))


def test_the_error_that_is_left_is_told() -> None:
    rng = np.random.default_rng(3)
    truth = 1.5 + np.cumsum(np.cumsum(3e-5 * rng.standard_normal(4000)))
    errors = [smoothed_speed(truth + 0.002 * rng.standard_normal(4000)).speed - truth for _ in range(20)]
    told = smoothed_speed(truth + 0.002 * rng.standard_normal(4000))
    assert told.variance == pytest.approx(float(np.mean(np.square(errors))), rel=0.2)
    slow = np.array(errors).reshape((20, -1, 200)).mean(axis=2)  # what moves the depth
    density = told.variance * (1.0 + told.decay) / (1.0 - told.decay)
    assert density / 200.0 == pytest.approx(float(np.mean(slow**2)), rel=0.4)


def test_jumps_are_no_reason_to_believe_a_noisy_sensor() -> None:
    """As at every step of the plane: the slope jumps, and the likeliest noise beside would be none."""
    rng = np.random.default_rng(5)
    steps = np.repeat(rng.uniform(-0.3, 0.3, 40), 100)
    truth, slope = np.empty(4000), 0.1
    truth[0] = 3.0
    for k in range(3999):
        truth[k + 1] = truth[k] + 0.1 * slope * (3.0 - 40.0 * steps[k] ** 2 - truth[k])
    told = smoothed_speed(truth + 0.005 * rng.standard_normal(4000))
    error = np.sqrt(np.mean((told.speed - truth) ** 2))
    assert error < 0.003
    assert np.sqrt(told.variance) == pytest.approx(error, rel=0.3)


def test_a_slow_sensor_tells_as_much_with_empty_rows_between_its_readings() -> None:
    rng = np.random.default_rng(4)
    truth = 1.5 + 0.2 * np.sin(np.arange(4000) / 300.0)
    readings = truth[::10] + 0.02 * rng.standard_normal(400)
    rows = np.full(4000, np.nan)
    rows[::10] = readings
    alone, among = smoothed_speed(readings), smoothed_speed(rows)
    assert among.speed[::10] == pytest.approx(alone.speed)
    assert among.variance == alone.variance
    assert among.decay**10 == pytest.approx(alone.decay)
    assert np.sqrt(np.mean((among.speed - truth) ** 2)) < 0.01
