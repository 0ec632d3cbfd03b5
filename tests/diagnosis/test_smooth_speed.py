"""A measured speed drives depth and all forces: its noise must not."""

from dataclasses import replace

import numpy as np
from hidden_dive import hidden_dive
from scipy.interpolate import make_smoothing_spline
from scipy.signal import lfilter

from host.diagnosis.smooth_speed import with_smooth_speed
from host.recording import Array, Recording

NOISE = 0.005  # m/s


def deviation(recording: Recording, truth: Array) -> float:
    return float(np.std(recording.speed - truth))


def measured(dive: Recording, truth: Array) -> Recording:
    return replace(dive, speed=truth + NOISE * np.random.default_rng(3).standard_normal(truth.size))


def test_a_steady_speed_loses_nearly_all_of_its_noise() -> None:
    dive = hidden_dive(seed=1)
    truth = np.full(dive.time.size, 1.2)
    assert deviation(with_smooth_speed(measured(dive, truth)), truth) < 0.2 * NOISE


def test_a_speed_that_falls_when_the_plane_moves_keeps_its_corners() -> None:
    dive = hidden_dive(seed=1)
    lost = lfilter([0.02], [1.0, -0.98], dive.rudder**2)  # 5 s
    truth = 1.2 - 2.0 * lost
    noisy = measured(dive, truth)
    smooth = with_smooth_speed(noisy)
    assert deviation(smooth, truth) < 0.2 * NOISE
    by_spline = make_smoothing_spline(dive.time, noisy.speed)(dive.time)
    assert deviation(smooth, truth) < 0.7 * float(np.std(by_spline - truth))


def test_a_speed_that_plane_and_pitch_do_not_explain_is_followed() -> None:
    dive = hidden_dive(seed=1)
    truth = 1.2 + 0.3 * np.tanh((dive.time - 40.0) / 3.0)  # another thrust
    assert deviation(with_smooth_speed(measured(dive, truth)), truth) < 0.7 * NOISE


def test_without_a_speed_nothing_is_done() -> None:
    dive = hidden_dive(duration=20.0)
    assert with_smooth_speed(dive) is dive
