"""All that every vehicle has at once: where the search begins with it, and where with single effects."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.catalogue import ALONG_THE_HULL, FAINT, ORDINARY, structure_of
from host.catalogue.kin import OFFSETS
from host.catalogue.nuisance import FREE_TRIM
from host.catalogue.unknown import IN_LAYERS
from host.diagnosis.diagnose import diagnose
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import LITTLE, MUCH, ROUGH
from host.diagnosis.fits.trims import retrimmed
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search import outset
from host.diagnosis.search import search as module
from host.diagnosis.search.outset import (
    FAR_LESS,
    LOST,
    at_the_outset,
    beside_what_leads,
    leads_on,
)
from host.diagnosis.search.search import Search
from host.diagnosis.search.whole_vehicle import ended
from host.likelihood.gauss_newton import Point
from host.recordings.read import read_recordings
from host.recordings.recording import Array, Recording
from host.vehicle import default_vehicle
from tools.sitl.recording import write_csv
from tools.trial.deck import Card
from tools.trial.draw import draw

FEW = frozenset({"actuator_lag", "free_trim"})
MANY = frozenset({*ORDINARY})


def ballast(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return (0.15 if time > 30.0 else 0.0), 0.0, 0.0


def swell(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return 0.0, 0.0, 0.3 * np.sin(2.0 * np.pi * time / 20.0)


def layer(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return 0.15 / np.cosh((x[3] - 24.0) / 3.0) ** 2, 0.0, 0.0


def led_at_the_outset(fitter: Fitter) -> Explanation | None:
    whole = at_the_outset(fitter)
    return None if whole is None else beside_what_leads(fitter, whole)


def test_of_a_real_vehicle_all_that_every_one_has_leaves_nothing(real: Fitter) -> None:
    found = at_the_outset(real)
    assert found is not None
    assert {*ORDINARY} < found.names
    assert real.excess(real.root.fit) > 10.0
    assert real.excess(found.fit) < LITTLE
    assert found.leaves_white


def test_what_leaves_nothing_of_an_excerpt_goes_on_from_there(
    real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    def halves(runs: list[Recording]) -> list[Recording]:
        (run,) = runs
        middle = run.time[run.time.size // 2]
        return [run.between(-np.inf, middle), run.between(middle, np.inf)]

    monkeypatch.setattr(outset, "led_excerpt", halves)
    led = outset._as_a_part_tells(real, outset.names_of_all(real))
    assert led is not None
    assert len(led.fit.initial) == len(real.recordings)
    assert real.excess(led.fit) < LITTLE
    monkeypatch.setattr(outset, "ends_of", lambda part, _: iter([part.root]))
    assert outset._as_a_part_tells(real, outset.names_of_all(real)) is None


def test_where_something_else_acts_as_well_it_leaves_far_less(
    real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = at_the_outset(real)
    monkeypatch.setattr(Explanation, "leaves_white", property(lambda _: False))
    found = at_the_outset(real)
    assert told is not None
    assert found is not None
    trims = {ALONG_THE_HULL, FREE_TRIM.name, *OFFSETS}
    assert found.names - trims == told.names - trims
    assert real.excess(found.fit) < FAR_LESS * real.excess(real.root.fit)


@pytest.mark.parametrize("is_likelier", [True, False])
def test_an_offset_takes_the_place_of_the_free_trim_where_that_cannot_do_its_work(
    is_likelier: bool, real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = at_the_outset(real)
    assert whole is not None

    def with_offset(fitter: Fitter, one: Explanation, offsets: frozenset[str]) -> Explanation:
        found = retrimmed(fitter, one, offsets)
        gain = 1e6 if is_likelier and offsets == {"rudder_offset"} else -1e6
        return Explanation(found.names, found.fit, found.bic - gain)

    monkeypatch.setattr(outset, "retrimmed", with_offset)
    found = outset._by_fewer(real, real.root, whole, 1)
    assert ("rudder_offset" in found.names) == is_likelier
    assert (FREE_TRIM.name in found.names) != is_likelier
    assert found.names >= whole.names - {FREE_TRIM.name}
    lost = lambda _, __, names: Explanation(names, real.root.fit, 0.0)  # noqa: E731
    poor = lambda fitter, at, names: (lost if {*FAINT} & names else ended)(fitter, at, names)  # noqa: E731
    monkeypatch.setattr(outset, "ended", poor)
    assert outset._by_fewer(real, real.root, whole, 1).names.isdisjoint(
        FAINT
    )  # what ended below its part is of no use


@pytest.mark.long
@pytest.mark.parametrize(
    ("number", "hidden"),
    [(1, ("rudder_offset",)), (3, ("surface_waves", "actuator_backlash"))],
    ids=["a bent plane", "play of a plane, in waves"],
)
def test_what_acts_on_a_drawn_vehicle_is_found_beside_all_that_it_has(
    number: int, hidden: tuple[str, ...], tmp_path: Path
) -> None:
    card = Card("one" if len(hidden) == 1 else "two", hidden)
    write_csv(tmp_path / "dive.csv", draw(77201, number, card, "usual").table)
    fitter = Fitter(read_recordings(tmp_path / "dive.csv", default_vehicle()))
    found = led_at_the_outset(fitter)
    assert found is not None
    assert hidden[-1] in found.names
    assert leads_on(fitter, found)


def test_a_textbook_vehicle_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    fitter = Fitter([hidden_dive()])
    assert fitter.excess(fitter.root.fit) < MUCH
    monkeypatch.setattr(fitter, "fitted", None)
    assert at_the_outset(fitter) is None


@pytest.mark.long
def test_where_it_leads_nowhere_something_may_have_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    fitter = Fitter([hidden_dive(ballast, duration=60.0)])
    assert fitter.excess(fitter.root.fit) > LOST
    found = led_at_the_outset(fitter)
    assert found is not None
    assert "ballast_change" in found.names
    assert found.leaves_white
    assert leads_on(fitter, found)
    monkeypatch.setattr(outset, "_beside_what_leads", lambda *_: [])
    monkeypatch.setattr(outset, "_layers", lambda *_: [])
    nowhere = led_at_the_outset(fitter)
    assert nowhere is not None
    assert not leads_on(fitter, nowhere)


@pytest.mark.long
def test_what_goes_with_the_depth_joins_where_it_promises_most(monkeypatch: pytest.MonkeyPatch) -> None:
    fitter = Fitter([hidden_dive(layer, duration=100.0)])
    whole = at_the_outset(fitter)
    assert whole is not None
    assert outset._layers(fitter, whole) == sorted(IN_LAYERS)
    found = led_at_the_outset(fitter)
    assert found is not None
    assert "unknown_force_in_layers" in found.names
    assert leads_on(fitter, found)
    search: Any = SimpleNamespace(fitter=fitter)
    monkeypatch.setattr(outset, "with_sea", None)  # no forces are to stand for it
    assert outset.pushed_by_forces(search, found) is None
    monkeypatch.setattr(outset, "form_gains", lambda *_: dict.fromkeys(IN_LAYERS, 50.0) | {"other": 51.0})
    assert outset._layers(fitter, whole) == []


def test_where_it_leads_nowhere_water_may_swing() -> None:
    fitter = Fitter([hidden_dive(swell, duration=60.0)])
    assert fitter.excess(fitter.root.fit) > LOST
    found = led_at_the_outset(fitter)
    assert found is not None
    assert "internal_wave" in found.names
    assert leads_on(fitter, found)


@pytest.mark.parametrize(
    ("pays", "a1", "left", "with_form", "said"),
    [
        (MANY, -0.6, 1.3, 1.4, ["concluded"]),  # of white noise, whose size the sensors show too small
        (MANY, -0.6, 1.1, 1.4, ["concluded"]),
        (FEW, -0.6, 1.0, 1.4, ["singles", "concluded"]),
        (MANY, -1e-6, 1.1, 1.4, ["singles", "concluded"]),
        (MANY, -0.6, 1.4, 1.4, ["singles", "concluded"]),
        (MANY, -0.6, 1.4, 1.3, ["concluded"]),
        (FEW, -0.6, 1.4, 1.3, ["singles", "concluded"]),
    ],
    ids=["white", "little", "few", "no damping", "something left", "a form", "a form beside few"],
)
def test_a_search_goes_on_with_many_or_begins_with_single_effects(
    pays: frozenset[str],
    a1: float,
    left: float,
    with_form: float,
    said: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def found(names: frozenset[str], left: float = left) -> Any:
        hull = np.array([a1, -3.4, -8.2, 0.4, -3.9, 2.5])
        fit, white = (
            SimpleNamespace(left=left, end=Point(structure_of(()), hull, [], np.zeros(4))),
            left == 1.3,
        )
        return SimpleNamespace(names=names, bic=left, fit=fit, leaves_white=white, lean=lambda: found(names))

    calls: list[str] = []
    monkeypatch.setattr(outset, "_with_a_form", lambda _, whole: found(whole.names, with_form))
    monkeypatch.setattr(outset, "with_more", lambda _, best, **__: best)
    monkeypatch.setattr(outset, "_in_another_valley", lambda *_: None)
    monkeypatch.setattr(outset, "pruned", lambda *_: found(pays))
    monkeypatch.setattr(module, "beam_search", lambda _: calls.append("singles"))
    monkeypatch.setattr(Search, "_concluded", lambda _: calls.append("concluded") or found(MANY))
    single = found(frozenset({"free_trim", "actuator_delay"}), left + 61.0)
    monkeypatch.setattr(Search, "singles", lambda _: [single])
    fitter: Any = SimpleNamespace(excess=lambda fit: fit.left)
    root, base = found(frozenset({"free_trim"})), found(frozenset())
    search = Search(fitter, cast("Any", None), lambda _: None, base, root, outset=found(MANY))
    search.run()
    assert calls == said
    assert bool(search.joint) is (said == ["concluded"])
    if said == ["concluded"]:
        single.bic = left + 59.0  # by its rough fit; many may do the work of one
        search.run()
        assert calls[1:] == ["concluded", "singles", "concluded"]


def test_what_is_lacking_may_join_in_the_other_valley_of_a_lag_and_a_pole(
    real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The likelier one lacks more: there nothing joins that leaves as little."""
    here, there, end = (
        SimpleNamespace(names=MANY, bic=bic, leaves_white=True) for bic in (-100.0, -80.0, -150.0)
    )
    monkeypatch.setattr(outset, "_in_another_valley", lambda *_: there)
    monkeypatch.setattr(outset, "with_more", lambda _, best, **__: end if best is there else best)
    asked: list[Any] = []
    monkeypatch.setattr(outset, "pruned", lambda _, one: asked.append(one) or one)
    monkeypatch.setattr(outset, "_is_of_a_hull", lambda _: True)
    search = Search(real, cast("Any", None), lambda _: None, real.base, real.root)
    monkeypatch.setattr(Search, "remember", lambda _, one: one)
    assert outset.goes_on_from(search, cast("Any", here))
    assert asked == [end]


