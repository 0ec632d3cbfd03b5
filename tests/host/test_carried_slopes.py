"""Sensitivities carried through a run: as finite differences have them, with and without a compiler."""

import casadi as ca
import numpy as np
import pytest

from host.compiled import carried_slopes as module
from host.compiled.all_rows import AllRows
from host.compiled.carried_slopes import CarriedSlopes, Passage

RANDOM = np.random.default_rng(5)
ROWS = 150


def model() -> tuple[ca.Function, ca.Function, CarriedSlopes]:
    """One sub-step of a bent pendulum and its outputs, and their slopes."""
    x, p, drive, number = (ca.SX.sym(name, size) for name, size in [("x", 3), ("p", 2), ("d", 1), ("n", 1)])
    after = ca.vertcat(
        x[0] + 0.1 * x[1],
        0.8 * x[1] - p[0] * ca.sin(x[0]) + (1 + number) * drive[0],
        0.9 * x[2] + p[1] * x[0],
    )
    y = ca.vertcat(x[0] + p[1], x[2] + x[1] * x[0])
    given = [x, p, drive]
    slopes = ca.Function("s", [*given, number], [ca.jacobian(after, x), ca.jacobian(after, p)])
    output = ca.Function("o", given, [ca.jacobian(y, x), ca.jacobian(y, p)])
    return (
        ca.Function("step", [*given, number], [after]),
        ca.Function("y", given, [y]),
        CarriedSlopes(AllRows(output), AllRows(slopes)),
    )


def run(
    p: np.ndarray, start: np.ndarray, drive: np.ndarray, substeps: int, corrections: np.ndarray | None
) -> tuple[np.ndarray, ...]:
    """Outputs (2, N), the states (3, N) seen, and where the sub-steps began (substeps, 3, N)."""
    step, y, _ = model()
    x, seen, states, within = start, [], [], []
    for row in range(ROWS):
        output = np.array(y(x, p, drive[:, row])).ravel()
        seen.append(output)
        states.append(x)
        if corrections is not None:
            gain, measured = corrections[:6, row].reshape((2, 3)).T, corrections[6:, row]
            x = x + gain @ (measured - output)
        begun = []
        for number in range(substeps):
            begun.append(x)
            x = np.array(step(x, p, drive[:, row], number)).ravel()
        within.append(begun)
    return np.array(seen).T, np.array(states).T, np.array(within).transpose(1, 2, 0)


@pytest.mark.parametrize("is_compiled", [True, False])
@pytest.mark.parametrize("substeps", [1, 3])
@pytest.mark.parametrize("is_corrected", [False, True])
def test_they_are_those_of_the_run(
    substeps: int, is_corrected: bool, is_compiled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not is_compiled:
        monkeypatch.setattr(module, "_compiled", lambda: None)
    p, start, drive = np.array([0.3, 0.2]), np.array([0.4, -0.1, 0.2]), 0.05 * RANDOM.normal(size=(1, ROWS))
    corrections = 0.1 * RANDOM.normal(size=(8, ROWS)) if is_corrected else None
    _, states, within = run(p, start, drive, substeps, corrections)
    present = (RANDOM.random((2, ROWS)) < 0.9).astype(float)
    S = np.zeros((3, 5))
    S[:, 2:] = np.eye(3)
    gains = None if corrections is None else corrections[:6]
    found = model()[2](Passage(states, within, p, drive, S, present, gains))
    assert found.shape == (2, 5, ROWS)
    for column, moved in enumerate(np.eye(5) * 1e-6):
        ends = [run(p + s * moved[:2], start + s * moved[2:], drive, substeps, corrections) for s in (1, -1)]
        expected = present * (ends[0][0] - ends[1][0]) / 2e-6
        np.testing.assert_allclose(found[:, column], expected, rtol=1e-5, atol=1e-6)
