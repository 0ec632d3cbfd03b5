"""What the laws of motion forbid is never named, and a weight acts along the vertical."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.catalogue import BY_NAME, structure_of
from host.diagnosis.fits.fitter import Fitter
from host.dynamics.propagate import free_run, inputs_of
from host.recordings.recording import Array

DISSIPATING = {"heave_quadratic_drag": "c_ww", "pitch_quadratic_damping": "c_qq"}
SLOWING = {"c_ud", "c_uq"}
GEOMETRY = {"large_angle_restoring", "large_angle_kinematics"}


@pytest.mark.parametrize(("name", "coefficient"), sorted(DISSIPATING.items()))
def test_drag_and_damping_take_energy_out(name: str, coefficient: str) -> None:
    (parameter,) = BY_NAME[name].parameters
    assert (parameter.name, parameter.upper) == (coefficient, 0)


def test_manoeuvres_slow_the_vehicle_and_geometry_acts_at_most_twice() -> None:
    assert {p.name for p in BY_NAME["speed_loss"].parameters if p.lower == 0} == SLOWING
    for name in GEOMETRY:
        (parameter,) = BY_NAME[name].parameters
        assert (parameter.lower, parameter.upper) == (0, 2)


def test_a_coupling_beyond_what_masses_allow_must_be_earned() -> None:
    fitter, names = Fitter([hidden_dive(duration=40.0)]), frozenset({"heave_pitch_rate_coupling"})
    fit = fitter.grown(fitter.base, "heave_pitch_rate_coupling", []).fit
    speed = fit.parameters[fit.structure.names.index("u0")]

    def charged(share: float) -> float:
        values = fit.parameters.copy()
        values[fit.structure.names.index("c_wq")] = share * speed
        return fitter.bic(replace(fit, parameters=values), names)

    assert charged(0.4) == pytest.approx(charged(0.75))
    assert charged(-0.4) == pytest.approx(charged(0.4) + 4.0)
    assert charged(1.4) == pytest.approx(charged(0.4) + 9.0)


def test_a_force_that_drives_is_not_taken_for_drag() -> None:
    def driven(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        return 0.8 * x[0] * abs(x[0]), 0.0, 0.0

    fitter = Fitter([hidden_dive(driven)])
    found = fitter.grown(fitter.base, "heave_quadratic_drag", [])
    assert found.fit.parameters[-1] <= 0.0
    assert found.bic > fitter.base.bic - 1.0


def test_a_weight_pushes_less_across_a_hull_that_stands_on_its_nose() -> None:
    structure = structure_of(("net_buoyancy",))
    level = hidden_dive(duration=1.0)
    still = replace(level, rudder=np.zeros(level.time.size))
    # Held at its pitch, and without damping: all that moves it is the weight.
    values = np.array([*{**BASE, "a1": -1e-9, "a2": -1e-9, "a3": -1e-9, "u0": 1e-6}.values(), 0.0, 0.0, 0.05])
    for pitch in (0.0, 1.0):
        start = np.array([0.0, 0.0, pitch, 20.0, 0.0])
        depth = free_run(values, start, inputs_of(still, structure)).outputs[1]
        expected = 20.0 + 0.5 * 0.05 * np.cos(pitch) * still.time**2
        np.testing.assert_allclose(depth, expected, atol=1e-5)
