"""What leads where all that every vehicle has leaves something: a change, the drive, offsets, a swing."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from host.catalogue import DRIVE, ORDINARY
from host.catalogue.moments import SCANS
from host.catalogue.nuisance import FREE_TRIM
from host.catalogue.unknown import LEADING_FORMS
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import LITTLE, MUCH
from host.diagnosis.search import outset
from host.diagnosis.search.outset import (
    IN_TIME,
    at_the_outset,
)
from host.recordings.recording import Array


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
        ("unknown_moment_by_direction", True, 1.1, 0.0, True),  # which does not
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
    outset._beside_what_leads(real, real.root, (*DRIVE, *LEADING_FORMS, *IN_TIME), 1)
    assert asked == [*SCANS, *DRIVE, *LEADING_FORMS, *IN_TIME]  # each fitted once


@pytest.mark.parametrize(
    ("name", "bic", "left", "whole", "says_most"),
    [
        ("ballast_change", -9.0, 1.3, 40.0, True),
        ("ballast_change", -9.0, 2.5, 40.0, False),
        ("ballast_change", 9.0, 1.3, 40.0, False),
        ("ballast_change", -9.0, 1.3, 1.5, False),  # so does all that every vehicle has
        ("unknown_wandering_force", -9.0, 1.3, 40.0, False),  # as it follows turns
    ],
)
def test_one_effect_of_the_catalogue_may_say_most(
    monkeypatch: pytest.MonkeyPatch, name: str, bic: float, left: float, whole: float, says_most: bool
) -> None:
    alone: Any = SimpleNamespace(bic=bic, fit=left, names=frozenset({FREE_TRIM.name, name}))
    fitter: Any = SimpleNamespace(excess=lambda fit: fit, at_first={alone.names: alone})
    monkeypatch.setattr(outset, "_each_alone", lambda *_: [])
    assert outset.one_says_most(fitter, cast("Any", SimpleNamespace(bic=0.0, fit=whole)), 1) is says_most


def test_what_is_of_no_hull_is_asked_alone_only_where_a_hull_leaves_much(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    buoyancy: Any = SimpleNamespace(bic=-9.0, fit=1.1, names=frozenset({"depth_dependent_buoyancy"}))
    fitter: Any = SimpleNamespace(excess=lambda fit: fit, at_first={})
    asked: list[str] = []

    def each_alone(fitter: Any, names: tuple[str, ...], _: int) -> None:
        asked.extend(names)
        fitter.at_first[buoyancy.names] = buoyancy

    monkeypatch.setattr(outset, "_each_alone", each_alone)
    assert not outset.one_says_most(fitter, cast("Any", SimpleNamespace(bic=0.0, fit=MUCH - 0.1)), 1)
    assert not asked
    assert outset.one_says_most(fitter, cast("Any", SimpleNamespace(bic=0.0, fit=MUCH + 0.1)), 1)
    assert asked == [*outset.NO_HULL]


@pytest.mark.parametrize(("left", "asked"), [(LITTLE - 0.1, []), (LITTLE + 0.1, [*DRIVE, *LEADING_FORMS])])
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


@pytest.mark.parametrize(
    ("left", "asked"), [(MUCH - 0.1, []), (MUCH + 0.1, [(*DRIVE, *LEADING_FORMS, *IN_TIME)])]
)
def test_what_keeps_the_plane_back_is_asked_where_much_is_left(
    left: float, asked: list[tuple[str, ...]], real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[tuple[str, ...]] = []
    root_fit = real.root.fit
    monkeypatch.setattr(outset, "says_all", lambda *_: False)
    monkeypatch.setattr(outset, "_by_fewer", lambda *a: a[2])
    monkeypatch.setattr(outset, "_beside_what_leads", lambda _, __, names, ___: tried.append(names) or [])
    monkeypatch.setattr(real, "excess", lambda fit: 30.0 if fit is root_fit else left)
    whole = at_the_outset(real)
    assert whole is not None
    outset.beside_what_leads(real, whole)
    assert tried == asked
