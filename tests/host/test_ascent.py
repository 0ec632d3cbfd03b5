"""The ascent of a filter's likelihood where the hull is unstable and hardly any force excuses what is off."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import host.likelihood.ascent
from host.catalogue import structure_of
from host.dynamics.propagate import inputs_of
from host.likelihood.ascent import ascend, place
from host.likelihood.filter_error import RandomForces
from host.likelihood.gauss_newton import GaussNewton, Point
from tests.diagnosis.hidden_dive import BASE, hidden_dive

STRUCTURE = structure_of(("heave_quadratic_drag", "munk_moment", "pitch_quadratic_damping"))  # no coupling
HULL = {"a1": -0.8, "a2": -0.5, "a3": -0.7, "b1": -0.17, "b2": -1.7, "u0": 2.5}
HULL |= {"c_wq": 0.6, "c_ww": -2.0, "c_qw": 4.6, "c_qq": -22.0}
FREE = np.array([name in HULL and name != "u0" for name in STRUCTURE.names])
NOISE = np.array([np.deg2rad(0.1) ** 2, 0.01**2, 1e-5, 1e-5])


def beside_the_base(_: float, x: np.ndarray, plane: float) -> tuple[float, float, float]:  # type: ignore[type-arg]
    """What makes this hull of the vehicle of the dive."""
    own = {name: value - BASE.get(name, 0.0) for name, value in HULL.items()}
    w, q, theta, _ = x
    force = own["a1"] * w + own["b1"] * plane + own["c_wq"] * q + own["c_ww"] * w * abs(w)
    moment = (
        own["a2"] * q + own["a3"] * theta + own["b2"] * plane + own["c_qw"] * w + own["c_qq"] * q * abs(q)
    )
    return force, moment, 0.0


def unstable(factor: float) -> tuple[RandomForces, Point]:
    """A hull that turns broadside, and its coefficients off by a factor."""
    recording = hidden_dive(beside_the_base, duration=60.0)
    values = np.array([factor * HULL.get(name, 0.0) for name in STRUCTURE.names])
    values[STRUCTURE.names.index("u0")] = HULL["u0"]
    start = [np.array([0.0, 0.0, 0.0, 20.0, 0.0])]
    return RandomForces([inputs_of(recording, STRUCTURE)]), Point(STRUCTURE, values, start, NOISE)


def test_the_hull_is_unstable() -> None:
    heave, pitch = [HULL["a1"], HULL["c_wq"], 0.0], [HULL["c_qw"], HULL["a2"], HULL["a3"]]
    assert np.linalg.eigvals([heave, pitch, [0.0, 1.0, 0.0]]).real.max() > 0.3


def test_the_score_by_differences_is_the_slope_of_the_likelihood() -> None:
    model, point = unstable(0.97)
    here = place(point, model)
    fixed = GaussNewton(model.whitened(point, here.passes), point, FREE)
    step = host.likelihood.ascent._scored(here, model, fixed)
    for k, index in enumerate(np.flatnonzero(FREE)):
        stride, ends = 1e-4 * abs(point.parameters[index]), []
        for sign in (1.0, -1.0):
            values = point.parameters.copy()
            values[index] += sign * stride
            ends.append(place(replace(point, parameters=values), model).likelihood)
        slope = (ends[0] - ends[1]) / (2.0 * stride)
        assert step.g[k] == pytest.approx(slope, rel=0.02, abs=0.02 * np.sqrt(step.H[k, k]))


def test_what_slopes_at_fixed_gain_hide_is_climbed_all_the_same() -> None:
    """Equations that lack much lose such a hull: at fixed gain the ascent ends early, elsewhere each time."""
    starts = [unstable(factor) for factor in (0.7, 0.95)]
    ends = [ascend(point, model, FREE, 40, holds_noise=True)[0].likelihood for model, point in starts]
    assert ends[0] == pytest.approx(ends[1], abs=1.0)
    for model, point in starts:
        stuck, _, _ = ascend(point, model, FREE, 40, holds_noise=True, holds_gain=True)
        assert stuck.likelihood < ends[0] - 100.0


def test_once_slopes_at_fixed_gain_were_false_they_are_not_asked_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model, point = unstable(0.7)
    asked = []
    uphill = host.likelihood.ascent._uphill

    def counted(*arguments: Any) -> Any:
        end = uphill(*arguments)
        asked.append(end[0].likelihood > arguments[0].likelihood)
        return end

    monkeypatch.setattr(host.likelihood.ascent, "_uphill", counted)
    _, used, converged = ascend(point, model, FREE, 40, holds_noise=True)
    assert converged
    assert len(asked) == used + 1  # the one step that was taken again
    assert not all(asked)
