"""What is left by a sensor that is slower than the rows is as white as that of one in every row."""

import numpy as np
import pytest
from scipy.signal import lfilter

from host.noise.whiteness import is_even, is_white

TRIALS = 200


def every(rows: int, values: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    """The values (1, N), one in so many rows."""
    spread = np.full((1, rows * values.size), np.nan)
    spread[0, ::rows] = values
    return spread


@pytest.mark.parametrize("rows", [1, 2, 5, 10])
def test_white_noise_is_white_at_any_rate(rows: int) -> None:
    rng = np.random.default_rng(rows)
    seen = [every(rows, rng.standard_normal(300)) for _ in range(TRIALS)]
    assert np.mean([is_white(one, significance=0.01) for one in seen]) > 0.95
    assert np.mean([is_even(one) for one in seen]) > 0.98


@pytest.mark.parametrize("rows", [1, 2, 5, 10])
def test_what_is_correlated_from_reading_to_reading_is_not(rows: int) -> None:
    rng = np.random.default_rng(rows)
    seen = [every(rows, lfilter([1.0], [1.0, -0.5], rng.standard_normal(300))) for _ in range(TRIALS)]
    assert np.mean([is_white(one) for one in seen]) < 0.05
    slow = [every(rows, lfilter([1.0], [1.0, -0.9], rng.standard_normal(300))) for _ in range(TRIALS)]
    assert np.mean([is_even(one) for one in slow]) < 0.05


def test_readings_lost_at_random_change_nothing() -> None:
    rng = np.random.default_rng(3)
    for share in (0.1, 0.5, 0.8):
        seen = np.where(rng.random((TRIALS, 1, 1500)) < share, np.nan, rng.standard_normal((TRIALS, 1, 1500)))
        assert np.mean([is_white(one, significance=0.01) for one in seen]) > 0.95
