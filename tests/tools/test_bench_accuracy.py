"""The accuracy table: its generator and bound against other ways to compute them, and one small run."""

import numpy as np
import pytest

from tools.accuracy.bound import cramer_rao
from tools.accuracy.dive import NAMES, TABLE_1, Case, fly, simulate
from tools.accuracy.methods import maximum_likelihood
from tools.accuracy.score import free_run_fit, score
from tools.cli import main


def test_the_exact_dive_is_what_fine_euler_steps_approach():
    case = Case(duration=20.0, coupling=0.4)
    dive = fly(case, 1)
    a1, a2, a3, b1, b2, u0 = TABLE_1
    states = simulate(case, np.array(TABLE_1), dive.rudder, dive.start, np.array([[0.01], [0.02]]))
    w, q, theta, zeta = dive.start
    fine = 2000
    h = case.step / fine
    for k in range(50):
        np.testing.assert_allclose(states[:, k], [w, q, theta, zeta], atol=2e-4)
        for _ in range(fine):
            w, q, theta, zeta = (
                w + h * (a1 * w + 0.4 * q + b1 * dive.rudder[k] + 0.01),
                q + h * (a2 * q + a3 * theta + b2 * dive.rudder[k] + 0.02),
                theta + h * q,
                zeta + h * (w - u0 * theta),
            )


def test_the_bound_is_the_deviation_that_maximum_likelihood_states():
    dive = fly(Case(duration=120.0), 3)
    _, std = maximum_likelihood(dive)
    np.testing.assert_allclose(std / cramer_rao(dive), 1.0, atol=0.15)


def test_bursts_and_single_losses_make_up_the_share():
    for burst in (0.0, 2.0):
        dive = fly(Case(duration=2000.0, missing=0.4, burst=burst), 0)
        assert np.isnan(dive.pitch).mean() == pytest.approx(0.4, abs=0.05)


def test_scores_of_known_errors():
    rng = np.random.default_rng(0)
    truth = np.array(TABLE_1)
    bounds = np.full((4000, 6), 0.01)
    values = truth + 0.02 * rng.normal(size=(4000, 6)) + [0.0, 0.02, 0.0, 0.0, 0.0, 0.0]
    values[0, 0] = np.nan
    got = score(values[1:], np.full((3999, 6), 0.02), bounds[1:], truth)
    np.testing.assert_allclose(got.efficiency, 2.0, rtol=0.05)
    np.testing.assert_allclose(got.honesty, 1.0, rtol=0.05)
    assert got.coverage[0] == pytest.approx(95.0, abs=1.5)
    assert got.coverage[1] < 90.0
    assert got.bias[1] == pytest.approx(2.0 / 3.387, rel=0.1)
    assert got.diverged == 0
    assert score(values, bounds, bounds, truth).diverged == 1


def test_the_truth_runs_freely_without_error():
    dive = fly(Case(duration=60.0), 0)
    np.testing.assert_allclose(free_run_fit(dive, np.array(TABLE_1)), 100.0)
    worse = np.array(TABLE_1) * [1.0, 1.3, 1.0, 1.0, 1.0, 1.0]
    assert (free_run_fit(dive, worse) < 99.0).all()


def test_a_drifting_vehicle_ends_where_it_should():
    case = Case(duration=30.0, drift=(2.0, 1.0, 1.0, 1.0, 1.0))
    assert case.truth[0] == pytest.approx(2.0 * TABLE_1[0])
    assert np.isnan(cramer_rao(fly(case, 0))).all()


@pytest.mark.long
def test_the_table_is_printed(capsys):
    assert main(["bench-accuracy", "--quick", "--quiet", "--workers", "2"]) == 0
    said = capsys.readouterr().out
    assert all(name in said for name in NAMES)
    assert said.count("diverged 0 of 12") == 3  # live p = 1 and 5, bench
    assert said.count("diverged 12 of 12") == 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--seeds", "1"], "--seeds must be at least 2"),
        (["--workers", "0"], "--workers 1"),
        (["--only", "nothing like it"], "--only must be part"),
    ],
)
def test_bad_usage_ends_with_2(arguments, message, capsys):
    assert main(["bench-accuracy", *arguments]) == 2
    assert message in capsys.readouterr().err
