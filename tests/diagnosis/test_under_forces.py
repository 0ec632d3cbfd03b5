"""Fits under random forces and waves, and what is told by these at once."""

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from hidden_dive import hidden_dive
from test_seas import in_waves

from host.catalogue import FAINT, ORDINARY
from host.diagnosis import explain, plane_choice
from host.diagnosis.disturbances import all_at_sea, seas
from host.diagnosis.disturbances.all_at_sea import in_a_swell, pushed_about
from host.diagnosis.disturbances.plain_waves import plain_waves, whole_in_waves
from host.diagnosis.disturbances.seas import Explained, Waves, again_astray
from host.diagnosis.explain import _begun_with_all
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import leftover
from host.diagnosis.fits.sea_fits import with_sea, with_waves
from host.diagnosis.fits.under_forces import climbed
from host.diagnosis.fits.workers import Workers
from host.diagnosis.plane_choice import Way, _in_a_swell
from host.diagnosis.search import outset
from host.diagnosis.search.outset import at_the_outset, pushed_by_forces
from host.diagnosis.search.search import Search
from host.diagnosis.search.whole_vehicle import is_real
from host.likelihood.gauss_newton import Point
from host.recordings.recording import Array

SEVERAL = (
    "heave_pitch_rate_coupling",
    "pitch_quadratic_damping",
    "munk_moment",
    "heave_quadratic_drag",
    "surge_pitch_coupling",
)


