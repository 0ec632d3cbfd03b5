"""Where heave damping and speed trade places, the other valley is found from either."""

from dataclasses import replace

import numpy as np
import pytest
from exact_dive import Dive, fly

from host.dynamics.equations import BASE, NAMES
from host.dynamics.propagate import Inputs, inputs_of
from host.identification.uncertainty import covariance
from host.likelihood.fit import Fit
from host.likelihood.gauss_newton import Point
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.likelihood.output_error import output_error
from host.likelihood.valleys import A1, USUAL_DAMPING, USUAL_SPEED, other_valleys, plausibility, with_rivals

U0 = NAMES.index("u0")


@pytest.fixture(scope="module")
def two_ends() -> tuple[Fit, Fit, list[Inputs]]:
    """The ends of searches from both valleys of a dive with little motion under much noise."""
    dive = Dive(seed=7, duration=40.0, amplitude=0.1, pitch_noise=0.01, depth_noise=0.05)
    inputs = [inputs_of(fly(dive)[0])]
    best = fit_maximum_likelihood([fly(dive)[0]], noise_model="output_error")
    (rival,) = best.rivals
    start = Point(BASE, rival.parameters, best.initial, best.noise)
    return best, output_error(start, inputs, best.free), inputs


def test_each_valley_leads_to_the_other(two_ends: tuple[Fit, Fit, list[Inputs]]) -> None:
    best, other, inputs = two_ends
    for here, there in ((best, other), (other, best)):
        found = other_valleys(here, inputs)
        assert any(np.allclose(end.parameters[:6], there.parameters[:6], rtol=0.05) for end in found)
        again = with_rivals(here, found)
        assert np.allclose(again.parameters[:6], best.parameters[:6], rtol=0.05)
        assert len(again.rivals) == 1


def test_a_measured_or_held_speed_leaves_one_valley(two_ends: tuple[Fit, Fit, list[Inputs]]) -> None:
    best, _, inputs = two_ends
    held = best.free & (np.arange(best.free.size) != U0)
    assert other_valleys(replace(best, free=held), inputs) == []
    held[A1] = False
    assert plausibility(replace(best, free=held)) == best.log_likelihood


@pytest.mark.parametrize(
    ("index", "usual", "ordinary", "absurd"), [(U0, USUAL_SPEED, 0.3, 0.0), (A1, USUAL_DAMPING, -0.1, -1e-4)]
)
def test_an_unusual_speed_or_heave_damping_must_be_earned(
    two_ends: tuple[Fit, Fit, list[Inputs]], index: int, usual: float, ordinary: float, absurd: float
) -> None:
    best, _, _ = two_ends
    lone = replace(best, free=np.arange(8) == index)

    def at(value: float) -> float:
        return plausibility(replace(lone, parameters=np.where(np.arange(8) == index, value, best.parameters)))

    assert at(usual) == best.log_likelihood
    assert best.log_likelihood - 1.5 < at(ordinary) < best.log_likelihood
    assert at(absurd) < best.log_likelihood - 15.0
    assert plausibility(replace(best, log_likelihood=-np.inf)) == -np.inf


def test_rivals_widen_the_deviations_by_their_chance(two_ends: tuple[Fit, Fit, list[Inputs]]) -> None:
    best, other, _ = two_ends
    alone = replace(best, rivals=())
    (rival,) = with_rivals(alone, [other]).rivals
    chance = np.exp(rival.log_odds) / (1.0 + np.exp(rival.log_odds))
    away = (other.parameters - best.parameters)[U0]
    widened = covariance(with_rivals(alone, [other]))[U0, U0] - covariance(alone)[U0, U0]
    assert widened == pytest.approx(chance * away**2)
    hopeless = replace(other, log_likelihood=other.log_likelihood - 50.0)
    assert with_rivals(alone, [hopeless]).rivals == ()
