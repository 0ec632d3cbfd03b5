"""All that every vehicle has at once: where the search begins with it, and where with single effects."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.catalogue import ALONG_THE_HULL, DRIVE, FAINT, ORDINARY, structure_of
from host.catalogue.kin import OFFSETS
from host.catalogue.moments import SCANS
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
    IN_TIME,
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

SIMULATED = Path(__file__).parent.parent / "data" / "simulators" / "pvs_remus100__3211.csv"
FEW = frozenset({"actuator_lag", "free_trim"})
MANY = frozenset({*ORDINARY})


@pytest.fixture(scope="module")
def real() -> Fitter:
    """A simulator's REMUS 100, of which the base equations leave much."""
    return Fitter(read_recordings(SIMULATED, default_vehicle()))


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


def test_what_keeps_the_plane_back_is_tried_beside_all_as_changes_are(
    real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    likeliest = {"ballast_change": -30.0, "actuator_backlash": -40.0, "rudder_stall": -20.0}

    def grown(_: Fitter, parent: Explanation, name: str, __: list[Array]) -> Explanation:
        return Explanation(parent.names | {name}, parent.fit, likeliest.get(name, 0.0))

    def with_all(_: Fitter, one: Explanation) -> Explanation:
        beside.append(one.bic)
        return Explanation(one.names | {*ORDINARY}, one.fit, one.bic + pays)

    def by_fewer(_: Fitter, leading: Explanation, whole: Explanation, __: int) -> Explanation:
        again.append((leading.bic, whole.bic))
        return whole

    monkeypatch.setattr(Fitter, "grown", grown)
    monkeypatch.setattr(real, "at_first", {})
    monkeypatch.setattr(outset, "all_beside", with_all)
    monkeypatch.setattr(outset, "_by_fewer", by_fewer)
    monkeypatch.setattr(outset, "_is_no_chance", lambda *_: True)
    for pays in (-1.0, 1.0):
        beside: list[float] = []
        again: list[tuple[float, float]] = []
        found = min(outset._beside_what_leads(real, real.root, (*SCANS, *DRIVE), 1), key=lambda e: e.bic)
        assert beside == [-40.0, -30.0, -20.0]
        assert again == [(-40.0, -40.0 + pays)]  # the likeliest, as something is left
        assert "actuator_backlash" in found.names
        assert found.names.isdisjoint(ORDINARY) == (pays > 0.0)  # a textbook vehicle but for that


@pytest.mark.parametrize(
    ("name", "left", "is_white", "counts"),
    [
        ("unknown_swinging_moment", LITTLE - 0.1, False, True),
        ("unknown_swinging_moment", LITTLE + 0.1, False, False),  # of many waves it follows one
        ("unknown_swinging_moment", LITTLE + 0.1, True, True),
        ("rudder_stall", 4.9, False, True),
        ("rudder_stall", 5.1, False, False),
        ("ballast_change", 9.0, False, True),
    ],
)
def test_what_leads_must_be_more_than_a_part_of_a_sea(
    name: str, left: float, is_white: bool, counts: bool, real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    fit = real.base.fit
    monkeypatch.setattr(Explanation, "leaves_white", is_white)
    monkeypatch.setattr(Fitter, "grown", lambda *a: Explanation(a[1].names | {a[2]}, fit, 0.0))
    monkeypatch.setattr(real, "at_first", {})
    monkeypatch.setattr(outset, "all_beside", lambda _, one: one)
    monkeypatch.setattr(outset, "_by_fewer", lambda *a: a[2])
    monkeypatch.setattr(real, "excess", lambda of: left if of.noise is fit.noise else 10.0)
    found = outset._beside_what_leads(real, real.root, (name,), 1)
    assert {n for one in found for n in one.names} - real.root.names == ({name} if counts else set())


@pytest.mark.parametrize("gain", [1.0, -1.0])
def test_two_offsets_stand_for_a_free_trim_where_one_alone_is_worse(
    gain: float, real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    pair = frozenset({"rudder_offset", "net_buoyancy"})

    def retrimmed(_: Fitter, whole: Explanation, offsets: frozenset[str]) -> Explanation:
        worth = gain if offsets == pair else -9.0
        return Explanation(whole.names - {FREE_TRIM.name} | offsets, whole.fit, whole.bic - worth)

    monkeypatch.setattr(outset, "retrimmed", retrimmed)
    monkeypatch.setattr(Fitter, "polished", lambda _, one: one)
    monkeypatch.setattr(Explanation, "leaves_white", property(lambda one: one.names >= pair))
    monkeypatch.setattr(real, "excess", lambda _: 1.9)
    monkeypatch.setattr(
        outset, "_by_fewer", lambda *_: pytest.fail("nothing is left") if gain > 0.0 else whole
    )
    monkeypatch.setattr(outset, "_layers", lambda *_: [])
    whole = Explanation(frozenset({FREE_TRIM.name, "actuator_lag"}), real.root.fit, 0.0)
    found = outset.beside_what_leads(real, whole)
    assert (found.names >= pair) == (gain > 0.0)
    assert outset._with_two_offsets(real, replace(whole, names=frozenset({"actuator_lag"})), 1).bic == 0.0


@pytest.mark.parametrize("damping", [-0.5, -1e-4])
def test_what_leads_keeps_a_hull_at_its_heave(
    damping: float, real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    fit = real.base.fit
    hull = replace(fit, parameters=np.where(np.arange(fit.parameters.size) == 0, damping, fit.parameters))
    whole, led = Explanation(real.root.names, fit, 0.0), Explanation(real.root.names, hull, -9.0)
    monkeypatch.setattr(
        outset, "_each_alone", lambda *_: [Explanation(frozenset({"ballast_change"}), hull, -1.0)]
    )
    monkeypatch.setattr(outset, "all_beside", lambda _, one: one)
    monkeypatch.setattr(outset, "_with_two_offsets", lambda *_: whole)
    monkeypatch.setattr(outset, "_by_fewer", lambda *_: led)
    monkeypatch.setattr(outset, "_layers", lambda *_: [])
    monkeypatch.setattr(Explanation, "leaves_white", False)
    monkeypatch.setattr(real, "excess", lambda _: 0.5 * outset.LOST)
    found = outset.beside_what_leads(real, whole)
    assert (found.fit is hull) == (damping == -0.5)


@pytest.mark.parametrize(
    ("leads", "is_white", "left", "whole", "says_all"),
    [
        ("rudder_stall", True, MUCH - 0.1, 0.0, True),
        ("rudder_stall", True, MUCH + 0.1, 0.0, False),
        ("rudder_stall", True, MUCH - 0.1, -2.0, False),  # the whole is likelier
        ("rudder_stall", False, 1.1, 0.0, False),
        ("unknown_wandering_moment", True, 1.1, 0.0, False),  # which follows a turn as well
    ],
)
def test_one_effect_that_leaves_nothing_is_found_before_stretches_are_left_out(
    leads: str,
    is_white: bool,
    left: float,
    whole: float,
    says_all: bool,
    real: Fitter,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[str] = []

    def grown(_: Fitter, parent: Explanation, name: str, __: list[Array]) -> Explanation:
        asked.append(name)
        return Explanation(parent.names | {name}, parent.fit, -float(name == leads))

    monkeypatch.setattr(Fitter, "grown", grown)
    monkeypatch.setattr(real, "at_first", {})
    monkeypatch.setattr(real, "excess", lambda fit: 2.0 * MUCH if fit is far else left)
    monkeypatch.setattr(Explanation, "leaves_white", is_white)
    far = replace(real.root.fit)
    found = outset.one_that_says_all(real, Explanation(frozenset(), far, whole), 1)
    assert (found is not None and leads in found.names) == says_all
    monkeypatch.setattr(outset, "all_beside", lambda _, one: one)
    monkeypatch.setattr(outset, "_by_fewer", lambda *a: a[2])
    outset._beside_what_leads(real, real.root, (*DRIVE, *IN_TIME), 1)
    assert asked == [*SCANS, *DRIVE, *IN_TIME]  # each fitted once


@pytest.mark.parametrize(("left", "asked"), [(LITTLE - 0.1, []), (LITTLE + 0.1, [*DRIVE])])
def test_where_little_is_left_it_may_be_a_fault_of_the_drive_before_it_is_random_forces(
    left: float, asked: list[str], real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []

    def each(_: Fitter, names: tuple[str, ...], __: int) -> list[Explanation]:
        done.extend(names)
        return [Explanation(real.root.names | {name}, real.root.fit, -1.0) for name in names]

    monkeypatch.setattr(outset, "_each_alone", each)
    monkeypatch.setattr(real, "excess", lambda _: left)
    monkeypatch.setattr(Explanation, "leaves_white", True)
    found = outset.one_that_says_all(real, Explanation(frozenset(), real.root.fit, 0.0), 1)
    assert done == asked
    assert (found is not None) == bool(asked)


@pytest.mark.parametrize(("damping", "is_enough"), [(-0.5, True), (-0.015, False), (-20.0, False)])
def test_no_hull_that_hardly_heaves_is_enough_beside_forces(
    damping: float, is_enough: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    point = SimpleNamespace(parameters=np.array([damping, -1.0, -1.0, 0.4, -1.0, 2.0]))
    sea: Any = SimpleNamespace(bic=-100.0, fit=SimpleNamespace(end=point, samples=100))
    monkeypatch.setattr(outset, "as_filtered", lambda *_: SimpleNamespace(bic=0.0))
    monkeypatch.setattr(outset, "margin", lambda _: 6.0)
    monkeypatch.setattr(outset, "form_gains", lambda *_: {"unknown_force_w_w": 1.0})
    search: Any = SimpleNamespace(fitter=None, gains=lambda _: {"rudder_stall": 1.0})
    assert outset.is_enough_beside(search, sea, sea) == is_enough


@pytest.mark.parametrize(("left", "asked"), [(MUCH - 0.1, []), (MUCH + 0.1, [(*DRIVE, *IN_TIME)])])
def test_what_keeps_the_plane_back_is_asked_where_much_is_left(
    left: float, asked: list[tuple[str, ...]], real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[tuple[str, ...]] = []
    root_fit = real.root.fit
    monkeypatch.setattr(outset, "says_all", lambda *_: False)
    monkeypatch.setattr(outset, "_by_fewer", lambda *a: a[2])
    monkeypatch.setattr(outset, "_beside_what_leads", lambda _, __, names, ___: tried.append(names) or [])
    monkeypatch.setattr(real, "excess", lambda fit: 30.0 if fit is root_fit else left)
    assert led_at_the_outset(real) is not None
    assert tried == asked


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
