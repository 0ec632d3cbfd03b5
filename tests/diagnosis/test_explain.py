"""In which order a diagnosis asks: with what it begins, waves that are plain to see, what joined late."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, cast

import pytest

from host.diagnosis import explain as module
from host.diagnosis.disturbances.seas import Explained
from host.diagnosis.explain import _alike, _many_in
from host.diagnosis.fits.margins import LARGEST_SET, LITTLE
from host.diagnosis.plane_choice import Way
from host.diagnosis.search.beam import _is_explained_otherwise, _needs_many
from host.diagnosis.search.search import Search

MANY = frozenset(f"effect {number}" for number in range(LARGEST_SET + 1))


def explanation(names: frozenset[str], has_process_noise: bool = False) -> Any:
    return SimpleNamespace(names=names, fit=SimpleNamespace(has_process_noise=has_process_noise))


def fitter_that_leaves(excess: float) -> Any:
    return SimpleNamespace(refitted=lambda one: one, excess=lambda _: excess)


def test_a_set_of_many_effects_that_leaves_little_is_begun_with() -> None:
    like = explanation(MANY)
    assert _alike(fitter_that_leaves(LITTLE - 0.1), like) == [like]


@pytest.mark.parametrize(
    ("like", "excess"),
    [
        (None, 1.0),
        (explanation(MANY), LITTLE + 0.1),  # the vehicles differ by more than a member
        (explanation(frozenset({"actuator_lag"})), 1.0),  # searched for as quickly
        (explanation(MANY, has_process_noise=True), 1.0),  # a simulation has no sea
    ],
    ids=["unknown", "far", "few", "in a sea"],
)
def test_else_the_search_begins_anew(like: Any, excess: float) -> None:
    assert _alike(fitter_that_leaves(excess), like) == []


@pytest.mark.parametrize(
    ("names", "is_white", "excess", "is_begun_with"),
    [
        (MANY, True, 1.3, True),
        (MANY, False, LITTLE - 0.1, True),
        (MANY, False, LITTLE + 0.1, False),
        (frozenset({"actuator_lag"}), True, 1.0, False),
    ],
    ids=["white", "little", "not all", "few"],
)
def test_what_was_found_beside_drift_is_begun_with_where_it_is_many_effects(
    names: frozenset[str], is_white: bool, excess: float, is_begun_with: bool
) -> None:
    best: Any = SimpleNamespace(names=names, leaves_white=is_white, bic=-2.0, fit=None)
    worse: Any = SimpleNamespace(names=MANY, leaves_white=True, bic=-1.0)
    assert _many_in(fitter_that_leaves(excess), [worse, best]) == [best] * is_begun_with


NOTHING, MUCH_LEFT = (SimpleNamespace(is_nothing=one, is_by_speed=False) for one in (True, False))
ORDINARY_SET = explanation(frozenset({"munk_moment", "actuator_lag"}))
RARE_SET = explanation(frozenset({"munk_moment", "actuator_delay"}))
IN_WAVES = Explained(cast("Any", explanation(frozenset())), cast("Any", None), cast("Any", NOTHING), None)


def explained(
    monkeypatch: pytest.MonkeyPatch,
    found: Any,
    *,
    left: Any = NOTHING,
    waves: Any = None,
    led: Any = None,
    needs_many: bool = False,
    apart: tuple[tuple[float, float], ...] = (),
    excess: float = 2.0,
) -> Any:
    """What `explain` makes of a search that finds this, and whether that was for few effects, if it asked."""
    was_for_few = []

    def run(search: Search, _: Any) -> Any:
        if needs_many:
            was_for_few.append(search.instead())
        return found

    monkeypatch.setattr(Search, "run", run)
    monkeypatch.setattr(module, "leftover", lambda *_: next(left) if isinstance(left, Iterator) else left)
    monkeypatch.setattr(module, "led_astray", lambda *_: led)
    monkeypatch.setattr(module, "unknown_in", lambda one: [n for n in one.names if n.startswith("unknown_")])
    monkeypatch.setattr(module, "leanest", lambda _, best: best)
    fitter: Any = SimpleNamespace(base=None, root=None, excess=lambda _: excess)
    way = Way([], fitter, waves=waves, apart=apart)
    return module.explain(fitter, cast("Any", None), lambda _: None, way), was_for_few


@pytest.mark.parametrize(("form", "asked"), [((), True), (("unknown_force_w_q",), False)])
def test_a_rare_effect_that_joins_late_is_asked_unless_a_form_competes(
    form: tuple[str, ...], asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    late = explanation(RARE_SET.names | {*form})
    monkeypatch.setattr(module, "with_unknown", lambda *_: late)
    monkeypatch.setattr(module, "told_by_the_usual", lambda *_: ORDINARY_SET)
    monkeypatch.setattr(module, "in_a_sea", lambda search, best: (search, best))
    monkeypatch.setattr(module, "among_waves", lambda search, best, _: (search, best, None))
    monkeypatch.setattr(module, "among_drift", lambda *_: None)
    answer, _ = explained(monkeypatch, explanation(frozenset({"munk_moment"})))
    assert answer.best is (ORDINARY_SET if asked else late)


@pytest.mark.parametrize(
    ("left", "needs_many", "searches", "is_in_waves"),
    [(NOTHING, False, 0, False), (NOTHING, True, 1, False), (MUCH_LEFT, False, 1, True)],
    ids=["explained by few", "in place of a dozen", "not explained"],
)
def test_waves_that_are_plain_to_see_are_searched_once_where_they_matter(
    left: Any, needs_many: bool, searches: int, is_in_waves: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = []
    monkeypatch.setattr(module, "in_plain_waves", lambda *_: begun.append(1) or IN_WAVES)
    monkeypatch.setattr(module, "against", lambda plain, *_: plain)
    monkeypatch.setattr(module, "with_unknown", lambda _, best: best)
    waves = explanation(frozenset())
    answer, was_for_few = explained(monkeypatch, ORDINARY_SET, left=left, waves=waves, needs_many=needs_many)
    assert was_for_few == [True] * needs_many
    assert len(begun) == searches
    assert (answer is IN_WAVES) is is_in_waves


@pytest.mark.parametrize("is_for_few", [False, True])
def test_what_a_few_explain_among_waves_needs_no_continuation(is_for_few: bool) -> None:
    one: Any = explanation(frozenset())
    search = Search(
        fitter_that_leaves(3.0), cast("Any", None), lambda _: None, one, one, instead=lambda: is_for_few
    )
    assert _needs_many(search, one, 2)
    assert _is_explained_otherwise(search, one) is is_for_few
    assert search.is_needless is is_for_few


@pytest.mark.parametrize("is_pushed", [False, True])
def test_no_form_of_unknown_physics_is_asked_where_no_free_run_comes_near(
    is_pushed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    monkeypatch.setattr(Search, "is_pushed_about", is_pushed)
    monkeypatch.setattr(module, "with_unknown", lambda _, best: asked.append(best) or best)
    monkeypatch.setattr(module, "in_a_sea", lambda search, _: (search, RARE_SET))
    monkeypatch.setattr(module, "among_waves", lambda search, best, _: (search, best, None))
    monkeypatch.setattr(module, "among_drift", lambda *_: None)
    answer, _ = explained(monkeypatch, ORDINARY_SET, left=MUCH_LEFT)
    assert answer.best is RARE_SET
    assert asked == ([] if is_pushed else [ORDINARY_SET])


@pytest.mark.parametrize(("excess", "is_asked"), [(1.1, False), (1.3, True)])
def test_what_remains_of_turns_is_no_physics_outside_the_catalogue(
    excess: float, is_asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    monkeypatch.setattr(module, "with_unknown", lambda _, best: asked.append(best) or best)
    monkeypatch.setattr(module, "in_a_sea", lambda search, best: (search, best))
    monkeypatch.setattr(module, "among_waves", lambda search, best, _: (search, best, None))
    monkeypatch.setattr(module, "among_drift", lambda *_: None)
    explained(monkeypatch, ORDINARY_SET, left=MUCH_LEFT, apart=((75.0, 125.0),), excess=excess)
    assert bool(asked) is is_asked


@pytest.mark.parametrize(
    ("is_stable", "name", "bic", "is_led"),
    [
        (True, "unknown_wandering_moment", -90.0, False),
        (True, "unknown_wandering_moment", -70.0, True),
        (True, "munk_moment", -90.0, True),
        (False, "unknown_wandering_moment", -90.0, True),
    ],
    ids=["likelier", "less likely", "no form", "an unstable hull"],
)
def test_what_wanders_is_not_excused_by_errors_of_the_speed(
    is_stable: bool, name: str, bic: float, is_led: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    by_speed, form = explanation(frozenset({"trim_moment"})), explanation(frozenset({name}))
    by_speed.bic, form.bic = -80.0, bic
    monkeypatch.setattr(module, "is_stable", lambda _: is_stable)
    monkeypatch.setattr(module, "with_unknown", lambda *_: form)
    monkeypatch.setattr(module, "as_filtered", lambda _, one: one)
    monkeypatch.setattr(module, "told_by_the_usual", lambda _, one: one)
    monkeypatch.setattr(module, "in_a_sea", lambda search, best: (search, best))
    monkeypatch.setattr(module, "among_waves", lambda search, best, _: (search, best, None))
    monkeypatch.setattr(module, "among_drift", lambda *_: None)
    lefts = iter([MUCH_LEFT, NOTHING, *[NOTHING] * 9])
    monkeypatch.setattr(Search, "is_pushed_about", False)
    answer, _ = explained(monkeypatch, ORDINARY_SET, left=lefts, led=("at sea", by_speed))
    assert (answer.best is by_speed) is is_led


@pytest.mark.parametrize(
    ("left_among_forces", "is_by_speed", "is_asked"),
    [(NOTHING, False, True), (MUCH_LEFT, False, False), (NOTHING, True, False)],
    ids=["nothing is left", "something is", "errors of the speed"],
)
def test_forms_are_asked_again_beside_forces_that_leave_nothing(
    left_among_forces: Any, is_by_speed: bool, is_asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    forced = explanation(frozenset({"munk_moment"}), has_process_noise=True)
    grown = explanation(forced.names | {"unknown_plane_abs_delta"}, has_process_noise=True)
    monkeypatch.setattr(module, "with_unknown", lambda _, best: grown if best is forced else best)
    monkeypatch.setattr(module, "in_a_sea", lambda search, _: (search, forced))
    monkeypatch.setattr(module, "among_waves", lambda search, best, _: (search, best, None))
    monkeypatch.setattr(module, "among_drift", lambda *_: None)
    monkeypatch.setattr(module, "as_filtered", lambda _, one: one)
    told = SimpleNamespace(is_nothing=left_among_forces.is_nothing, is_by_speed=is_by_speed)
    lefts = iter([MUCH_LEFT, MUCH_LEFT, *[told] * 3])
    answer, _ = explained(monkeypatch, ORDINARY_SET, left=lefts)
    assert answer.best is (grown if is_asked else forced)
