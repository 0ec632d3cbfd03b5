"""Sets of many are evaluated in equations that were built before, and nothing differs by it."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import hidden_dive
from test_under_forces import SEVERAL, real_hull

from host.catalogue import structure_of
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.shared_equations import CARRIED, in_shared_equations
from host.likelihood.filter_error import filter_error_from
from host.likelihood.fit import Fit
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error
from host.likelihood.waves import in_waves_from

WITH_STATES = ("actuator_lag", "drag_along_the_hull")


@pytest.fixture(scope="module")
def fitter() -> Fitter:
    return Fitter([hidden_dive(real_hull, duration=40.0)])


def test_few_effects_keep_their_own_equations() -> None:
    few = frozenset({*SEVERAL[:4], FREE_TRIM.name})
    assert in_shared_equations(few) is None
    many = in_shared_equations(few | {SEVERAL[4]})
    assert many is not None
    assert {effect.name for effect in many.effects} == few | {SEVERAL[4]} | CARRIED
    assert many.states == structure_of(few).states  # or the shared would move what the set has not


@pytest.mark.parametrize("kind", ["free run", "random forces", "waves"])
def test_shared_equations_change_nothing(kind: str, fitter: Fitter) -> None:
    names = frozenset({*SEVERAL, *WITH_STATES})
    assert len(CARRIED - names) > 2
    structure = structure_of(names)
    start = {name: 0.0 for name in structure.names} | {"a1": -0.6, "a2": -1.0, "a3": -0.5, "u0": 1.5}
    start |= {"b1": -0.3, "b2": -0.8, "c_wq": 0.5, "c_ww": -1.0, "c_qq": -2.0, "c_qw": 0.3, "lag_time": 0.1}
    start |= {"drag_half_length": 0.4}
    levels = {
        "free run": np.array([1e-5, 1e-4, 0.0, 0.0]),
        "random forces": np.array([1e-5, 1e-4, 1e-5, 1e-5]),
        "waves": np.array([1e-5, 1e-4, 0.9, 0.1, 0.0, 1e-4, 1e-4]),
    }[kind]
    values = np.array([start[name] for name in structure.names])
    point = Point(structure, values, fitter.root.fit.initial, levels)
    shared = fitter.inputs(names, for_filter=kind != "free run")
    assert all(one.shared is not None for one in shared)
    own = [replace(one, shared=None) for one in shared]
    free = fitter.free(names)

    def fitted(inputs: list) -> Fit:  # type: ignore[type-arg]
        if kind == "free run":
            return output_error(point, inputs, free, most_iterations=3)
        climb = in_waves_from if kind == "waves" else filter_error_from
        return climb(point, inputs, free, 3, holds_noise=True)

    one, other = fitted(shared), fitted(own)
    assert one.structure == other.structure
    assert one.log_likelihood == pytest.approx(other.log_likelihood, abs=1e-6)
    np.testing.assert_allclose(one.parameters, other.parameters, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(
        one.information, other.information, atol=1e-6 * np.abs(other.information).max()
    )
    for scores, others in zip(one.scores, other.scores, strict=True):
        np.testing.assert_allclose(scores, others, atol=1e-6 * np.abs(others).max())
