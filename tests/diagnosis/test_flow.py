"""Damping that does not fall with the speed, and a plane in the whole flow: weak, and hardly told alone."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.catalogue import structure_of
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search.search import Search
from host.diagnosis.search.whole_vehicle import whole
from host.dynamics.propagate import free_run, inputs_of
from host.recordings.recording import Array, Recording

BOTH = frozenset({"plane_in_cross_flow", "speed_independent_damping"})
COUPLING = 2.0  # m/s: the hull heaves a third of its speed


def speed_at(time: float | Array) -> Array:
    """m/s, of a vehicle that slows down and hurries on."""
    return np.asarray(BASE["u0"] * (1.0 + 0.2 * np.sin(0.5 * np.asarray(time))))


def recording() -> Recording:
    """Damping in pitch is the same at any speed, in heave it grows with it; the plane meets u and w."""

    def steady(time: float, x: Array, plane: float) -> tuple[float, float, float]:
        w, q, theta, _ = x
        u0, u = BASE["u0"], float(speed_at(time))
        more = (u**2 + w**2) / u0**2 - 1.0
        force = BASE["a1"] * (u / u0 - 1.0) * w + BASE["b1"] * more * plane + COUPLING * u / u0 * q
        return force, BASE["b2"] * more * plane, -(u - u0) * theta

    dive = hidden_dive(steady, duration=120.0)
    return replace(dive, speed=speed_at(dive.time))


def value(explanation: Explanation, name: str) -> float:
    return float(explanation.fit.parameters[explanation.fit.structure.names.index(name)])


def test_they_are_found_once_the_rest_of_the_vehicle_is_there() -> None:
    fitter = Fitter([recording()])
    search = Search(fitter, Workers(fitter, 1), lambda _: None, fitter.base, fitter.root)
    best = fitter.base
    for name in ("heave_pitch_rate_coupling", "speed_loss"):
        best = search.remember(fitter.grown(best, name, []))
    found = whole(search, search.remember(fitter.polished(best)))
    assert found.names == best.names | BOTH
    assert found.leaves_white
    assert value(found, "pitch_damping_steady") == pytest.approx(1.0, abs=0.15)
    assert value(found, "heave_damping_steady") == pytest.approx(0.0, abs=0.3)
    assert value(found, "cross_flow_share") == pytest.approx(1.0, abs=0.15)


def test_damping_that_stays_needs_a_speed_that_changes() -> None:
    dive = replace(hidden_dive(duration=30.0), speed=np.full(300, BASE["u0"]))
    values = np.array([*BASE.values(), 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0])
    structure = structure_of(("speed_loss", "speed_independent_damping"))
    start = np.array([0.1, 0.0, 0.05, 20.0, 0.0])
    run = free_run(values, start, inputs_of(dive, structure)).outputs
    plain = free_run(values[:8], start, inputs_of(dive)).outputs
    np.testing.assert_allclose(run, plain, atol=1e-9)


ARM = 1.0  # m, from the middle of the hull to its fins


def stalling(_: float, x: Array, plane: float) -> tuple[float, float, float]:
    """Fins whose lift bends as a tanh does: no shape that the catalogue has."""
    angle = plane + (x[0] + ARM * x[1]) / BASE["u0"]
    lost = angle - 0.25 * float(np.tanh(angle / 0.25))
    return 0.8 * BASE["u0"] * x[1] - BASE["b1"] * lost, -BASE["b2"] * lost, 0.0


def test_fins_stall_by_the_flow_not_by_their_own_angle() -> None:
    fitter = Fitter([hidden_dive(stalling, duration=120.0)])
    hull = fitter.grown(fitter.root, "heave_pitch_rate_coupling", [])
    by_flow, by_angle = (
        fitter.polished(fitter.grown(hull, f"{name}_stall", [])) for name in ("fin", "rudder")
    )
    assert fitter.excess(hull.fit) > 2.0
    assert fitter.excess(by_flow.fit) < 1.3
    assert by_flow.bic < by_angle.bic - 1000.0
    assert value(by_flow, "fin_arm") == pytest.approx(ARM, rel=0.15)


def test_a_plane_that_turns_the_hull_the_other_way_stalls_alike() -> None:
    dive = hidden_dive(duration=20.0)
    structure = structure_of(("fin_stall",))
    values = np.array([*BASE.values(), 0.0, 0.0, 0.3, 0.8, ARM])
    start = np.array([0.3, 0.1, 0.05, 20.0, 0.0])
    run = free_run(values, start, inputs_of(dive, structure)).outputs
    values[[structure.names.index("b1"), structure.names.index("b2")]] *= -1.0
    other = free_run(values, start, inputs_of(replace(dive, rudder=-dive.rudder), structure)).outputs
    np.testing.assert_allclose(run, other, atol=1e-9)
    assert np.ptp(run[1]) > 0.5
