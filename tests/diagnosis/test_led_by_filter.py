"""An unstable hull under an autopilot: a filter follows it, and tells whether anything else acts."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search.led_by_filter import led_by_a_filter
from host.diagnosis.search.outset import LOST, ends_of, names_of_all
from host.diagnosis.search.search import Search
from host.recordings.recording import Recording

HULL = {"a1": -1.0, "a2": -1.0, "a3": -0.7, "b1": -0.7, "b2": -3.2, "u0": 1.5, "c_wq": 0.6, "c_qw": 3.9}
GUSTS = np.array([0.004, 0.02])  # m/s^2 and rad/s^2 over sqrt(Hz)
STEPS = 10  # of the integration, from row to row


def flown(stop: float = np.inf, duration: float = 150.0) -> Recording:
    """A dive held by an autopilot that also swings the plane; `stop` is where the plane stops, rad."""
    rng, rows = np.random.default_rng(3), hidden_dive(duration=duration)
    h = rows.step / STEPS
    w, q, theta, zeta = 0.0, 0.0, 0.0, 20.0
    told = np.empty((3, rows.time.size))
    for k in range(rows.time.size):
        command = 0.5 * rows.rudder[k] + 0.5 * theta + 0.35 * q - 0.02 * (zeta - 20.0)
        told[:, k] = theta, zeta, command
        plane = np.clip(command, -stop, stop)
        for _ in range(STEPS):
            force, moment = GUSTS * rng.standard_normal(2) / np.sqrt(h)
            heave = HULL["a1"] * w + HULL["b1"] * plane + HULL["c_wq"] * q + force
            turn = HULL["a2"] * q + HULL["a3"] * theta + HULL["b2"] * plane + HULL["c_qw"] * w + moment
            w, q, theta, zeta = (
                w + h * heave,
                q + h * turn,
                theta + h * q,
                zeta + h * (w - HULL["u0"] * theta),
            )
    pitch, depth = told[:2] + np.array([[2e-3], [1e-2]]) * rng.standard_normal(told[:2].shape)
    speed = np.full_like(pitch, HULL["u0"])
    return replace(rows, pitch=pitch, depth=depth, rudder=told[2], speed=speed)


@cache
def begun(stop: float) -> tuple[Fitter, Explanation]:
    fitter = Fitter([flown(stop)])
    return fitter, next(ends_of(fitter, names_of_all(fitter)))


def led(fitter: Fitter, whole: Explanation) -> Explanation | None:
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        return led_by_a_filter(search, whole)


def test_an_unstable_hull_is_led_by_a_filter() -> None:
    fitter, whole = begun(np.inf)
    assert fitter.excess(whole.fit) > LOST
    found = led(fitter, whole)
    assert found is not None
    assert found.leaves_white
    values = dict(zip(found.fit.structure.names, found.fit.parameters.tolist(), strict=True))
    assert all(values[name] == pytest.approx(HULL[name], rel=0.3) for name in ("b1", "b2", "c_wq", "c_qw"))


@pytest.mark.long
def test_what_keeps_its_plane_back_gains_beside_the_forces() -> None:
    fitter, whole = begun(0.08)
    assert fitter.excess(whole.fit) > LOST
    assert led(fitter, whole) is None


def test_a_hull_that_a_free_run_follows_needs_no_filter() -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    assert led(fitter, fitter.root) is None
