"""Whitening of what a plane does that stepped unseen."""

import numpy as np
import pytest

from host.noise.unseen_plane import foreseen_unseen, unseen_plane

N, J = 30, 4
NOISE = np.array([0.02, 0.3]) ** 2


@pytest.fixture
def doubt() -> np.ndarray:
    return np.random.default_rng(3).normal(size=(J, 2, N)) * np.array([0.02, 0.3])[:, None]


@pytest.fixture
def present() -> np.ndarray:
    return (np.random.default_rng(4).random((2, N)) > 0.3).astype(float)


def covariance(doubt: np.ndarray) -> np.ndarray:
    shifts = doubt.reshape(len(doubt), -1)
    return np.diag(np.repeat(NOISE, N)) + shifts.T @ shifts


def test_squares_are_those_of_the_whole_covariance(doubt: np.ndarray, present: np.ndarray) -> None:
    whitening = unseen_plane(doubt, present, NOISE)
    assert whitening is not None
    errors = present * np.random.default_rng(5).normal(size=(2, N))
    whitened = whitening.whitened(errors)
    known = np.flatnonzero(present.ravel())
    inverse = np.linalg.inv(covariance(doubt)[np.ix_(known, known)])
    flat = errors.ravel()[known]
    assert np.sum(whitened**2 / NOISE[:, None]) == pytest.approx(flat @ inverse @ flat)
    assert not whitened[present == 0.0].any()


def test_sensitivities_are_whitened_one_by_one(doubt: np.ndarray, present: np.ndarray) -> None:
    whitening = unseen_plane(doubt, present, NOISE)
    assert whitening is not None
    slopes = np.random.default_rng(6).normal(size=(2, 3, N))
    for k in range(3):
        assert whitening.whitened(slopes)[:, k] == pytest.approx(whitening.whitened(slopes[:, k]))


def test_what_has_run_away_warns_of_nothing(doubt: np.ndarray, present: np.ndarray) -> None:
    whitening = unseen_plane(doubt, present, NOISE)
    assert whitening is not None
    assert not np.isfinite(whitening.whitened(np.full((2, N), 1e308) * present)).all()


def test_without_doubt_or_where_it_is_not_seen_there_is_none(doubt: np.ndarray, present: np.ndarray) -> None:
    assert unseen_plane(None, present, NOISE) is None
    assert unseen_plane(1e-3 * doubt, present, NOISE) is None


def test_what_is_foreseen_is_the_conditional_mean_and_variance(doubt: np.ndarray) -> None:
    taught = np.zeros((2, N), dtype=bool)
    taught[:, :20] = True
    left = np.random.default_rng(7).normal(size=(2, N))
    foreseen, spread = foreseen_unseen(doubt, left * taught, taught, NOISE)
    C = covariance(doubt)
    shared = C - np.diag(np.repeat(NOISE, N))
    known, hidden = np.flatnonzero(taught.ravel()), np.flatnonzero(~taught.ravel())
    gain = shared[np.ix_(hidden, known)] @ np.linalg.inv(C[np.ix_(known, known)])
    assert foreseen.ravel()[hidden] == pytest.approx(gain @ left.ravel()[known])
    variance = C[np.ix_(hidden, hidden)] - gain @ shared[np.ix_(known, hidden)]
    assert spread.ravel()[hidden] == pytest.approx(np.diag(variance) / np.repeat(NOISE, N)[hidden])
