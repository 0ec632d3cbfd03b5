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
