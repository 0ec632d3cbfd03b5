"""When to go on adding to what every vehicle has, and when to give up."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.catalogue import ORDINARY, structure_of
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import MUCH
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search import together as module
from host.diagnosis.search.search import Search
from host.diagnosis.search.together import at_once, completed, together
from host.dynamics.propagate import free_run, inputs_of
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error
from host.likelihood.valleys import with_poles_swapped

AT_REST = np.array([0.0, 0.0, 0.0, 20.0, 0.0])


class Rounds:
    """A search whose sets leave, round by round, so many times the noise floor."""

    def __init__(self, left: list[float], is_above_floor: bool, patch: pytest.MonkeyPatch) -> None:
        self.sets = [
            SimpleNamespace(names=frozenset(range(k + 4)), fit=excess, bic=-1000.0 * (k + 1))
            for k, excess in enumerate(left)
        ]
        self.rounds = 0
        self.joint: set[Any] = {self.sets[0].names}
        self.tried: dict[Any, Any] = {}
        self.root = SimpleNamespace(fit=SimpleNamespace(has_process_noise=False))
        self.fitter = SimpleNamespace(excess=lambda fit: fit)
        self.workers = SimpleNamespace(results=self._next)
        self.leading = SimpleNamespace(names=frozenset({0}), fit=20.0, bic=0.0)
        self.continued = 0
        self.asks_drift, self.adrift, self.is_second = False, None, False
        self.is_led_by_forces = False
        patch.setattr(module, "_in_one_fit", lambda *_: None)
        patch.setattr(module, "with_ordinary", lambda search, _: search.sets[0])
        patch.setattr(module, "_among_look_alikes", lambda _, best: best)
        patch.setattr(module, "_by_continuation", Rounds._continued)
        patch.setattr(module, "_more", lambda *_: [])
        patch.setattr(module, "margin", lambda _: 6.0)
        patch.setattr(module, "pruned", lambda _, best: best)
        patch.setattr(module, "_was_joint", lambda *_: False)
        patch.setattr(module, "is_above_floor", lambda *_: is_above_floor)

    @property
    def is_led_elsewhere(self) -> bool:
        return self.is_led_by_forces or self.adrift is not None

    def on_progress(self, _: str) -> None: ...

    def _continued(self, _: float) -> Any:
        self.continued += 1
        return self.sets[0]

    def _next(self, _: list[Any]) -> list[Any]:
        self.rounds += 1
        return self.sets[self.rounds : self.rounds + 1] or [self.sets[-1]]

    def polished_near(self, found: list[Any], _: float) -> list[Any]:
        return found


def found(search: Rounds) -> Any:
    joint = at_once(search, [search.leading])  # type: ignore[arg-type]
    return together(search, search.leading, joint)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("left", "is_white", "comes_of"),
    [(1.1, True, "one fit"), (1.6, False, "one fit and more"), (2.4, False, "one after the other")],
)
def test_all_join_the_likeliest_in_one_fit_where_that_leaves_little(
    left: float, is_white: bool, comes_of: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    search = Rounds([9.0], True, monkeypatch)
    sets = [
        SimpleNamespace(names=frozenset({k}), fit=left, bic=bic, leaves_white=is_white)
        for k, bic in enumerate([-1.0, -3.0, -2.0])
    ]
    asked: list[str] = []
    monkeypatch.undo()
    monkeypatch.setattr(module, "with_ordinary", lambda _, one: asked.append("one after the other") or one)
    monkeypatch.setattr(module, "with_more", lambda _, one: asked.append("more") or one)
    monkeypatch.setattr(module, "_among_look_alikes", lambda _, best: best)
    monkeypatch.setattr(search, "remember", lambda one: one, raising=False)
    monkeypatch.setattr(search.workers, "results", lambda _: sets)
    leading: Any = [sets[0], sets[2]]
    best = at_once(search, leading)  # type: ignore[arg-type]
    assert best is (sets[0] if comes_of == "one after the other" else sets[1])
    expected = {"one fit": [], "one fit and more": ["more"], "one after the other": ["one after the other"]}
    assert asked == expected[comes_of]
    assert (sets[1].names in search.joint) is (left < MUCH)


def test_another_effect_that_takes_hardly_anything_away_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    search = Rounds([10.4, 10.1, 9.9, 9.8], True, monkeypatch)
    assert found(search) is None
    assert search.rounds == 1


@pytest.mark.parametrize(("left", "continued"), [(10.4, 0), (1.5, 1)])
def test_with_the_plane_the_other_way_no_continuation_leads_far(
    left: float, continued: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "is_far", lambda *_: True)
    search = Rounds([left, left, left, left], True, monkeypatch)
    search.is_second = True
    found(search)
    assert search.continued == continued


def test_as_long_as_less_is_left_more_join(monkeypatch: pytest.MonkeyPatch) -> None:
    search = Rounds([10.4, 6.0, 2.5, 1.05], True, monkeypatch)
    assert found(search) is search.sets[3]
    assert search.continued == 1


@pytest.mark.parametrize("left", [[1.05], [1.6, 1.05]])
def test_where_they_join_and_little_is_left_no_continuation_is_needed(
    left: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    search = Rounds(left, True, monkeypatch)
    assert found(search) is search.sets[-1]
    assert search.continued == 0


def test_where_more_that_joins_does_not_help_a_continuation_begins_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search = Rounds([1.6], True, monkeypatch)
    end = SimpleNamespace(names=frozenset({9}), fit=1.02, bic=-9000.0)
    monkeypatch.setattr(module, "_by_continuation", lambda *_: end)
    assert found(search) is end


def test_what_is_left_within_the_doubt_about_the_sensors_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    search = Rounds([1.26], False, monkeypatch)
    assert found(search) is search.sets[0]
    assert found(Rounds([2.6], True, monkeypatch)) is None


@pytest.mark.parametrize(
    ("left", "leading", "stays"), [(1.4, 20.0, True), (1.4, 3.0, False), (2.4, 20.0, False)]
)
def test_what_a_few_effects_do_not_come_near_stays_though_something_is_left(
    left: float, leading: float, stays: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    search = Rounds([left], True, monkeypatch)
    search.leading.fit = leading
    monkeypatch.setattr(module, "pruned", lambda *_: pytest.fail("pruned"))
    assert found(search) is (search.sets[0] if stays else None)


@pytest.mark.parametrize("left", [1.05, 1.6])
def test_where_much_is_left_look_alikes_are_entered_before_a_continuation(
    left: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    search = Rounds([left], True, monkeypatch)
    end = SimpleNamespace(names=frozenset({9}), fit=1.02, bic=-9000.0)
    monkeypatch.setattr(module, "_among_look_alikes", lambda *_: end)
    assert found(search) is (end if left > 1.15 else search.sets[0])
    assert search.continued == 0


def test_a_hull_that_got_the_pole_of_its_plane_s_lag_gets_its_own_back() -> None:
    names = frozenset({"actuator_lag", "munk_moment"})
    structure = structure_of(names)
    known = {**BASE, "a2": -4.0, "a3": -3.0, "heave_offset": 0.0, "pitch_offset": 0.0}
    known |= {"c_qw": 0.5, "lag_time": 0.1}
    true = np.array([known[name] for name in structure.names])
    rows = hidden_dive(duration=60.0)
    pitch, depth = free_run(true, AT_REST, inputs_of(rows, structure)).outputs
    noise = np.array([[1e-3], [5e-3]]) * np.random.default_rng(1).standard_normal((2, rows.time.size))
    fitter = Fitter([replace(rows, pitch=pitch + noise[0], depth=depth + noise[1])])
    swapped = with_poles_swapped(Point(structure, true, [AT_REST], np.array([1e-6, 2.5e-5, 0.0, 0.0])))[0]
    early = output_error(swapped, fitter.inputs(names), fitter.free(names), most_iterations=2)
    wrong = fitter.explained(names, early)
    lag = structure.names.index("lag_time")
    assert wrong.fit.parameters[lag] > 0.2
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.base)
        found = module._among_look_alikes(search, wrong)
    assert found.fit.parameters[lag] == pytest.approx(0.1, abs=0.01)
    assert found.bic < wrong.bic - 100.0
    assert search.tried[names].bic == found.bic


@pytest.mark.parametrize("left", [1.05, 1.6])
def test_where_much_is_left_it_is_asked_what_drifts(left: float, monkeypatch: pytest.MonkeyPatch) -> None:
    search, beside = Rounds([left], True, monkeypatch), SimpleNamespace()
    search.asks_drift = True
    monkeypatch.setattr(module, "plain_drift", lambda *_: beside)
    assert (found(search) is None) is (left > 1.15)
    assert (search.adrift is beside) is (left > 1.15)


@pytest.mark.parametrize(("end", "is_adrift"), [(1.3, True), (1.02, False)])
def test_what_drifts_gives_way_to_a_hull_that_a_continuation_finds(
    end: float, is_adrift: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    search, beside = Rounds([1.6], True, monkeypatch), SimpleNamespace()
    search.asks_drift = True
    hull = SimpleNamespace(names=frozenset({9}), fit=end, bic=-9000.0)
    monkeypatch.setattr(module, "plain_drift", lambda *_: beside)
    monkeypatch.setattr(module, "_by_continuation", lambda *_: hull)
    assert found(search) is (None if is_adrift else hull)
    assert (search.adrift is beside) is is_adrift


def test_what_led_nowhere_beside_less_is_not_tried_beside_more(monkeypatch: pytest.MonkeyPatch) -> None:
    search = Rounds([10.4], True, monkeypatch)
    best = SimpleNamespace(names=frozenset(range(10, 16)), fit=9.0, bic=-1.0)
    assert completed(search, best) is best  # type: ignore[arg-type]


@pytest.mark.parametrize("left", [MUCH - 0.1, MUCH + 0.1, module.FAR_TOO_MUCH + 1.0])
def test_a_continuation_goes_through_an_excerpt_of_which_it_leaves_little(
    left: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Part:
        def __init__(self, recordings: list[Any]) -> None:
            self.recordings, self.wander = recordings, np.zeros(0)

        def excess(self, fit: float) -> float:
            return fit

    found = SimpleNamespace(fit=left)
    search: Any = SimpleNamespace(
        fitter=SimpleNamespace(recordings=["all"], wander=np.zeros(0), refitted=lambda _: "from the excerpt"),
        workers=SimpleNamespace(jobs=1),
        elsewhere=lambda fitter, _: fitter.recordings,
    )
    monkeypatch.setattr(module, "Fitter", Part)
    monkeypatch.setattr(module, "led_excerpt", lambda _: ["piece"])
    monkeypatch.setattr(module, "continued", lambda runs, *_: found if runs == ["piece"] else "over all")
    end: Any = module._led_by_the_measurements(search, frozenset(), {}, np.inf)
    assert end == ("from the excerpt" if left < MUCH else "over all" if left < 100.0 else None)
    end = module._led_by_the_measurements(search, frozenset(), {}, left - 0.01)
    assert end == ("from the excerpt" if left < MUCH else None)  # another set leaves less of all
    monkeypatch.setattr(module, "led_excerpt", lambda runs: runs)
    assert module._led_by_the_measurements(search, frozenset(), {}, 0.0) == "over all"


def test_a_continuation_holds_what_keeps_the_plane_back_from_the_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    structure = structure_of(frozenset({"actuator_rate_limit", "internal_wave", "free_trim"}))
    values = np.arange(1.0, len(structure.names) + 1.0)
    fit = SimpleNamespace(structure=structure, parameters=values)
    asked: list[Any] = []
    monkeypatch.setattr(module, "_led_by_the_measurements", lambda *told: asked.append(told[1:]))
    search: Any = SimpleNamespace(
        on_progress=lambda _: None,
        fitter=SimpleNamespace(tools_beside=lambda _: ()),
        fault_of_the_drive=SimpleNamespace(names=frozenset(structure.effect_names), fit=fit),
    )
    assert module._by_continuation(search, 5.0) is None
    ((names, known, most),) = asked
    assert most == 5.0
    assert names == {*ORDINARY, "free_trim", "actuator_rate_limit"}
    assert known == {"plane_rate": values[structure.names.index("plane_rate")]}
    asked.clear()
    search.fault_of_the_drive = None
    assert module._by_continuation(search, 5.0) is None
    assert asked[0][0] == {*ORDINARY, "free_trim"}
