"""Of a large set, what is idle goes at once; what pays stays."""

from dataclasses import replace
from typing import Any

import pytest
from hidden_dive import hidden_dive

from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search.pruning import pruned
from host.diagnosis.search.search import Search
from host.diagnosis.search.together import with_ordinary
from host.recordings.recording import Array

TRUE = {"heave_pitch_rate_coupling", "pitch_quadratic_damping"}


def coupled(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return 0.6 * x[1], -3.0 * x[1] * abs(x[1]), 0.0


@pytest.fixture(scope="module")
def fitter() -> Fitter:
    return Fitter([hidden_dive(coupled)])


def search_of(fitter: Fitter, workers: Workers) -> Search:
    return Search(fitter, workers, lambda _: None, fitter.base, fitter.base)


def test_all_that_are_idle_go_at_once(fitter: Fitter, monkeypatch: pytest.MonkeyPatch) -> None:
    shrunk: list[tuple[Any, ...]] = []
    with Workers(fitter, 1) as workers:
        search = search_of(fitter, workers)
        joint = with_ordinary(search, fitter.grown(fitter.base, "heave_pitch_rate_coupling", []))
        assert len(joint.names) > 8
        results = workers.results

        def noted(tasks: Any, *more: Any) -> list[Any]:
            shrunk.extend(arguments[1:] for function, arguments in tasks if function is Fitter.shrunk)
            return results(tasks, *more)

        monkeypatch.setattr(workers, "results", noted)
        best = pruned(search, joint)
    assert best.names == TRUE
    assert len(shrunk[0]) > 4
    assert len(shrunk) < 12  # one at a time takes over thirty


def test_where_the_fit_without_all_of_them_is_worse_fewer_go(
    fitter: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A forecast that takes what pays for idle, too.
    monkeypatch.setattr("host.diagnosis.search.pruning._saved", lambda _, __, members: 100.0 * len(members))
    with Workers(fitter, 1) as workers:
        search = search_of(fitter, workers)
        joint = with_ordinary(search, fitter.grown(fitter.base, "heave_pitch_rate_coupling", []))
        assert pruned(search, joint).names >= TRUE


@pytest.mark.parametrize("are_needed_together", [False, True])
def test_what_improves_it_by_going_alone_goes_at_once_unless_two_do_the_same_work(
    fitter: Fitter, monkeypatch: pytest.MonkeyPatch, are_needed_together: bool
) -> None:
    monkeypatch.setattr("host.diagnosis.search.pruning._without_the_idle", lambda _, explanation: explanation)
    if are_needed_together:
        monkeypatch.setattr(
            "host.diagnosis.search.pruning._lost",
            lambda whole, fewer: 100.0 * (len(whole.names - fewer.names) > 1),
        )
    fitted = []
    with Workers(fitter, 1) as workers:
        search = search_of(fitter, workers)
        joint = with_ordinary(search, fitter.grown(fitter.base, "heave_pitch_rate_coupling", []))
        shrink = Search.shrink
        monkeypatch.setattr(Search, "shrink", lambda *given: fitted.append(len(given[2])) or shrink(*given))
        assert pruned(search, joint).names == TRUE
    assert (sum(fitted) > 30) == are_needed_together


def test_a_set_that_ended_in_a_poor_valley_is_fitted_again_from_a_larger_one(fitter: Fitter) -> None:
    with Workers(fitter, 1) as workers:
        search = search_of(fitter, workers)
        good = fitter.grown(fitter.grown(fitter.base, "heave_pitch_rate_coupling", []), "munk_moment", [])
        alone = fitter.grown(fitter.base, "heave_pitch_rate_coupling", [])
        poor = replace(alone.fit, log_likelihood=alone.fit.log_likelihood - 500.0)
        search.remember(replace(alone, fit=poor, bic=alone.bic + 1000.0))
        (found,) = search.each_without(good, ["munk_moment"])
    assert found.bic == pytest.approx(alone.bic, abs=0.1)
