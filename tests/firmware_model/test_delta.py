"""The depth row in delta coordinates says the same as the paper's row."""

import numpy as np
import pytest
from car_data import BETA, STEP, car_signals, depth_rows, random_rudder
from hypothesis import given
from hypothesis import strategies as st

from firmware_model import Mils
from firmware_model.delta import DeltaCoordinates

numbers = st.lists(st.floats(-10, 10), min_size=7, max_size=7)


@given(numbers, numbers, st.floats(-100, 100))
def test_both_rows_predict_the_same(phi, theta, reference):
    delta = DeltaCoordinates(STEP)
    delta.reference = reference
    delta.transform(phi)
    in_delta = -phi[0] + np.dot(delta.row, theta)  # the depth before, and the change
    in_paper = np.dot(phi, delta.beta(theta)) - theta[0] * reference
    scale = 1 + np.abs(np.array(delta.row) * theta).sum()
    assert in_delta == pytest.approx(in_paper, abs=1e-10 * scale + 1e-8)


def test_covariance_moves_with_the_coefficients():
    delta = DeltaCoordinates(STEP)
    rng = np.random.default_rng(0)
    samples = rng.normal(size=(500, 7))
    moved = np.array([delta.beta(theta) for theta in samples])
    np.testing.assert_allclose(delta.beta_covariance(np.cov(samples.T)), np.cov(moved.T), rtol=1e-6)


def test_condition_number_falls_by_five_decades():
    rudder = random_rudder(np.random.default_rng(0), 3000)
    rows, _ = depth_rows(car_signals(rudder)[1], rudder)
    delta = DeltaCoordinates(STEP)
    delta.reference = 0.0
    moved = []
    for phi in rows:
        delta.transform(phi.tolist())
        moved.append(list(delta.row))
    before, after = (np.linalg.cond(x.T @ x) for x in (rows, np.array(moved)))
    assert before > 1e10
    assert after < 1e-5 * before


def test_prior_spoils_the_heave_pole_in_the_papers_coordinates_only():
    rudder = random_rudder(np.random.default_rng(1), 3000)
    rows, outputs = depth_rows(car_signals(rudder)[1], rudder)
    paper, moved, delta = Mils(7, 5), Mils(7, 5), DeltaCoordinates(STEP)
    delta.reference = 0.0
    for phi, y in zip(rows.tolist(), outputs.tolist(), strict=True):
        paper.update(phi, y)
        delta.transform(phi)
        moved.update(delta.row, y + phi[0])
    assert np.abs(np.array(delta.beta(moved.theta)) - BETA).max() < 1e-3
    assert np.abs(np.array(paper.theta) - BETA).max() > 0.1
