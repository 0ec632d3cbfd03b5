import numpy as np
import pytest

from host.compiled import linear_recursion as module
from host.compiled.linear_recursion import linear_recursion

RANDOM = np.random.default_rng(3)
SHAPES = [(1, 4, 7, 3), (2, 1, 1, 1), (300, 6, 14, 10), (50, 5, 9, 9), (50, 5, 9, 0)]


def expected(F: np.ndarray, G: np.ndarray, start: np.ndarray) -> np.ndarray:
    S = [start]
    for slope, driven in zip(F[:-1], G[:-1], strict=True):
        S.append(slope @ S[-1])
        S[-1][:, : driven.shape[1]] += driven
    return np.array(S)


@pytest.mark.parametrize("is_compiled", [True, False])
@pytest.mark.parametrize(("rows", "nx", "columns", "given"), SHAPES)
def test_each_row_follows_from_the_one_before(
    rows: int, nx: int, columns: int, given: int, is_compiled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not is_compiled:
        monkeypatch.setattr(module, "_compiled", lambda: None)
    F = 0.9 * np.eye(nx) + RANDOM.normal(size=(rows, nx, nx)) * (RANDOM.random((nx, nx)) < 0.5) * 0.05
    G, start = RANDOM.normal(size=(rows, nx, given)), RANDOM.normal(size=(nx, columns))
    np.testing.assert_allclose(linear_recursion(F, G, start), expected(F, G, start), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("is_compiled", [True, False])
def test_slices_and_views_are_read_as_they_are(is_compiled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if not is_compiled:
        monkeypatch.setattr(module, "_compiled", lambda: None)
    F, G = RANDOM.normal(size=(3, 3, 20)).T * 0.3, RANDOM.normal(size=(40, 3, 6))[::2, :, ::2]
    start = RANDOM.normal(size=(5, 3)).T
    np.testing.assert_allclose(linear_recursion(F, G, start), expected(F, G, start), rtol=1e-9)


def test_a_run_away_stays_one() -> None:
    F = np.full((2000, 2, 2), 5.0)
    with np.errstate(over="ignore", invalid="ignore"):
        S = linear_recursion(F, np.ones((2000, 2, 1)), np.ones((2, 2)))
    assert not np.isfinite(S[-1]).any()
