"""What of a misfit can be told from noise and waves."""

from dataclasses import replace

import numpy as np
import pytest

from tools.trial.visibility import Yardstick
from tools.trial.voyage import Voyage

ROWS = 4000
RATE_HZ = 10.0


def voyage(pitch: np.ndarray, depth: np.ndarray) -> Voyage:
    return Voyage(table={}, command=np.zeros(ROWS), speed=np.ones(ROWS), pitch=pitch, depth=depth)


@pytest.fixture
def truth() -> Voyage:
    return voyage(np.zeros(ROWS), np.zeros(ROWS))


@pytest.fixture
def noise() -> Yardstick:
    everywhere = np.ones(ROWS, dtype=bool)
    return Yardstick(pitch_noise=0.001, depth_noise=0.01, has_pitch=everywhere, has_depth=everywhere)


def chi2(noise: Yardstick, truth: Voyage, pitch: np.ndarray, depth: np.ndarray) -> float:
    residual = noise.residual(pitch, depth, truth)
    return float(residual @ residual)


def test_only_what_arrived_is_compared(noise: Yardstick, truth: Voyage) -> None:
    half = np.arange(ROWS) < ROWS // 2
    lost = replace(noise, has_depth=half)
    off = np.full(ROWS, 0.02)
    assert chi2(noise, truth, 0 * off, off) == pytest.approx(4 * ROWS)
    assert chi2(lost, truth, 0 * off, off) == pytest.approx(2 * ROWS)


def test_white_waves_count_as_noise(noise: Yardstick, truth: Voyage) -> None:
    waves = 0.03 * np.random.default_rng(1).normal(size=ROWS)
    among = noise.among_waves(voyage(0 * waves, waves), truth, RATE_HZ)
    off = 0.01 * np.random.default_rng(2).normal(size=ROWS)
    calm = chi2(noise, truth, 0 * off, off)
    assert chi2(among, truth, 0 * off, off) == pytest.approx(calm / 10, rel=0.25)
    assert chi2(among, truth, off / 10, 0 * off) == pytest.approx(calm, rel=1e-6)


def test_waves_hide_what_swings_as_they_do_and_nothing_slower(noise: Yardstick, truth: Voyage) -> None:
    t = np.arange(ROWS) / RATE_HZ
    waves = 0.5 * np.sin(2 * np.pi * 0.15 * t + 1.0)
    among = noise.among_waves(voyage(0 * t, waves), truth, RATE_HZ)
    for frequency, least, most in ((0.15, 0.0, 0.02), (0.02, 0.97, 1.01)):
        off = 0.02 * np.sin(2 * np.pi * frequency * t)
        assert least < chi2(among, truth, 0 * t, off) / chi2(noise, truth, 0 * t, off) < most
