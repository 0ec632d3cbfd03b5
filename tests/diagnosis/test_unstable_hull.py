"""A hull that is unstable follows no free run: what leads it away is told from physics that was left out."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from host.catalogue import structure_of
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.disturbances.seas import Explained, again_astray, led_astray
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import leftover
from host.diagnosis.fits.setting import SLIGHT
from host.diagnosis.fits.speed_forces import densities
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search.outset import FAR_LESS
from host.diagnosis.search.search import FAR_LIKELIER, LOST, Search
from host.dynamics.propagate import free_run, inputs_of
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error
from host.recordings.recording import Array
from tests.diagnosis.hidden_dive import hidden_dive

NAMES = frozenset(
    {"heave_pitch_rate_coupling", "heave_quadratic_drag", "munk_moment", "pitch_quadratic_damping"}
)
HULL = {"a1": -0.8, "a2": -0.5, "a3": -0.7, "b1": -0.17, "b2": -1.7, "u0": 1.5}
HULL |= {"c_wq": 0.6, "c_ww": -2.0, "c_qw": 4.6, "c_qq": -22.0}
NOISE = np.array([[2e-3], [1e-2]])  # rad, m


@cache
def flown(speed_noise: float) -> tuple[Fitter, Explanation]:
    """A dive of this hull, whose speed is measured, and the end of a search from the truth."""
    rng, rows = np.random.default_rng(1), hidden_dive(duration=120.0)  # its plane alone
    speed = HULL["u0"] + 0.004 * np.cumsum(rng.standard_normal(rows.time.size))
    rows = replace(rows, speed=speed)
    structure = structure_of(NAMES | {"speed_loss"})
    known = dict.fromkeys(structure.names, 0.0) | {"speed_time": 1.0} | HULL
    values, start = np.array([known[name] for name in structure.names]), np.array([0.0, 0.0, 0.0, 20.0, 0.0])
    inputs = inputs_of(rows, structure)
    inputs.drive[1] = speed  # as it was, not smoothed
    run = free_run(values, start, inputs)
    pitch, depth = run.outputs + NOISE * rng.standard_normal(run.outputs.shape)
    measured = speed + speed_noise * rng.standard_normal(rows.time.size)
    fitter = Fitter([replace(rows, pitch=pitch, depth=depth, speed=measured)])
    names = NAMES | {"speed_loss"}
    at = Point(structure, values, [start], np.array([*fitter.floor, 0.0, 0.0]))
    fit = output_error(at, fitter.inputs(names), fitter.free(names))
    return fitter, fitter.explained(names, fit)


def test_errors_of_the_speed_are_not_taken_for_physics() -> None:
    fitter, best = flown(0.03)
    assert not leftover(fitter, best).is_nothing
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        led = led_astray(search, best)
    assert led is not None
    _, found = led
    left = leftover(fitter, found)
    assert left.is_nothing
    assert left.is_by_speed
    # The moment's density is foretold, not only bounded.
    assert 0.3 < found.fit.noise[3] / densities(fitter, found.fit)[1] < 3.0
    assert found.names == best.names
    known = dict(zip(found.fit.structure.names, found.fit.parameters.tolist(), strict=True))
    # A part of long recordings is searched first: from what was found there the whole goes on among forces.
    with Workers(fitter, 1) as workers:
        whole = again_astray(fitter, workers, lambda _: None, Explained(found, led[0], left, None))
    assert whole.best.names == found.names
    assert whole.left.is_by_speed
    assert all(known[name] == pytest.approx(value, rel=0.15) for name, value in HULL.items() if name != "a2")


def test_a_free_run_that_follows_is_not_led_astray() -> None:
    fitter, best = flown(0.0)
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        assert led_astray(search, best) is None


@pytest.mark.parametrize(
    ("share", "excess", "is_unstable"), [(0.5, 2.0, True), (2.0, 2.0, False), (0.5, 0.5, False)]
)
def test_slight_forces_beside_a_free_run_that_is_lost(share: float, excess: float, is_unstable: bool) -> None:
    fitter, best = flown(0.0)
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        assert not search.follows_no_free_run
        forces = share * SLIGHT * np.square(fitter.accelerations)
        search.steered = replace(best, fit=replace(best.fit, noise=np.array([*fitter.floor, *forces])))
        lost = np.array([*(excess * LOST * fitter.floor), 0.0, 0.0])
        search.joint.add(search.remember(replace(best, fit=replace(best.fit, noise=lost))).names)
        assert search.follows_no_free_run == is_unstable


@pytest.mark.parametrize(
    ("likelier", "excess", "is_pushed"), [(2.0, 2.0, True), (0.5, 2.0, False), (2.0, 0.5, False)]
)
def test_forces_that_are_not_slight_beside_a_free_run_that_is_lost(
    likelier: float, excess: float, is_pushed: bool
) -> None:
    fitter, best = flown(0.0)
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        assert not search.is_pushed_about
        lost = np.array([*(excess * LOST * fitter.floor), 0.0, 0.0])
        search.joint.add(search.remember(replace(best, fit=replace(best.fit, noise=lost))).names)
        assert not search.is_pushed_about
        forces = 2.0 * SLIGHT * np.square(fitter.accelerations)
        search.steered = replace(
            best,
            fit=replace(best.fit, noise=np.array([*fitter.floor, *forces])),
            bic=best.bic - likelier * FAR_LIKELIER * best.fit.samples,
        )
        assert search.is_pushed_about == search.is_led_elsewhere == is_pushed


@pytest.mark.parametrize(("left", "is_pushed"), [(0.5, False), (2.0, True)])
def test_a_plane_that_is_kept_back_is_no_matter_of_forces(left: float, is_pushed: bool) -> None:
    fitter, best = flown(0.0)
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        lost = np.array([*(2.0 * LOST * fitter.floor), 0.0, 0.0])
        search.joint.add(search.remember(replace(best, fit=replace(best.fit, noise=lost))).names)
        forces = np.array([*fitter.floor, *(2.0 * SLIGHT * np.square(fitter.accelerations))])
        bic = best.bic - 3.0 * FAR_LIKELIER * best.fit.samples
        search.steered = replace(best, fit=replace(best.fit, noise=forces), bic=bic)
        assert search.is_pushed_about
        held = replace(best.fit, noise=left * FAR_LESS * fitter.excess(fitter.root.fit) * _sensors(fitter))
        names = frozenset({"actuator_rate_limit", FREE_TRIM.name})
        search.remember(Explanation(names, held, best.bic - 1.0))
        assert search.is_pushed_about == is_pushed


def _sensors(fitter: Fitter) -> Array:
    """Levels of the sensors' noise alone."""
    return np.array([*fitter.floor, 0.0, 0.0])
