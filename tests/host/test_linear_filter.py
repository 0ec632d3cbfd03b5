import numpy as np
import pytest

from host.compiled import linear_filter as module
from host.compiled.linear_filter import linear_filter

RANDOM = np.random.default_rng(3)
SHAPES = [(1, 4, 7), (2, 1, 1), (300, 5, 14), (50, 8, 9), (50, 3, 24)]


def expected(F: np.ndarray, g: np.ndarray, c: np.ndarray, values: np.ndarray) -> np.ndarray:
    x, seen = np.zeros((g.shape[1], len(values))), []
    for slope, driven, value in zip(F, g, values.T, strict=True):
        seen.append(c @ x)
        x = slope @ x + np.outer(driven, value)
    return np.array(seen).T


def moves(rows: int, nx: int) -> np.ndarray:
    return 0.9 * np.eye(nx) + RANDOM.normal(size=(rows, nx, nx)) * (RANDOM.random((nx, nx)) < 0.5) * 0.05


@pytest.mark.parametrize("is_compiled", [True, False])
@pytest.mark.parametrize(("rows", "nx", "columns"), SHAPES)
def test_each_row_follows_from_the_one_before(
    rows: int, nx: int, columns: int, is_compiled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not is_compiled:
        monkeypatch.setattr(module, "_compiled", lambda: None)
    given = moves(rows, nx), *(RANDOM.normal(size=shape) for shape in [(rows, nx), nx, (columns, rows)])
    np.testing.assert_allclose(linear_filter(*given), expected(*given), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("is_compiled", [True, False])
def test_slices_and_views_are_read_as_they_are(is_compiled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if not is_compiled:
        monkeypatch.setattr(module, "_compiled", lambda: None)
    g, values = RANDOM.normal(size=(3, 40)).T[::2], RANDOM.normal(size=(20, 5)).T
    given = moves(40, 3)[::2], g, np.ones(3), values
    np.testing.assert_allclose(linear_filter(*given), expected(*given), rtol=1e-9, atol=1e-12)


def test_a_run_away_stays_one() -> None:
    with np.errstate(over="ignore", invalid="ignore"):
        seen = linear_filter(np.full((2000, 2, 2), 5.0), np.ones((2000, 2)), np.ones(2), np.ones((2, 2000)))
    assert not np.isfinite(seen[:, -1]).any()


def test_more_states_than_there_is_room_for_are_refused() -> None:
    with pytest.raises(ValueError, match="9 states, of at most 8"):
        linear_filter(np.zeros((2, 9, 9)), np.zeros((2, 9)), np.zeros(9), np.zeros((1, 2)))