def test_another_valley_is_as_likely_and_apart(real: Fitter, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = at_the_outset(real)
    assert whole is not None
    far = replace(whole, bic=whole.bic + 2.0 * ROUGH + 1.0)
    near = replace(whole, bic=whole.bic + 1.0)
    search = Search(real, Workers(real, 1), lambda _: None, real.base, real.root)
    a2 = whole.fit.structure.names.index("a2")
    traded = whole.fit.parameters * np.where(np.arange(whole.fit.parameters.size) == a2, 2.5, 1.0)
    same, near = near, replace(near, fit=replace(near.fit, parameters=traded))
    monkeypatch.setattr(Fitter, "polished", lambda _, one: one)
    ends = iter([far, near, same])
    monkeypatch.setattr(outset, "look_alikes", lambda _: [1, 2, 3])
    monkeypatch.setattr(Fitter, "entered", lambda *_: next(ends))
    assert outset._in_another_valley(search, whole) is near
    ends = iter([far, same, far])
    assert outset._in_another_valley(search, whole) is None


@pytest.mark.parametrize("is_white", [True, False])
def test_a_form_beside_all_that_every_vehicle_has_must_leave_white_noise(
    is_white: bool, real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    search = Search(real, Workers(real, 1), lambda _: None, real.base, real.root)
    monkeypatch.setattr(outset, "form_gains", lambda *_: {"unknown_force_w_w": 1e3, "unknown_force_w_q": 0.0})
    monkeypatch.setattr(Explanation, "leaves_white", property(lambda _: is_white))
    found = outset._with_a_form(search, search.remember(real.root))
    assert found.names - real.root.names == ({"unknown_force_w_w"} if is_white else set())


@pytest.mark.long
def test_a_diagnosis_begins_with_it_and_ranks_what_pays(real: Fitter) -> None:
    said: list[str] = []
    found = diagnose(real.recordings, said.append)
    named = [effect.name for effect in found.effects]
    assert not any(line.startswith("2 effects") for line in said)
    assert found.verdict == "explained"
    assert "heave_pitch_rate_coupling" in named
    assert "munk_moment" not in named  # which this simulator has not
    assert found.is_ranked_alone
    assert {*named} <= {name for name, _ in found.ranking}
