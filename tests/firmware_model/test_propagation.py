"""The Taylor series against the matrix exponential, its sensitivities against differences."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from firmware_model.propagation import (
    A1,
    A2,
    A3,
    B1,
    B2,
    COUNT,
    GAMMA,
    HEAVE_TRIM,
    KAPPA,
    PATTERN,
    PITCH_TRIM,
    Propagation,
    W,
)

states = st.lists(st.floats(-1.0, 1.0), min_size=COUNT, max_size=COUNT)


def state(unit):
    """Entries in (-1, 1) to an extended state of a stable vehicle."""
    x = list(unit)
    x[A1], x[A2], x[A3] = -2.0 - x[A1], -4.0 - 3.0 * x[A2], -30.0 - 29.0 * x[A3]
    x[KAPPA], x[B2] = 2.0 * x[KAPPA], 20.0 * x[B2]
    return x


def exact(x, rudder, speed, h, heave_push=0.0, pitch_push=0.0):
    block = np.zeros((5, 5))
    block[0] = x[A1], -x[KAPPA], x[GAMMA], 0.0, x[B1] * rudder + x[HEAVE_TRIM] + heave_push
    block[1] = 0.0, x[A2], x[A3], 0.0, x[B2] * rudder + x[PITCH_TRIM] + pitch_push
    block[2, 1] = 1.0
    block[3, [0, 2]] = 1.0, -speed
    return (expm(h * block) @ [*x[W:], 1.0])[:4]


@given(states, st.floats(-0.4, 0.4), st.floats(0.1, 5.0), st.floats(-0.1, 0.1))
def test_the_state_moves_as_by_the_matrix_exponential(unit, rudder, speed, push):
    x = state(unit)
    expected = exact(x, rudder, speed, 0.1, push, -push)
    Propagation(0.1).advance(x, rudder, speed, push, -push)
    np.testing.assert_allclose(x[W:], expected, atol=1e-5)


@given(states, st.floats(-0.4, 0.4), st.floats(0.1, 5.0))
def test_the_sensitivities_are_the_derivatives(unit, rudder, speed):
    x = state(unit)
    propagation = Propagation(0.1)
    propagation.advance(list(x), rudder, speed, 0.0, 0.0)
    for j in range(COUNT):
        ends = []
        for sign in (1.0, -1.0):
            moved = list(x)
            moved[j] += sign * 1e-5
            Propagation(0.1).advance(moved, rudder, speed, 0.0, 0.0)
            ends.append(np.array(moved[W:]))
        slope = (ends[0] - ends[1]) / 2e-5
        np.testing.assert_allclose([row[j] for row in propagation.F], slope, atol=1e-7)
    for row, columns in zip(propagation.F, PATTERN, strict=True):
        assert all(row[j] == 0.0 for j in range(COUNT) if j not in columns)


def test_an_error_of_speed_is_kappa_and_gamma():
    # w of the true vehicle at u0 = 2.5 against w - kappa theta at u = 2: the same depth.
    true = [-0.63, -3.39, -8.2, 0.41, -3.94, 0.0, 0.0, 0.01, 0.02, 0.1, -0.2, 0.3, 5.0]
    told = list(true)
    told[KAPPA], told[GAMMA] = 0.5, -0.63 * 0.5
    told[W] = 0.1 - 0.5 * 0.3
    propagation = Propagation(0.1)
    for _ in range(50):
        propagation.advance(true, 0.2, 2.5, 0.0, 0.0)
        propagation.advance(told, 0.2, 2.0, 0.0, 0.0)
    assert told[-1] == pytest.approx(true[-1], abs=1e-9)
    assert told[W] == pytest.approx(true[W] - 0.5 * true[-2], abs=1e-9)
