"""One Gauss-Newton step: what it predicts, and how it keeps within the bounds of the parameters."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from host.catalogue import structure_of
from host.likelihood.gauss_newton import GaussNewton, Point, whiten

STRUCTURE = structure_of(("heave_quadratic_drag", "large_angle_kinematics"))
NAMES = list(STRUCTURE.names)
FREE = np.array([name in ("u0", "c_ww", "kinematics_share") for name in NAMES])
DRAG, SHARE = NAMES.index("c_ww"), NAMES.index("kinematics_share")


def linear_problem(seed: int, drag: float, share: float) -> tuple[GaussNewton, np.ndarray, np.ndarray]:  # type: ignore[type-arg]
    """Normal equations of white innovations e = S d, with their sensitivities to the free parameters."""
    rng = np.random.default_rng(seed)
    scores = np.zeros((2, len(NAMES) + 5, 200))
    scores[:, : len(NAMES)][:, FREE] = rng.standard_normal((2, 3, 200)) + 0.5 * rng.standard_normal(
        (2, 1, 200)
    )
    wanted = rng.standard_normal(3) * np.array([0.3, 1.0, 1.0])
    S = scores[:, : len(NAMES)][:, FREE].transpose(1, 0, 2).reshape(3, -1)
    error = (S.T @ wanted).reshape(2, 200) + 0.01 * rng.standard_normal((2, 200))
    values = np.zeros(len(NAMES))
    values[NAMES.index("a1")], values[NAMES.index("a2")] = -1.0, -1.0
    values[NAMES.index("u0")], values[DRAG], values[SHARE] = 2.0, drag, share
    point = Point(STRUCTURE, values, [np.zeros(5)], np.array([1.0, 1.0, 0.0, 0.0]))
    return GaussNewton([(error, scores)], point, FREE), S.T, error.ravel()


@given(st.integers(0, 10_000), st.floats(-2.0, 0.0), st.floats(0.0, 2.0))
def test_a_step_is_the_best_within_its_bounds(seed: int, drag: float, share: float) -> None:
    problem, S, error = linear_problem(seed, drag, share)
    bounds = [p for p, is_free in zip(STRUCTURE.parameters, FREE, strict=True) if is_free]
    here = problem.point.parameters[FREE]
    lower, upper = np.array([p.lower for p in bounds]), np.array([p.upper for p in bounds])
    best = lsq_linear(S, error, bounds=(lower - here - 1e-12, upper - here + 1e-12)).x
    there = problem.trial(0.0).parameters[FREE]
    assert (there >= lower).all()
    assert (there <= upper).all()
    moved = there - here
    least, reached = (float(np.sum((error - S @ step) ** 2)) for step in (best, moved))
    # What has once met its bound stays there for this step; on these problems that costs hardly anything.
    assert reached <= 1.15 * least + 1.0
    cost = float(error @ error)
    assert cost - 2.0 * problem.promise() == pytest.approx(reached, rel=1e-6)
    assert problem.predicted_cost(cost) <= reached * (1.0 + 1e-6)


def test_the_others_make_up_for_what_stops_at_its_bound() -> None:
    """Clipping the whole step afterwards would leave them where they suit a drag that drives the vehicle."""
    for seed in range(200):
        problem, S, error = linear_problem(seed, drag=0.0, share=1.0)
        whole = np.linalg.lstsq(S, error, rcond=None)[0]
        if whole[1] > 0.5:
            break
    moved = problem.trial(0.0).parameters[FREE] - problem.point.parameters[FREE]
    clipped = np.array([whole[0], 0.0, np.clip(whole[2], -1.0, 1.0)])
    assert moved[1] == 0.0
    assert np.sum((error - S @ moved) ** 2) < np.sum((error - S @ clipped) ** 2)


@pytest.mark.parametrize(("slopes", "errors"), [(np.inf, 0.0), (0.0, np.inf), (0.0, np.nan)])
def test_where_the_numbers_are_left_nothing_is_promised_and_no_step_taken(
    slopes: float, errors: float
) -> None:
    step, S, _ = linear_problem(3, drag=-1.0, share=1.0)
    size = S.shape[1] + 5
    lost = step.with_normal([(slopes + np.eye(size), np.full(size, errors))])
    assert lost.promise() == 0.0
    assert lost.predicted_cost(7.0) == 7.0
    assert lost.trial(1.0) is lost.point


def test_what_stops_early_on_a_ridge_hides_no_gain() -> None:
    """Two sensitivities that hardly differ: the full step goes far, until both are at their bounds."""
    rng = np.random.default_rng(5)
    values = np.zeros(len(NAMES))
    values[NAMES.index("a1")], values[NAMES.index("a2")] = -1.0, -1.0
    values[NAMES.index("u0")], values[DRAG], values[SHARE] = 2.0, -1.0, 1.0
    scores = np.zeros((2, len(NAMES) + 5, 200))
    common = rng.standard_normal((2, 200))
    scores[:, NAMES.index("u0")] = common
    scores[:, DRAG] = common + 1e-4 * rng.standard_normal((2, 200))
    scores[:, SHARE] = rng.standard_normal((2, 200))
    error = 0.8 * scores[:, SHARE] + 0.1 * rng.standard_normal((2, 200))
    error += 3e3 * (scores[:, DRAG] - scores[:, NAMES.index("u0")]) + 0.5 * common
    point = Point(STRUCTURE, values, [np.zeros(5)], np.array([1.0, 1.0, 0.0, 0.0]))
    step, cost = GaussNewton([(error, scores)], point, FREE), float(np.sum(error**2))
    assert step.promise() < 0.0
    assert step.predicted_cost(cost) < 0.8 * cost


def test_sensitivities_that_ran_away_are_infinite_without_a_word() -> None:
    variance = np.array([[1e-6], [1e-9], [1e-6]])
    white, scores = whiten(np.full((2, 1), 1e-3), np.full((2, 1, 1), 1e307), variance)
    assert np.isfinite(white).all()
    assert not np.isfinite(scores).any()


def test_what_a_run_begins_with_may_do_the_same_in_two_ways_and_much() -> None:
    rng = np.random.default_rng(1)
    scores = rng.standard_normal((2, len(NAMES) + 5, 200))
    growing = np.full((2, 200), 2.0**40)  # of a hull that leaves the recording: rounding hides what differs
    scores[:, -5] = scores[:, -4] = growing
    values = np.zeros(len(NAMES))
    values[NAMES.index("a1")], values[NAMES.index("a2")], values[NAMES.index("u0")] = -1.0, -1.0, 2.0
    point = Point(STRUCTURE, values, [np.zeros(5)], np.array([1.0, 1.0, 0.0, 0.0]))
    step = GaussNewton([(rng.standard_normal((2, 200)), scores)], point, FREE)
    assert np.isfinite(step.trial(1e-3).parameters).all()
    assert np.isfinite(step.promise())
