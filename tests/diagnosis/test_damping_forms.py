"""Drags that one other effect imitates are found in its place."""

from dataclasses import replace
from math import hypot

from hidden_dive import hidden_dive

from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import ROUGH
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search.damping_forms import STEADY, with_drags_instead
from host.diagnosis.search.search import Search
from host.recordings.recording import Array


def dragged(_: float, x: Array, __: float) -> tuple[float, float, float]:
    return -2.5 * abs(x[0]) * x[0], -2.0 * hypot(x[1], 0.1) * x[1], 0.0


def test_drags_take_the_place_of_steady_damping_that_did_their_work() -> None:
    fitter = Fitter([hidden_dive(dragged, duration=80.0)])
    said: list[str] = []
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, said.append, fitter.base, fitter.root)
        bare = search.remember(fitter.base)
        assert with_drags_instead(search, bare) is bare
        assert said == []
        steady = search.remember(fitter.grown(fitter.base, STEADY, []))
        found = with_drags_instead(search, steady)
        assert found.bic < steady.bic - 10.0
        assert STEADY not in found.names
        assert "heave_quadratic_drag" in found.names
        likelier = replace(steady, bic=found.bic - 2.0 * ROUGH)
        assert with_drags_instead(search, likelier) is likelier
