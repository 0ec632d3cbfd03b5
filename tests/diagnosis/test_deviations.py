"""Deviations along curved valleys of the likelihood, by profiles fitted independently."""

from functools import cache

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.proof.deviations import HALF_WIDTH, deviations
from host.dynamics.equations import NAMES
from host.identification.uncertainty import covariance
from host.likelihood.fit import Fit
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error


@cache
def noisy_fit() -> tuple[Fitter, Explanation, dict[str, float]]:
    """Ten times the usual noise: heave damping and speed are hardly told apart."""
    fitter = Fitter([hidden_dive(seed=4, duration=60.0, noise=10.0)])
    base = fitter.across(fitter.base)
    return fitter, base, deviations(fitter, base)


def fallen(name: str, distance: float) -> float:
    """By how much twice the log-likelihood falls where a coefficient is moved and the others follow it."""
    fitter, base, _ = noisy_fit()
    fit = base.fit
    own = np.array(fit.structure.names) == name
    moved = Point(fit.structure, fit.parameters + own * distance, fit.initial, fit.noise)
    beside = output_error(moved, fitter.inputs(base.names), fit.free & ~own)
    return 2.0 * (fit.log_likelihood - beside.log_likelihood)


def curvature(fit: Fit) -> np.ndarray:  # type: ignore[type-arg]
    return np.sqrt(np.diag(covariance(fit)))[:6]


@pytest.mark.parametrize("name", ["a1", "a2", "a3", "b1", "b2", "u0"])
def test_a_deviation_tells_how_long_a_curved_valley_is(name: str) -> None:
    _, _, std = noisy_fit()
    reach = HALF_WIDTH * std[name]
    assert min(fallen(name, side * reach) for side in (-1.0, 1.0)) == pytest.approx(HALF_WIDTH**2, rel=0.1)


def test_curved_valleys_are_longer_than_their_curvature_says() -> None:
    _, base, std = noisy_fit()
    ratios = [std[name] for name in NAMES[:6]] / curvature(base.fit)
    assert ratios.min() > 1.0
    assert ratios.max() > 1.3


def test_straight_valleys_are_as_long_as_their_curvature_says() -> None:
    fitter = Fitter([hidden_dive(seed=4, duration=60.0)])
    base = fitter.across(fitter.base)
    std = deviations(fitter, base)
    np.testing.assert_allclose([std[name] for name in NAMES[:6]], curvature(base.fit), rtol=0.05)


def test_a_profile_that_never_falls_ends_at_a_bound() -> None:
    fitter = Fitter([hidden_dive(seed=4, duration=30.0, noise=30.0)])
    base = fitter.across(fitter.base)
    k = base.fit.structure.names.index("a1")
    farthest = base.fit.parameters[k] - base.fit.structure.parameters[k].lower
    assert deviations(fitter, base)["a1"] * HALF_WIDTH == pytest.approx(farthest)
