"""What may stand in the place of a member is found, also where no prediction ranks it."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import ROUGH
from host.diagnosis.fits.trims import retrimmed
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search.exchange import _likely, exchanged, twins
from host.diagnosis.search.search import Search
from host.recordings.recording import Array


def out_of_trim(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return 0.0, 0.03, 0.0


@pytest.fixture(scope="module")
def fitter() -> Fitter:
    return Fitter([hidden_dive(out_of_trim, duration=60.0)])


def test_all_that_mend_a_bad_fit_alike_are_likely() -> None:
    # Where the parent is far off, each repair promises the same, and less than it is worth.
    gains = {f"repair {k}": 430.0 - k for k in range(8)} | {"idle": 3.0, "weak": 200.0}
    assert _likely(gains, worth=1200.0, count=3) == {f"repair {k}" for k in range(8)}
    # Where it is near, the few best that do most of the work.
    gains = {"best": 90.0, "second": 70.0, "third": 60.0, "fourth": 55.0, "idle": 3.0}
    assert _likely(gains, worth=88.0, count=3) == {"best", "second", "third"}
    assert _likely({"hopeless": -50.0}, worth=20.0, count=3) == set()


def test_one_offset_becomes_another_of_the_same_force_and_moment(fitter: Fitter) -> None:
    moment = fitter.polished(fitter.grown(fitter.base, "trim_moment", []))
    plane = retrimmed(fitter, moment, frozenset({"rudder_offset"}))
    assert plane.names == {"rudder_offset"}
    # The plane's zero is a force in heave as well, which this dive tells apart.
    assert fitter.base.bic - 100.0 > plane.bic > moment.bic
    known = dict(zip(plane.fit.structure.names, plane.fit.parameters, strict=True))
    assert 0.015 < known["rudder_zero"] * known["b2"] < 0.03


@pytest.mark.parametrize(
    "others", [(), ("munk_moment", "actuator_lag", "heave_pitch_rate_coupling", "speed_loss")]
)
def test_each_offset_is_tried_in_the_place_of_another(fitter: Fitter, others: tuple[str, ...]) -> None:
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        best = fitter.polished(fitter.grown(fitter.base, "rudder_offset", []))
        for name in others:
            best = fitter.grown(best, name, [])
        better = exchanged(search, search.remember(best), frozenset(others))
        offsets = ("trim_moment", "pitch_bias", "net_buoyancy", "vertical_current")
        assert all(frozenset({name, *others}) in search.tried for name in offsets)
        assert better.bic <= best.bic
        offset = next(iter(better.names - {*others}))
        assert "trim_moment" in {*better.names, *twins(search, better, offset)}


def test_a_neutral_depth_stands_still_beside_a_free_trim(fitter: Fitter) -> None:
    names = frozenset({FREE_TRIM.name, "depth_dependent_buoyancy"})
    with_trim = fitter.grown(fitter.root, "depth_dependent_buoyancy", [])
    assert fitter.free_parameters(names) == 3
    assert fitter.free_parameters(frozenset({"depth_dependent_buoyancy"})) == 2
    neutral = with_trim.fit.structure.names.index("neutral_depth")
    assert not with_trim.fit.free[neutral]
    # Without the trim the neutral depth takes its force over, so that nothing is lost.
    alone = retrimmed(fitter, with_trim, frozenset({"trim_moment"}))
    assert alone.fit.free[neutral]
    assert np.isclose(alone.fit.log_likelihood, with_trim.fit.log_likelihood, atol=3.0)


def test_what_acts_on_pitch_is_tried_in_the_place_of_a_moment(fitter: Fitter) -> None:
    """Beside a free trim it can gain nothing that a moment does, so that says nothing of it."""
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        moment = search.remember(fitter.polished(fitter.grown(fitter.base, "trim_moment", [])))
        assert exchanged(search, moment) is moment
        on_pitch = {e.name for e in fitter.candidates if e.slot == "pitch" and not e.changes}
        tried = {name for names in search.tried if len(names) == 1 for name in names}
        assert on_pitch >= {"pitch_quadratic_damping", "large_angle_restoring", "trim_moment"}
        assert on_pitch <= tried


def test_what_was_exchanged_before_is_not_exchanged_again() -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    names = frozenset({"net_buoyancy", "heave_quadratic_drag"})
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        best = fitter.base
        for name in sorted(names):
            best = fitter.grown(best, name, [])
        search.remember(fitter.polished(best))
        exchanged(search, best, settled=names)
        assert search.tried.keys() == {names}
        exchanged(search, best, settled=frozenset({"net_buoyancy"}))
        assert len(search.tried) > 2
        assert all("net_buoyancy" in tried for tried in search.tried if len(tried) == len(names))


@pytest.mark.parametrize("was_best", [True, False])
def test_only_what_came_near_on_a_part_is_tried_on_all(was_best: bool, fitter: Fitter) -> None:
    best = fitter.polished(fitter.grown(fitter.base, "trim_moment", []))
    with Workers(fitter, 1) as workers:
        part = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root, part)
        far, near = best.bic + ROUGH + 1.0, best.bic + ROUGH - 1.0
        for name, bic in (("rudder_offset", near), ("net_buoyancy", far), ("munk_moment", near)):
            part.remember(replace(fitter.grown(fitter.base, name, []), bic=bic))
        part.remember(replace(best, bic=best.bic if was_best else far))
        exchanged(search, search.remember(best))
    asked = {name for names in search.rivals for name in names}
    assert "rudder_offset" in asked
    assert ("net_buoyancy" in asked) is not was_best
