"""CAR coefficients <-> equations of motion, with the errata of Yuan et al. (2025) as tests."""

import math
from dataclasses import astuple

import numpy as np
import pytest
from car_data import ALPHA, BETA, SPEED, STEP, TABLE_1, car_signals, depth_rows, pitch_rows, random_rudder
from hypothesis import given
from hypothesis import strategies as st

from firmware_model import car_from_physical, physical_from_car, physical_std_from_car, pitch_from_car


def test_euler_steps_of_the_equations_of_motion_obey_the_car_model():
    rng = np.random.default_rng(0)
    rudder = rng.uniform(-0.3, 0.3, 80)
    w, q, theta, zeta = 0.1, -0.2, 0.05, 3.0
    pitch, depth = [], []
    for delta in rudder:
        pitch.append(theta)
        depth.append(zeta)
        w, q, theta, zeta = (
            w + STEP * (TABLE_1["a1"] * w + TABLE_1["b1"] * delta),
            q + STEP * (TABLE_1["a2"] * q + TABLE_1["a3"] * theta + TABLE_1["b2"] * delta),
            theta + STEP * q,
            zeta + STEP * (w - SPEED * theta),
        )
    for cut, signal, truth in ((pitch_rows, pitch, ALPHA), (depth_rows, depth, BETA)):
        rows, outputs = cut(np.array(signal), rudder)
        np.testing.assert_allclose(rows @ truth, outputs, atol=1e-13)


def test_alpha2_of_table_1_is_not_the_printed_one():
    assert ALPHA[1] == pytest.approx(0.7433, abs=5e-5)
    wrong_sign = 1 + STEP * TABLE_1["a2"] + STEP**2 * TABLE_1["a3"]
    assert wrong_sign == pytest.approx(0.5793, abs=5e-5)
    # The constant 9.318 % by which the paper's estimates miss its "real value" is this slip alone.
    slip = (ALPHA[1] - wrong_sign) / math.hypot(ALPHA[0], wrong_sign, ALPHA[2])
    assert slip == pytest.approx(0.09319, abs=2e-5)


def test_beta_of_table_1_is_not_the_printed_one():
    assert BETA[1] == pytest.approx(4.8980, abs=5e-5)
    assert BETA[2] == pytest.approx(-2.9962, abs=5e-5)
    assert BETA[3] == pytest.approx(0.6964, abs=5e-5)
    assert BETA[6] == pytest.approx(-0.0062, abs=5e-5)


def test_depth_polynomial_vanishes_at_one():
    assert 1 + sum(BETA[:4]) == pytest.approx(0.0, abs=1e-12)
    printed = [1.0, -3.5982, 4.7340, -2.9030, 0.5324]
    assert sum(printed) == pytest.approx(-0.235, abs=5e-4)


def test_beta2_holds_the_product_of_both_dampings():
    # beta2 = e2 - (1 + h a1) e1 contains h^2 (a1 a2 - a3), not the h^2 (a1 a3 - a3) of the paper's Eq. 9.
    a1, a2, a3, h = TABLE_1["a1"], TABLE_1["a2"], TABLE_1["a3"], STEP
    assert BETA[1] == pytest.approx(6 + 3 * h * (a1 + a2) + h * h * (a1 * a2 - a3), rel=1e-12)


coefficients = st.tuples(
    st.floats(-5, 1), st.floats(-8, 1), st.floats(-20, 5), st.floats(-2, 2), st.floats(-10, 10)
)


@given(coefficients, st.floats(0.1, 5), st.floats(0.02, 1.0))
def test_conversion_there_and_back(physical, u0, h):
    alpha, beta = car_from_physical(*physical, u0=u0, h=h)
    weights = np.diag([1.0, 2.0, 3.0, 4.0, 0.1, 0.2, 0.3]).tolist()
    for covariance in (None, weights):
        back = physical_from_car(alpha, beta, u0, h, covariance)
        np.testing.assert_allclose(astuple(back), physical, atol=1e-8)
    np.testing.assert_allclose(pitch_from_car(alpha, h), [physical[i] for i in (1, 2, 4)], atol=1e-9)


def test_covariance_that_is_not_positive_definite_means_no_weights():
    beta = np.array(BETA) + 1e-4
    plain = physical_from_car(ALPHA, beta, SPEED, STEP)
    assert physical_from_car(ALPHA, beta, SPEED, STEP, np.zeros((7, 7)).tolist()) == plain
    assert physical_from_car(ALPHA, beta, SPEED, STEP, np.full((7, 7), math.nan).tolist()) == plain


def test_nan_goes_through_as_nan():
    assert math.isnan(physical_from_car(ALPHA, (math.nan, *BETA[1:]), SPEED, STEP).a1)
    converted = physical_from_car((math.nan, *ALPHA[1:]), BETA, SPEED, STEP)
    assert all(math.isnan(value) for value in (converted.a1, converted.a2, converted.b1))
    assert converted.b2 == pytest.approx(TABLE_1["b2"])


@pytest.mark.parametrize("h", [0.0, -0.1, math.nan, math.inf])
def test_step_must_be_positive(h):
    with pytest.raises(ValueError, match="h must be positive and finite"):
        car_from_physical(**TABLE_1, u0=SPEED, h=h)
    with pytest.raises(ValueError, match="h must be positive and finite"):
        physical_from_car(ALPHA, BETA, SPEED, h)


def fits(count=60, noise=1e-3):
    """Least squares on CAR data with equation noise: physical values, their deltas, and unweighted values."""
    for seed in range(count):
        rng = np.random.default_rng(seed)
        rudder = random_rudder(rng, 1500)
        pitch, depth = car_signals(rudder, rng, noise, noise)
        solved = []
        for rows, outputs in (pitch_rows(pitch, rudder), depth_rows(depth, rudder)):
            information = rows.T @ rows
            solved.append(np.linalg.solve(information, rows.T @ outputs).tolist())
            solved.append((noise**2 * np.linalg.inv(information)).tolist())
        alpha, alpha_covariance, beta, beta_covariance = solved
        yield (
            astuple(physical_from_car(alpha, beta, SPEED, STEP, beta_covariance)),
            astuple(physical_std_from_car(alpha, beta, SPEED, STEP, alpha_covariance, beta_covariance)),
            astuple(physical_from_car(alpha, beta, SPEED, STEP)),
        )


def test_std_is_the_scatter_and_weights_pay():
    values, stds, unweighted = (np.array(block) for block in zip(*fits(), strict=True))
    truth = np.array([TABLE_1[name] for name in ("a1", "a2", "a3", "b1", "b2")])
    scores = (values - truth) / stds
    rms = np.sqrt(np.mean(scores**2, axis=0))
    assert ((rms > 0.75) & (rms < 1.3)).all(), rms
    error, plain = (np.sqrt(np.mean((x[:, 0] - truth[0]) ** 2)) for x in (values, unweighted))
    assert error < 0.75 * plain
