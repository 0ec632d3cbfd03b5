import numpy as np
import pytest

from host.noise.noise_floor import white_noise

ROWS, NOISE = 1000, 0.02


def noisy(seed: int) -> np.ndarray:  # type: ignore[type-arg]
    return NOISE * np.random.default_rng(seed).standard_normal(ROWS)


def test_the_floor_is_that_of_white_noise_and_errs_less_than_a_median() -> None:
    differences = [np.diff(noisy(seed), 4) for seed in range(200)]
    by_median = np.array([np.median(np.abs(each)) for each in differences]) ** 2
    found = np.array([white_noise([noisy(seed)]) for seed in range(200)])
    assert found.mean() == pytest.approx(NOISE**2, rel=0.03)
    assert found.std() / found.mean() < 0.85 * by_median.std() / by_median.mean()


def test_steps_of_the_plane_and_smooth_motion_do_not_move_it() -> None:
    time = 0.1 * np.arange(ROWS)
    still = white_noise([noisy(0)])
    motion = 0.5 * np.sin(0.7 * time) + 3.0 * np.cumsum(np.arange(ROWS) % 60 == 0)
    assert white_noise([noisy(0) + motion]) == pytest.approx(still, rel=0.15)


@pytest.mark.parametrize("values", [np.zeros(50), np.zeros(3)])
def test_what_has_no_noise_has_the_least(values: np.ndarray) -> None:  # type: ignore[type-arg]
    assert white_noise([values]) == 1e-12