def real_hull(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    """What acts on a vehicle as they are built, strong enough to be seen in a minute and a half."""
    w, q = x[0], x[1]
    return 0.8 * q - 2.0 * w * abs(w), 0.6 * w - 4.0 * q * abs(q), 0.0


def jolted(time: float, x: Array, plane: float) -> tuple[float, float, float]:
    """The same, thrown about twice for a quarter of a minute by what is in no catalogue."""
    force, moment, climb = real_hull(time, x, plane)
    throws = 0.12 * np.sin(5.0 * x[2] + 0.9 * time) * (25.0 < time % 50.0 < 40.0)
    return force, moment + float(throws), climb


@pytest.fixture(scope="module")
def rough() -> tuple[Fitter, Explanation]:
    """A real vehicle in an irregular sea, and the root among its waves."""
    fitter = Fitter([hidden_dive(in_waves(real_hull, 0.01, 0.01), duration=90.0)])
    waves = plain_waves(fitter)
    assert waves is not None
    return fitter, waves


@pytest.fixture(scope="module")
def thrown() -> tuple[Fitter, Explanation]:
    """One that is thrown about, and what all that every vehicle has makes of it."""
    fitter = Fitter([hidden_dive(jolted, duration=100.0)])
    whole = at_the_outset(fitter)
    assert whole is not None
    return fitter, whole


def several(fitter: Fitter, begun: Explanation) -> Explanation:
    for name in SEVERAL:
        begun = fitter.grown(begun, name, [])
    return begun


def test_a_fit_that_would_not_get_there_is_given_up(thrown: tuple[Fitter, Explanation]) -> None:
    fitter, _ = thrown
    sea = with_sea(fitter, fitter.root)
    start = Point(sea.fit.structure, 0.7 * sea.fit.parameters, sea.fit.initial, sea.fit.noise)
    ended = climbed(fitter, start, holds_noise=True)
    assert ended.iterations > 3
    early = climbed(fitter, start, True, least=ended.log_likelihood + 1e6)
    assert early.iterations < ended.iterations
    assert climbed(fitter, start, True, least=ended.log_likelihood - 1.0).log_likelihood == pytest.approx(
        ended.log_likelihood
    )


def test_waves_are_narrower_beside_all_that_a_vehicle_has(rough: tuple[Fitter, Explanation]) -> None:
    fitter, waves = rough
    whole = at_the_outset(fitter)
    assert whole is not None
    assert not whole.leaves_white
    swell = whole_in_waves(fitter, waves, whole)
    assert swell is not None
    assert swell.names == whole.names >= {*ORDINARY, *FAINT}
    assert swell.leaves_white
    assert swell.bic < waves.bic - 50.0
    assert swell.fit.waves[1] < waves.fit.waves[1]
    likely = Explanation(whole.names, whole.fit, swell.bic)
    assert whole_in_waves(fitter, waves, likely) is None  # without waves it is as likely
    assert whole_in_waves(fitter, Explanation(waves.names, waves.fit, -1e9), whole) is None


def test_the_search_among_waves_begins_with_all_of_it(
    rough: tuple[Fitter, Explanation], monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter, waves = rough
    swell = with_waves(fitter, several(fitter, waves))
    few = frozenset({"heave_pitch_rate_coupling"})
    with Workers(fitter, 1) as workers:
        calm = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        kept = fitter.reduced(swell, frozenset({*SEVERAL}))
        monkeypatch.setattr(Search, "run_from", lambda *_: kept)
        monkeypatch.setattr(seas, "_lean", lambda _, fitted: fitted)
        told = in_a_swell(calm, swell)
        assert told is not None
        assert told.waves is not None
        assert told.best.names == kept.names
        assert told.left.is_nothing
        assert told.waves.delta_bic > 100.0  # white forces in the place of the waves are far less likely
        with monkeypatch.context() as likely:
            likely.setattr(all_at_sea, "with_sea", lambda _, fitted: fitted)
            assert in_a_swell(calm, swell) is None  # where they were as likely, no waves
        for share, is_enough in ((0.5, True), (2.0, False)):  # of a trace
            gained = share * all_at_sea.TRACE * told.waves.delta_bic
            with monkeypatch.context() as smooth:
                smooth.setattr(all_at_sea, "left_among", lambda *_: replace(told.left, is_smooth=True))
                smooth.setattr(all_at_sea, "form_gains", lambda *_, gained=gained: {"form": gained})
                assert (in_a_swell(calm, swell) is not None) == is_enough
        monkeypatch.setattr(Search, "run_from", lambda *_: fitter.reduced(swell, few))
        assert in_a_swell(calm, swell) is None


def test_on_the_whole_the_same_waves_are_kept(
    rough: tuple[Fitter, Explanation], monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter, waves = rough
    swell = with_waves(fitter, fitter.reduced(several(fitter, waves), frozenset({*SEVERAL})))
    whole = Fitter([hidden_dive(in_waves(real_hull, 0.01, 0.01), duration=120.0)])
    told = Waves(delta_bic=500.0, fitted=swell, model=swell, theirs=frozenset())
    monkeypatch.setattr(seas, "_lean", lambda _, fitted: fitted)
    with Workers(fitter, 1) as workers, Workers(whole, 1) as others:
        known = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        known.remember(swell)
        part = Explained(swell, known, leftover(fitter, swell), told, is_of_all=True)
        monkeypatch.setattr(Search, "run", lambda _, also: also[0])
        found = explain.explain(whole, others, lambda _: None, Way([], whole), part)
        assert found.waves is not None
        assert found.best.fit.samples > swell.fit.samples
        assert found.best.names == {*SEVERAL}
        np.testing.assert_array_equal(found.best.fit.waves, swell.fit.waves)
        assert found.waves.delta_bic > 100.0
        astray: list[Explained] = []
        monkeypatch.setattr(explain, "again_astray", lambda *given: astray.append(given[-1]) or part)
        pushed = part._replace(waves=None)
        assert explain.explain(whole, others, lambda _: None, Way([], whole), pushed) is part
        assert astray == [pushed]


def test_only_doubtful_members_are_asked_in_their_own_waves(
    rough: tuple[Fitter, Explanation], monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter, waves = rough
    many = fitter.reduced(several(fitter, waves), frozenset({*SEVERAL}))
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        search.remember(many)
        worth = dict.fromkeys(SEVERAL, 1.0) | {"munk_moment": 2.0 * seas.DOUBTED}
        fewer = lambda _, best, names: [Explanation(best.names, best.fit, best.bic + worth[n]) for n in names]  # noqa: E731
        monkeypatch.setattr(Search, "each_without", fewer)
        assert seas._doubted(search, many) == sorted({*SEVERAL} - {"munk_moment"})
        one = fitter.reduced(many, frozenset({"munk_moment"}))
        assert seas._doubted(search, one) == ["munk_moment"]


def test_waves_without_which_all_is_far_off_need_no_calm_search(
    rough: tuple[Fitter, Explanation], monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter, waves = rough
    whole = fitter.root  # what is known of it here is how likely it is
    ways = [Way([], fitter, waves=waves), Way([], fitter, waves=waves)]
    monkeypatch.setattr(plane_choice, "whole_in_waves", lambda *_: None)
    monkeypatch.setattr(plane_choice, "LITTLE", 2.0)
    assert _in_a_swell(ways, whole)[0].calm is whole
    assert _in_a_swell(ways, Explanation(whole.names, whole.fit, waves.bic + 100.0))[0].calm is None
    assert _in_a_swell(ways, None) is ways
    monkeypatch.setattr(plane_choice, "LITTLE", 0.5)  # so much is left among them that they are doubtful
    assert _in_a_swell(ways, whole)[0].calm is None
    swell = Explanation(waves.names, waves.fit, waves.bic - 50.0)
    monkeypatch.setattr(plane_choice, "whole_in_waves", lambda *_: swell)
    monkeypatch.setattr(fitter, "reduced", lambda *_: Explanation(waves.names, waves.fit, waves.bic - 90.0))
    first, second = _in_a_swell(ways, whole)
    assert first.swell is not None
    assert first.swell.bic < swell.bic
    assert second.swell is swell

    asked: list[str] = []
    among = Explained(waves, cast("Search", None), cast("Any", None), None)
    monkeypatch.setattr(explain, "in_a_swell", lambda *_: asked.append("swell"))
    monkeypatch.setattr(explain, "in_plain_waves", lambda *_: asked.append("plain") or among)
    monkeypatch.setattr(explain, "against", lambda found, *_: found)
    monkeypatch.setattr(explain, "pushed_about", lambda *_, **__: asked.append("pushed") or among)
    search = cast("Search", None)
    assert _begun_with_all(search, second._replace(calm=None)) is None
    assert _begun_with_all(search, second._replace(calm=whole)) is among
    assert _begun_with_all(search, Way([], fitter)) is None
    assert _begun_with_all(search, Way([], fitter, pushed=waves)) is among
    assert asked == ["swell", "swell", "plain", "pushed"]


def test_what_pushes_a_vehicle_about_is_told_by_random_forces(thrown: tuple[Fitter, Explanation]) -> None:
    fitter, whole = thrown
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        pushed = pushed_by_forces(search, whole)
        assert pushed is not None
        assert pushed.names == whole.names
        assert pushed.fit.has_process_noise


@pytest.mark.long
def test_what_pays_beside_them_is_named(thrown: tuple[Fitter, Explanation]) -> None:
    fitter, whole = thrown
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        told = pushed_about(search, with_sea(fitter, whole), are_far_likelier=False)
        assert told is not None
        assert not told.left.is_nothing  # a sea would push all the time
        assert told.waves is None
        assert "heave_pitch_rate_coupling" in told.best.names
        assert is_real(told.best.names)
        assert told.best.fit.has_process_noise


@pytest.mark.parametrize(
    "why", ["little is left", "lost", "large forces", "as likely", "by speed", "gains", "has a form", "led"]
)
def test_else_the_search_goes_its_way(
    why: str, thrown: tuple[Fitter, Explanation], monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter, whole = thrown
    left = {"little is left": 1.1, "lost": 30.0}.get(why, 3.0)
    monkeypatch.setattr(fitter, "excess", lambda _: left)
    if why == "large forces":
        monkeypatch.setattr(outset, "MOST_FORCES", 1e-9)
    if why == "as likely":
        monkeypatch.setattr(outset, "FAR_LIKELIER", 1e3)
    monkeypatch.setattr(outset, "are_by_speed", lambda *_: why == "by speed")
    gains = {"ballast_change": 500.0 if why == "gains" else 1.0}
    forms = {"unknown_plane_abs_delta": 500.0 if why == "has a form" else 1.0}
    monkeypatch.setattr(outset, "form_gains", lambda *_: forms)
    search: Any = type("S", (), {"fitter": fitter, "gains": lambda *_: gains})()
    if why == "led":
        whole = Explanation(whole.names | {"actuator_saturation"}, whole.fit, whole.bic)
    assert pushed_by_forces(cast("Search", search), whole) is None


def test_forces_that_leave_nothing_must_be_asked_for(
    thrown: tuple[Fitter, Explanation], monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter, whole = thrown
    sea = with_sea(fitter, whole)
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        monkeypatch.setattr(Search, "run_from", lambda *_, **__: sea)
        assert pushed_about(search, sea, are_far_likelier=False) is not None
        nothing = leftover(fitter, sea).__class__(
            is_coloured=False,
            is_local=False,
            is_by_speed=False,
            is_no_sea=False,
            is_above_floor=False,
            smooth_gain=0.0,
            is_smooth=False,
        )
        monkeypatch.setattr(all_at_sea, "leftover", lambda *_: nothing)
        monkeypatch.setattr(seas, "leftover", lambda *_: nothing)
        assert pushed_about(search, sea, are_far_likelier=False) is None
        monkeypatch.setattr(all_at_sea, "form_gains", lambda *_: {"unknown_wandering_force": 1.0})
        of_no_sea = pushed_about(search, sea, are_far_likelier=True)
        assert of_no_sea is not None
        assert of_no_sea.left.is_nothing
        monkeypatch.setattr(all_at_sea, "form_gains", lambda *_: {"unknown_wandering_force": 100.0})
        in_part = pushed_about(search, sea, are_far_likelier=True)
        assert in_part is not None
        assert in_part.left.is_smooth
        monkeypatch.setattr(Search, "run", lambda *_: sea)
        again = again_astray(fitter, workers, lambda _: None, in_part)
        assert again.left.is_smooth  # on the whole of a long recording, too
        assert not again_astray(fitter, workers, lambda _: None, of_no_sea).left.is_smooth
