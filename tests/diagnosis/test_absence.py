"""What a set loses without a member, foretold from its own fit, is what a fit without it finds."""

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.catalogue import named
from host.diagnosis.fits.absence import one_step_without
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.likelihood.fit import run_away
from host.likelihood.gauss_newton import Point
from host.recordings.recording import Array


def coupled(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return 0.3 * x[1] - 0.8 * x[0] * abs(x[0]), 0.0, 0.0


@pytest.fixture(scope="module")
def fitted() -> tuple[Fitter, Explanation]:
    fitter = Fitter([hidden_dive(coupled)])
    both = fitter.grown(fitter.base, "heave_pitch_rate_coupling", [])
    return fitter, fitter.polished(fitter.grown(both, "heave_quadratic_drag", []))


@pytest.mark.parametrize("name", ["heave_pitch_rate_coupling", "heave_quadratic_drag"])
def test_the_loss_is_foretold(fitted: tuple[Fitter, Explanation], name: str) -> None:
    fitter, both = fitted
    ahead = one_step_without(both.fit, named(name))
    assert ahead is not None
    loss, parameters = ahead
    less = fitter.polished(fitter.shrunk(both, name)).fit
    lost = 2.0 * (both.fit.log_likelihood - less.log_likelihood)
    # Drag that has long bent the damping costs more than is seen from where both are at their best.
    assert (loss == pytest.approx(lost, rel=0.35)) if name != "heave_quadratic_drag" else (10.0 < loss < lost)
    # Nearer to the end of the search than the values it would have begun with.
    kept = [both.fit.structure.names.index(parameter) for parameter in less.structure.names]
    foretold, as_they_were = (
        abs((values[kept] - less.parameters) @ less.information @ (values[kept] - less.parameters))
        for values in (parameters, both.fit.parameters)
    )
    assert foretold < 0.5 * as_they_were


def test_no_angle_of_its_stops_frees_a_plane(fitted: tuple[Fitter, Explanation]) -> None:
    fitter, both = fitted
    stopped = fitter.grown(both, "actuator_saturation", [])
    assert one_step_without(stopped.fit, named("actuator_saturation")) is None


def test_a_set_does_no_worse_than_with_a_member_less(
    fitted: tuple[Fitter, Explanation], monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter, both = fitted
    less = fitter.grown(fitter.base, "heave_pitch_rate_coupling", [])
    # A drag that drives instead of braking: from there the search runs away.
    monkeypatch.setattr("host.diagnosis.fits.starts.probed", lambda *_: [(0.0, np.array([1000.0]))])
    monkeypatch.setattr("host.diagnosis.fits.starts.may_be_bent", lambda *_: False)
    more = fitter.polished(fitter.grown(less, "heave_quadratic_drag", []))
    assert more.fit.log_likelihood > both.fit.log_likelihood - 2.0


def test_a_set_that_runs_away_is_the_worst_of_all(fitted: tuple[Fitter, Explanation]) -> None:
    fitter, both = fitted
    start = Point(both.fit.structure, both.fit.parameters, both.fit.initial, both.fit.noise)
    lost = run_away(start, fitter.inputs(both.names), both.fit.free)
    assert fitter.bic(lost, both.names) == np.inf
    assert not lost.has_process_noise  # or what goes on from there would be under random forces
