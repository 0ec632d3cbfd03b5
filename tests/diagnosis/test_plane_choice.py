"""Which way the plane is taken between rows, by what tells more than the base equations do."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from host.catalogue import ORDINARY
from host.diagnosis import plane_choice
from host.diagnosis.fits import sea_fits
from host.diagnosis.fits.margins import MUCH
from host.diagnosis.plane_choice import Way, likelier_first
from host.diagnosis.search import outset
from host.diagnosis.search.outset import LOST

MANY = frozenset({*ORDINARY})


def test_it_tells_which_way_the_plane_went(monkeypatch: pytest.MonkeyPatch) -> None:
    def way(root: float, there: float) -> Way:
        known = SimpleNamespace(bic=root, fit=2.0 * MUCH)
        fitter = SimpleNamespace(root=known, base=known, excess=lambda fit: fit, at_first={})
        fitter.there, fitter.polished = SimpleNamespace(bic=there, fit=0.1), lambda one: one
        return Way([], cast("Any", fitter))

    def order(*found: Way) -> list[int]:
        told = likelier_first([*found], lambda _: None, 1)
        return [[each.fitter for each in found].index(each.fitter) for each in told]

    monkeypatch.setattr(plane_choice, "_taken_so", lambda fitter, _: fitter.there)
    whole: Any = SimpleNamespace(bic=-10.0, names=MANY, leaves_white=True, fit=0.1)
    held, moved, worse = way(-2.0, np.nan), way(-1.0, -11.0), way(-1.0, -9.0)
    monkeypatch.setattr(plane_choice, "at_the_outset", lambda *_: whole)
    monkeypatch.setattr(plane_choice, "plain_waves", None)  # nothing is left to see
    monkeypatch.setattr(plane_choice, "beside_what_leads", lambda _, one, __: one)
    assert order(moved, held) == [0, 1]
    assert order(worse, held) == [1, 0]
    assert likelier_first([held], lambda _: None, 1)[0].outset is whole
    whole.leaves_white = False
    waves: Any = SimpleNamespace(bic=-20.0)
    monkeypatch.setattr(plane_choice, "plain_waves", lambda _: waves)
    monkeypatch.setattr(plane_choice, "_in_a_swell", lambda seen, _: seen)
    assert [each.outset for each in likelier_first([moved, held], lambda _: None, 1)] == [None, None]
    monkeypatch.setattr(plane_choice, "plain_waves", lambda _: None)
    led: Any = SimpleNamespace(bic=-40.0)
    monkeypatch.setattr(plane_choice, "_pushed_about", lambda *_: pytest.fail("asked of what a filter leads"))
    monkeypatch.setattr(plane_choice, "_led", lambda ways, *_: [ways[0]._replace(pushed=led)])
    assert likelier_first([moved, held], lambda _: None, 1)[0].pushed is led
    monkeypatch.setattr(plane_choice, "_led", lambda *_: [])
    monkeypatch.setattr(plane_choice, "_pushed_about", lambda *_: [])
    assert order(moved, held) == [0, 1]
    asked: list[Any] = []
    monkeypatch.setattr(plane_choice, "_led", lambda _, free, *__: asked.append(free) or [])
    assert likelier_first([held], lambda _: None, 1)[0].outset is whole
    assert asked == [whole]  # again only beside what leads
    leads: Any = SimpleNamespace(bic=-11.0, names=MANY | {"ballast_change"}, leaves_white=False, fit=0.1)
    monkeypatch.setattr(plane_choice, "beside_what_leads", lambda *_: leads)
    likelier_first([held], lambda _: None, 1)
    assert asked == [whole, whole, leads]
    monkeypatch.setattr(plane_choice, "beside_what_leads", lambda _, one, __: one)
    pushed: Any = SimpleNamespace(bic=-30.0)
    monkeypatch.setattr(plane_choice, "_pushed_about", lambda ways, *_: [ways[0]._replace(pushed=pushed)])
    (first,) = likelier_first([held], lambda _: None, 1)
    assert first.pushed is pushed  # which is asked where something is left
    assert first.outset is whole  # if it is not believed
    monkeypatch.setattr(plane_choice, "at_the_outset", lambda *_: None)
    monkeypatch.setattr(plane_choice, "by_single_effects", lambda found, *_: found[::-1])
    assert order(moved, held) == [1, 0]


@pytest.mark.parametrize(
    ("left", "gained", "is_told"), [(0.1, 90.0, False), (2.0, 40.0, False), (2.0, 60.0, True)]
)
def test_where_forces_lead_they_tell_which_way_the_plane_went(
    monkeypatch: pytest.MonkeyPatch, left: float, gained: float, is_told: bool
) -> None:
    fitters = [SimpleNamespace(sea=-gained, excess=lambda _: left), SimpleNamespace(sea=-gained - 1.0)]
    found = [Way([], cast("Any", fitter)) for fitter in fitters]
    whole: Any = SimpleNamespace(bic=0.0, fit=None)
    other: Any = SimpleNamespace(bic=1.0)
    monkeypatch.setattr(plane_choice, "_taken_so", lambda *_: other)
    monkeypatch.setattr(sea_fits, "as_filtered", lambda _, one: one)
    forced = SimpleNamespace(samples=100)
    monkeypatch.setattr(plane_choice, "with_sea", lambda f, _: SimpleNamespace(bic=f.sea, fit=forced))
    seen = plane_choice._as_seen_under_forces(found, whole)
    assert seen == ([(found[1], other), (found[0], whole)] if is_told else [])
    assert not plane_choice._as_seen_under_forces(found[:1], whole)  # with nothing to choose from


def test_no_stretch_is_left_out_of_what_one_effect_explains(monkeypatch: pytest.MonkeyPatch) -> None:
    fitter: Any = SimpleNamespace(
        root=SimpleNamespace(bic=0.0), excess=lambda fit: fit, polished=lambda one: one
    )
    whole: Any = SimpleNamespace(bic=0.0, fit=2.0 * LOST, names=MANY, leaves_white=False)
    stall: Any = SimpleNamespace(bic=-9.0, fit=0.1, names={"rudder_stall"}, leaves_white=True)
    monkeypatch.setattr(plane_choice, "at_the_outset", lambda _: whole)
    monkeypatch.setattr(plane_choice, "one_that_says_all", lambda *_: stall)
    monkeypatch.setattr(plane_choice, "at_several_speeds", lambda *_: pytest.fail("it is explained"))
    monkeypatch.setattr(plane_choice, "_in_short_runs", lambda *_: pytest.fail("it is explained"))
    monkeypatch.setattr(plane_choice, "beside_what_leads", lambda *_: pytest.fail("it leads"))
    monkeypatch.setattr(plane_choice, "plain_waves", lambda _: None)
    monkeypatch.setattr(plane_choice, "leads_on", lambda *_: True)
    monkeypatch.setattr(plane_choice, "_led", lambda *_: [])
    monkeypatch.setattr(plane_choice, "_pushed_about", lambda *_: [])
    (way,) = likelier_first([Way([], fitter)], lambda _: None, 1, may_leave_out=True)
    assert way.outset is stall


@pytest.mark.parametrize("left", [0.5 * LOST, 2.0 * LOST])
def test_several_speeds_are_asked_for_where_no_single_change_is_all_and_more_is_left_than_a_hull_does(
    monkeypatch: pytest.MonkeyPatch, left: float
) -> None:
    whole: Any = SimpleNamespace(bic=0.0, fit=left, names=MANY, leaves_white=False)
    told: Any = SimpleNamespace(bic=-9.0, fit=0.1, names=MANY, leaves_white=True)
    short = [Way([], cast("Any", None))]
    monkeypatch.setattr(plane_choice, "at_the_outset", lambda _: whole)
    monkeypatch.setattr(plane_choice, "one_that_says_all", lambda *_: None)
    monkeypatch.setattr(plane_choice, "one_says_most", lambda *_: False)
    monkeypatch.setattr(plane_choice, "beside_what_leads", lambda _, one, __: one)
    monkeypatch.setattr(plane_choice, "at_several_speeds", lambda *_: told)
    monkeypatch.setattr(plane_choice, "_in_short_runs", lambda _, whole, *__: (short, whole))
    monkeypatch.setattr(plane_choice, "_among_waves", lambda _: [])
    monkeypatch.setattr(plane_choice, "_led", lambda *_: [])
    fitter: Any = SimpleNamespace(root=SimpleNamespace(bic=0.0), excess=lambda fit: fit, at_first={})
    found = likelier_first([Way([], fitter)], lambda _: None, 1, may_leave_out=True)
    assert [way.outset for way in found] == [told if left > LOST else None]


def test_where_one_effect_says_most_the_search_begins_with_single_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole: Any = SimpleNamespace(bic=0.0, fit=2.0 * LOST, names=MANY, leaves_white=False)
    ballast: Any = SimpleNamespace(bic=-9.0, fit=1.3, names={"ballast_change"}, leaves_white=False)
    monkeypatch.setattr(plane_choice, "at_the_outset", lambda _: whole)
    monkeypatch.setattr(plane_choice, "one_that_says_all", lambda *_: None)
    monkeypatch.setattr(outset, "_each_alone", lambda *_: [])  # but what led already
    monkeypatch.setattr(plane_choice, "_among_waves", lambda _: [])
    monkeypatch.setattr(plane_choice, "_led", lambda *_: pytest.fail("a free run follows it"))
    monkeypatch.setattr(plane_choice, "_in_short_runs", lambda *_: pytest.fail("it is no turn"))
    fitter: Any = SimpleNamespace(
        root=SimpleNamespace(bic=0.0), excess=lambda fit: fit, at_first={"alone": ballast}
    )
    (way,) = likelier_first([Way([], fitter)], lambda _: None, 1, may_leave_out=True)
    assert way.outset is None
    assert way.pushed is None


@pytest.mark.parametrize("left", [0.5 * MUCH, 2.0 * MUCH])
def test_no_filter_is_asked_without_what_leads_where_that_leaves_nothing(
    monkeypatch: pytest.MonkeyPatch, left: float
) -> None:
    asked: list[Any] = []
    whole: Any = SimpleNamespace(bic=0.0, fit=2.0 * LOST, names=MANY, leaves_white=False)
    beside: Any = SimpleNamespace(bic=-9.0, fit=left, names=MANY | {"actuator_delay"}, leaves_white=True)
    monkeypatch.setattr(plane_choice, "at_the_outset", lambda _: whole)
    monkeypatch.setattr(plane_choice, "one_that_says_all", lambda *_: None)
    monkeypatch.setattr(plane_choice, "one_says_most", lambda *_: False)
    monkeypatch.setattr(plane_choice, "beside_what_leads", lambda *_: beside)
    monkeypatch.setattr(plane_choice, "at_several_speeds", lambda _, one: one)
    monkeypatch.setattr(plane_choice, "_in_short_runs", lambda _, one, *__: (asked.append(one) or [], one))
    monkeypatch.setattr(plane_choice, "_among_waves", lambda _: [])
    monkeypatch.setattr(plane_choice, "_led_by_a_filter", lambda _, hull, *__: asked.append(hull) or [])
    monkeypatch.setattr(plane_choice, "_astray", lambda *_: [])
    monkeypatch.setattr(plane_choice, "_pushed_about", lambda *_: [])
    monkeypatch.setattr(plane_choice, "stretches_apart", lambda *_, **__: SimpleNamespace(spans=[]))
    monkeypatch.setattr(plane_choice, "short_runs", lambda *_: None)
    fitter: Any = SimpleNamespace(
        root=SimpleNamespace(bic=0.0, fit=2 * LOST), excess=lambda fit: fit, at_first={}, polished=lambda e: e
    )
    (way,) = likelier_first([Way([], fitter)], lambda _: None, 1, may_leave_out=True)
    assert way.outset is beside
    first = [] if left < MUCH else [whole, whole]  # the filter, then short runs
    assert asked == [*first, beside]  # and the filter beside what leads, which declines what leaves nothing
