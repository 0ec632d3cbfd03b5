"""Refits, and the coefficients that an answer claims."""

from dataclasses import replace

import numpy as np
import pytest

from host.catalogue import BY_NAME
from tools.trial.coefficients import true_coefficients
from tools.trial.hidden import KINDS, STRANGERS, Setting, draw_hidden
from tools.trial.linear import MORE, free_run
from tools.trial.outing import draw_outing, with_amplitude
from tools.trial.refit import foretold, remaining
from tools.trial.vehicle import draw_vehicle
from tools.trial.voyage import sail


def test_remaining_is_what_least_squares_leaves() -> None:
    rng = np.random.default_rng(1)
    rows, wanted = rng.normal(size=(40, 3)), rng.normal(size=40)
    least = float(np.linalg.lstsq(rows, wanted, rcond=None)[1][0])
    found = remaining(lambda sets: sets @ rows.T - wanted, np.zeros(3), np.full(3, 1e-3))
    assert found == pytest.approx(least, rel=1e-6)


@pytest.mark.parametrize("is_dear", [False, True])
def test_remaining_of_a_bent_model_with_and_without_learnt_slopes(is_dear: bool) -> None:
    t = np.linspace(0.0, 3.0, 60)
    truth = np.exp(-1.3 * t) + 0.5 * np.sin(t)

    def model(sets: np.ndarray) -> np.ndarray:
        return sets[:, :1] * np.exp(-sets[:, 1:] * t) - truth

    found = remaining(model, np.array([1.0, 1.0]), np.full(2, 1e-4), is_dear=is_dear)
    grid = np.array([[a, b] for a in np.linspace(0.8, 1.4, 121) for b in np.linspace(0.0, 0.6, 121)])
    assert found == pytest.approx(float(np.sum(model(grid) ** 2, axis=1).min()), rel=0.02)


def test_remaining_of_a_run_that_fails_is_endless() -> None:
    assert remaining(lambda sets: np.full((len(sets), 4), np.inf), np.zeros(2), np.ones(2)) == np.inf


def test_beside_runs_that_fail_it_stays_where_it_is() -> None:
    def model(sets: np.ndarray) -> np.ndarray:
        return np.where(sets > 1.0, np.inf, 3.0) * np.ones(4)

    assert remaining(model, np.array([1.0]), np.array([1e-3])) == 36.0


@pytest.mark.parametrize(
    ("name", "coefficient"),
    [
        ("heave_pitch_rate_coupling", "c_wq"),
        ("munk_moment", "c_qw"),
        ("net_buoyancy", "w0"),
        ("trim_moment", "q0"),
        ("vertical_current", "current"),
    ],
)
def test_claimed_coefficients_give_the_plants_own_run(name: str, coefficient: str) -> None:
    rng = np.random.default_rng(3)
    vehicle = draw_vehicle(rng)
    outing = with_amplitude(draw_outing(rng, vehicle, near_surface=False), 0.02)
    scenario = replace(outing.scenario, duration_s=30.0)
    setting = Setting(vehicle=vehicle, command=0.1, pitch=0.1, duration_s=30.0, step_s=scenario.step_s)
    effect = replace(draw_hidden(rng, name, setting), strength=0.02)
    truth = sail(scenario, 1, (effect,), setting)
    (value,) = true_coefficients(effect, setting, (0.0, 1.0)).values()
    start = scenario.start
    known = [*vehicle.coefficients.values(), start.heave, start.pitch_rate, start.pitch, start.depth]
    more = [value if name == coefficient else 0.0 for name in MORE]
    _, depth = free_run(np.array([[*known, *more]]), truth.command, 1 / outing.rate_hz, None)
    _, without = free_run(np.array([[*known, *np.zeros(5)]]), truth.command, 1 / outing.rate_hz, None)
    change = np.abs(truth.depth - without[0]).max()
    assert np.abs(depth[0] - truth.depth).max() < 0.02 * change  # buoyancy acts along cos(pitch)


@pytest.mark.parametrize("name", [*KINDS, *STRANGERS])
def test_claimed_coefficients_have_names_of_the_catalogue(name: str) -> None:
    rng = np.random.default_rng(3)
    setting = Setting(vehicle=draw_vehicle(rng), command=0.1, pitch=0.1, duration_s=60.0, step_s=0.02)
    claimed = true_coefficients(draw_hidden(rng, name, setting), setting, (0.6, 0.8))
    if name in STRANGERS:
        assert not claimed
    else:
        assert set(claimed) <= {parameter.name for parameter in BY_NAME[name].parameters}
        assert claimed or name in ("speed_loss", "surface_waves")


def test_the_lift_that_a_stalled_plane_keeps_is_claimed_where_it_is_reached() -> None:
    rng = np.random.default_rng(3)
    setting = Setting(vehicle=draw_vehicle(rng), command=0.3, pitch=0.1, duration_s=60.0, step_s=0.02)
    stall = draw_hidden(rng, "rudder_stall", setting)
    deep, slight = (true_coefficients(replace(stall, strength=s), setting, (0.0, 1.0)) for s in (0.99, 0.5))
    assert deep["stall_loss"] == slight["stall_loss"] == 1.5
    assert deep["stall_share"] == 0.5
    assert "stall_share" not in slight


def test_what_is_foretold_of_a_linear_model_is_what_remains() -> None:
    rng = np.random.default_rng(3)
    slopes, offset = rng.standard_normal((4, 40)), rng.standard_normal(40)

    def model(sets: np.ndarray) -> np.ndarray:
        return offset + sets @ slopes

    start, steps = np.zeros(4), np.full(4, 1e-4)
    assert foretold(model, start, steps) == pytest.approx(remaining(model, start, steps), rel=1e-6)
    assert foretold(model, start, steps, least=1e6) == pytest.approx(float(offset @ offset))


def test_coefficients_that_do_the_same_or_nothing_are_no_trouble() -> None:
    def model(sets: np.ndarray) -> np.ndarray:
        a, b, _ = sets.T
        return np.stack([1.0 + a + b, 2.0 + a + b, 0.0 * a + 5.0], axis=1)

    left = foretold(model, np.zeros(3), np.full(3, 1e-4))
    assert left == pytest.approx(25.5, rel=1e-4)


def test_nothing_is_foretold_beside_a_run_that_fails() -> None:
    assert foretold(lambda sets: np.full((len(sets), 4), np.inf), np.zeros(2), np.ones(2)) == np.inf
