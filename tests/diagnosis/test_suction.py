"""The surface pulls at a hull that runs below it, and is asked about of such a hull alone."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive
from scipy.integrate import solve_ivp

from host.catalogue import CATALOGUE, NEAR_THE_SURFACE, structure_of
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import MUCH
from host.diagnosis.fits.setting import SHALLOW
from host.diagnosis.fits.workers import Workers
from host.diagnosis.recordings.spans import pieces_of
from host.diagnosis.search.outset import at_the_outset
from host.diagnosis.search.search import Search
from host.diagnosis.search.short_runs import followed_shortly, short_runs
from host.likelihood.gauss_newton import Point
from host.recordings.recording import Array, Recording

PULL, TURN, REACH = 0.25, 0.8, 1.2  # m/s^2 and rad/s^2 at the surface, m


def held_below_the_surface(duration: float = 120.0) -> Recording:
    """Steps between 1.8 and 4 m by a depth autopilot, with doublets on top; integrated by scipy."""
    plain, rng = hidden_dive(duration=duration), np.random.default_rng(3)
    x, states = np.array([0.0, 0.0, 0.0, 3.0]), np.empty((4, plain.time.size))
    planes = np.empty(plain.time.size)
    for k, time in enumerate(plain.time):
        states[:, k] = x
        aim = np.clip(0.15 * (x[3] - (1.8 if time % 40.0 < 20.0 else 4.0)), -0.25, 0.25)
        plane = np.clip(1.2 * (x[2] - aim) + 0.4 * x[1] + 0.08 * np.sign(np.sin(time)), -0.3, 0.3)
        planes[k] = plane

        def rate(_: float, x: Array, plane: float = plane) -> list[float]:
            near = np.exp(-x[3] / REACH)
            w, q, theta, _ = x
            return [
                BASE["a1"] * w + BASE["b1"] * plane - PULL * near,
                BASE["a2"] * q + BASE["a3"] * theta + BASE["b2"] * plane + TURN * near,
                q,
                w - BASE["u0"] * theta,
            ]

        x = solve_ivp(rate, (0.0, plain.step), x, rtol=1e-8, atol=1e-10).y[:, -1]
    pitch = states[2] + np.deg2rad(0.1) * rng.standard_normal(planes.size)
    depth = states[3] + 0.01 * rng.standard_normal(planes.size)
    return replace(plain, rudder=planes, pitch=pitch, depth=depth)


def test_only_near_the_surface_it_is_asked_about() -> None:
    dive = hidden_dive()
    least = float(np.nanmin(dive.depth))
    for above, asked in ((0.1, (*CATALOGUE, *NEAR_THE_SURFACE)), (-0.1, CATALOGUE)):
        lifted = replace(dive, depth=dive.depth - least + SHALLOW - above)
        assert Fitter([lifted]).candidates == asked


def test_its_pull_its_moment_and_its_reach_are_told_by_the_motion() -> None:
    dive = held_below_the_surface()
    assert 0.3 < dive.depth.min() < dive.depth.max() < 8.0
    # Depth is unstable so near the surface: over minutes no free run tells anything.
    fitter, structure = Fitter(pieces_of(dive, 150)), structure_of(("free_surface_suction",))
    roughly = BASE | {"suction": 0.8 * PULL, "suction_moment": 0.8 * TURN, "suction_reach": 0.8 * REACH}
    start = np.array([roughly.get(name, 0.0) for name in structure.names])
    point = Point(structure, start, fitter.base.fit.initial, fitter.base.fit.noise)
    names = frozenset(structure.effect_names)
    found = fitter.polished(fitter.explained(names, fitter.fitted([point])))
    values = dict(zip(structure.names, found.fit.parameters.tolist(), strict=True))
    assert fitter.excess(found.fit) < 1.1
    assert values["suction"] == pytest.approx(PULL, rel=0.1)
    assert values["suction_moment"] == pytest.approx(TURN, rel=0.1)
    assert values["suction_reach"] == pytest.approx(REACH, rel=0.1)


@pytest.mark.long
def test_short_runs_teach_what_no_long_one_follows() -> None:
    dive = held_below_the_surface(duration=250.0)
    fitter, short = Fitter([dive]), short_runs([dive])
    whole = at_the_outset(fitter)
    assert short is not None
    assert whole is not None
    assert fitter.excess(whole.fit) > MUCH
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        found = followed_shortly(search, whole, short)
        assert followed_shortly(search, whole, short._replace(whole=short.fitter.base)) is None
    assert found is not None
    values = dict(zip(found.fit.structure.names, found.fit.parameters.tolist(), strict=True))
    assert found.bic < whole.bic
    assert values["suction"] == pytest.approx(PULL, rel=0.2)
    assert values["suction_reach"] == pytest.approx(REACH, rel=0.2)
