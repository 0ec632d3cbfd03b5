"""What is likely of the speed a run begins with: its slopes, and what a slow beginning costs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from host.dynamics.propagate import begun_at
from host.likelihood.start_prior import EXCESS, PRICE, SCALE, start_cost, start_normal
from host.recordings.recording import Array

EXCESSES = st.floats(-1.0, 1.0)


def begun(excess: float) -> Array:
    x0 = begun_at(0.1, 20.0)
    x0[EXCESS] = excess
    return x0


@given(EXCESSES)
def test_the_score_is_the_slope_of_the_cost(excess: float) -> None:
    h = 1e-6
    slope = (start_cost([begun(excess + h)]) - start_cost([begun(excess - h)])) / (2.0 * h)
    assert start_normal(begun(excess))[1][EXCESS] == pytest.approx(-slope, abs=1e-5)


@given(EXCESSES, EXCESSES)
def test_the_step_promises_no_more_than_it_gives(here: float, there: float) -> None:
    information, score = start_normal(begun(here))
    move = there - here
    parabola = start_cost([begun(here)]) - score[EXCESS] * move + 0.5 * information[EXCESS, EXCESS] * move**2
    assert start_cost([begun(there)]) <= parabola + 1e-9


def test_steady_flight_is_free_and_a_launch_costs_its_price_once_a_recording() -> None:
    assert start_cost([begun(0.0)] * 3) == 0.0
    assert start_cost([begun(SCALE)]) == pytest.approx(PRICE / 2.0)
    assert start_cost([begun(0.0), begun(-0.8)]) == pytest.approx(PRICE, rel=0.01)


def test_nothing_else_of_a_start_is_held() -> None:
    information, score = start_normal(begun(-0.3))
    assert np.count_nonzero(information) == np.count_nonzero(score) == 1
