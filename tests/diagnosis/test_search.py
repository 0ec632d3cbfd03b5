"""Sets that a search one member at a time cannot reach: many that belong together, two that replace one."""

from dataclasses import replace
from itertools import combinations
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.catalogue import CATALOGUE, ORDINARY, structure_of
from host.diagnosis.fits.charges import LONELY, RARITY
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import LITTLE
from host.diagnosis.fits.workers import Task, Workers
from host.diagnosis.search import beam
from host.diagnosis.search import search as module
from host.diagnosis.search import together as together_module
from host.diagnosis.search.beam import _pair_instead, _with_best_pair
from host.diagnosis.search.offset_choice import with_offset
from host.diagnosis.search.pruning import leanest, pruned
from host.diagnosis.search.search import Search
from host.diagnosis.search.together import at_once, completed, together, with_ordinary
from host.diagnosis.search.unknown_physics import with_unknown
from host.dynamics.propagate import free_run, inputs_of
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error
from host.recordings.recording import Recording

NOISE = np.array([[2e-3], [5e-3]])  # rad, m


def flown(values: dict[str, float], names: Names, seed: int = 3) -> Recording:
    """A dive of the catalogue's own equations: only the search is under test."""
    rows, structure = hidden_dive(duration=120.0), structure_of(names)
    known = dict.fromkeys(structure.names, 0.0) | BASE | values
    start = np.array([0.0, 0.0, 0.0, 20.0, 0.0])
    run = free_run(np.array([known[name] for name in structure.names]), start, inputs_of(rows, structure))
    noisy = run.outputs + NOISE * np.random.default_rng(seed).standard_normal(run.outputs.shape)
    return replace(rows, pitch=noisy[0], depth=noisy[1])


def fitted(fitter: Fitter, names: Names, values: dict[str, float]) -> Explanation:
    """The end of a search from these values."""
    structure, base = structure_of(names), fitter.base.fit
    known = BASE | {"heave_offset": 0.0, "pitch_offset": 0.0} | values
    start = Point(structure, np.array([known[n] for n in structure.names]), base.initial, base.noise)
    fit = output_error(start, fitter.inputs(names), fitter.free(names))
    return Explanation(names, fit, fitter.bic(fit, names))


def test_what_every_vehicle_has_joins_at_once() -> None:
    said: list[str] = []
    true = {"c_wq": 0.8, "c_ww": -0.8, "c_qq": -3.0, "lag_time": 0.15, "depth_lag_time": 0.6}
    names = frozenset({
        "heave_pitch_rate_coupling", "heave_quadratic_drag", "pitch_quadratic_damping", "actuator_lag",
        "depth_sensor_lag",
    })  # fmt: skip
    fitter = Fitter([flown(true, names)])
    bent = (names | {"trim_moment", "ballast_change"}) - {"heave_pitch_rate_coupling", "heave_quadratic_drag"}
    wrong = fitted(fitter, bent, true | {"c_q0": 0.0, "c_wb": 0.0, "ballast_time": 60.0})
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, said.append, fitter.base, fitter.root)
        search.remember(wrong)
        found = completed(search, wrong)
    assert said == ["what every vehicle has beside it"]
    assert found.names == names
    assert found.bic < wrong.bic


def test_beside_a_set_that_is_begun_with_all_that_every_vehicle_has_is_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fitter, asked = Fitter([hidden_dive(duration=40.0)]), list[str]()
    many = frozenset({
        "heave_pitch_rate_coupling", "heave_quadratic_drag", "pitch_quadratic_damping", "munk_moment",
        "actuator_lag",
    })  # fmt: skip
    begun = replace(fitter.base, names=many, bic=fitter.base.bic - 100.0)
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        monkeypatch.setattr(Search, "_settled", lambda _, best: best)
        for name in ("whole", "told_by_the_usual"):
            monkeypatch.setattr(module, name, lambda _, one, name=name: asked.append(name) or one)
        assert search.run([begun]).names == many
        assert asked == ["whole", "told_by_the_usual"]
        search.part = search  # what was found on a part of the recordings was asked there
        assert search.run([begun]).names == many
    assert asked == ["whole", "told_by_the_usual"]


def test_of_many_what_had_an_equal_is_exchanged_again_beside_another_member(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fitter, asked = Fitter([hidden_dive(duration=40.0)]), []
    known = frozenset({"munk_moment", "heave_quadratic_drag", "pitch_quadratic_damping"})
    drifting, buoyant = (known | {"actuator_lag", name} for name in ("vertical_current", "net_buoyancy"))
    equal = known | {"pitch_sensor_lag", "vertical_current"}

    def exchanged(search: Search, best: Explanation, settled: Names) -> Explanation:
        asked.append((best.names, settled))
        return search.tried[buoyant]

    monkeypatch.setattr("host.diagnosis.search.search.exchanged", exchanged)
    monkeypatch.setattr("host.diagnosis.search.search.pruned", lambda _, best: best)
    monkeypatch.setattr(Search, "across", lambda _, explanations: explanations)
    with Workers(fitter, 1) as workers:
        for bic_of_equal, again in ((101.0, [(buoyant, buoyant - {"actuator_lag"})]), (150.0, [])):
            search = Search(fitter, workers, lambda _: None, fitter.base, fitter.base)
            for names, bic in ((drifting, 100.0), (equal, bic_of_equal), (buoyant, 95.0)):
                search.tried[names] = Explanation(names, fitter.base.fit, bic)
            asked.clear()
            assert search._settled(search.tried[drifting]).names == buoyant
            assert asked == [(drifting, frozenset()), *again]


def test_two_members_are_missed_only_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Search, "shrink", lambda *_: None)  # all sets are known, and to the end
    monkeypatch.setattr(Search, "polish", lambda *_: None)
    fitter = Fitter([hidden_dive(duration=40.0)])
    whole = frozenset({"actuator_lag", "depth_sensor_lag", "pitch_sensor_lag", "munk_moment"})
    needed = frozenset({"actuator_lag", "munk_moment"})
    worth = {whole - {"depth_sensor_lag"}: 115.0, whole - {"pitch_sensor_lag"}: 120.0, needed: 90.0}
    subsets = [frozenset(names) for size in (2, 3, 4) for names in combinations(sorted(whole), size)]
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.base)
        for names in subsets:
            bic = 100.0 if names == whole else worth.get(names, 300.0)
            search.tried[names] = Explanation(names, fitter.base.fit, bic)
        assert pruned(search, search.tried[whole]).names == needed


def test_an_effect_that_the_search_passed_over_competes_with_unknown_physics() -> None:
    names = frozenset({"heave_pitch_rate_coupling", "actuator_lag"})
    fitter = Fitter([flown({"c_wq": 0.8, "lag_time": 0.4}, names)])
    half = fitted(fitter, frozenset({"actuator_lag"}), {"lag_time": 0.4})
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        search.remember(half)
        assert with_unknown(search, half).names == names


def test_what_seldom_acts_alone_is_charged_for_it() -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    fit, coupling = fitter.base.fit, "heave_pitch_rate_coupling"
    alone = frozenset({"heave_pitch_acceleration_coupling"})
    assert fitter.bic(fit, alone) - fitter.bic(fit, frozenset({coupling})) == pytest.approx(LONELY + RARITY)
    more = fitter.bic(fit, alone | {coupling}) - fitter.bic(fit, frozenset({coupling}))
    assert more == pytest.approx(np.log(fit.samples) + RARITY)


@pytest.mark.long
def test_what_runs_away_joins_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def grown(_: Fitter, parent: Explanation, name: str, *__: object) -> Explanation:
        return Explanation(parent.names | {name}, parent.fit, np.inf if name in lost else parent.bic)

    monkeypatch.setattr(Fitter, "grown", grown)
    monkeypatch.setattr(Fitter, "polished", lambda _self, explanation: explanation)
    monkeypatch.setattr(Fitter, "excess", lambda *_: 5.0)
    monkeypatch.setattr(Search, "gains", lambda *_: {"munk_moment": 1.0})
    fitter = Fitter([hidden_dive(duration=40.0)])
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.base)
        lost = {"speed_loss"}
        assert with_ordinary(search, fitter.base).names == {*ORDINARY, "plane_before"} - lost
        lost = {effect.name for effect in CATALOGUE}
        monkeypatch.setattr(together_module, "_in_one_fit", lambda *_: None)
        assert together(search, fitter.base, at_once(search, [fitter.base])) is None


def test_a_member_that_does_not_pay_after_all_is_dropped_at_last() -> None:
    true = {"c_wq": 0.8, "lag_time": 0.4}
    names = frozenset({"heave_pitch_rate_coupling", "actuator_lag"})
    fitter = Fitter([flown(true, names)])
    idle = fitted(fitter, names | {"trim_moment"}, true | {"c_q0": 0.0})
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        search.remember(idle)
        found = leanest(search, idle)
        assert found.names == names
        assert leanest(search, found).names == names


def test_a_set_that_ended_below_its_part_was_never_fitted_beside_it() -> None:
    true = {"c_wq": 0.8, "lag_time": 0.4, "c_ww": -0.8, "c_qw": 0.5}
    names = frozenset({"heave_pitch_rate_coupling", "actuator_lag", "heave_quadratic_drag", "munk_moment"})
    fitter = Fitter([flown(true, names)])
    best = fitted(fitter, names, true)
    poor = replace(best, names=frozenset({*ORDINARY}), fit=fitter.base.fit, bic=best.bic + 1000.0)
    likelier = replace(best.fit, log_likelihood=best.fit.log_likelihood + 1.0)
    for joint, is_tried_again in ((poor, True), (replace(poor, fit=likelier), False)):
        said: list[str] = []
        with Workers(fitter, 1) as workers:
            search = Search(fitter, workers, said.append, fitter.base, fitter.root)
            search.remember(best)
            search.remember(joint)
            search.joint.add(joint.names)
            assert completed(search, best).names == names
        assert bool(said) == is_tried_again


@pytest.mark.long
def test_an_offset_joins_a_speed_that_changes_and_what_it_leaves_is_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said: list[str] = []
    names = frozenset({"speed_loss", "pitch_bias"})
    fitter = Fitter([flown({"c_ud": 4.0, "speed_time": 15.0, "pitch_zero": 0.05}, names)])
    losing, late = (fitter.grown(fitter.root, name, []) for name in ("speed_loss", "actuator_lag"))
    assert fitter.excess(losing.fit) > LITTLE  # a constant force is no bias of a sensor at such a speed
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, said.append, fitter.base, fitter.root)
        monkeypatch.setattr(Search, "singles", lambda _: [losing, late])
        assert search.run().names == names
    assert said.pop() == "settling"
    assert said  # what remains is tried beside both, and nothing beside less
    assert all(line.startswith("3 effects") and "pitch_bias + " in line for line in said)


def test_a_zero_error_of_the_plane_is_tried_beside_what_depends_on_its_angle() -> None:
    """A free trim cannot do its work there, so that beside it other effects may lead."""
    hidden = frozenset({"rudder_offset", "speed_loss"})
    values = {"rudder_zero": 0.07, "speed_time": 15.0, "c_ud": 6.0, "c_uq": 1.0}
    fitter = Fitter([flown(values, hidden)])
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        others = [e for e in search.singles() if not e.names & hidden]
        parents = sorted(others, key=lambda e: e.bic)[:2]
        assert all(fitter.excess(parent.fit) > LITTLE for parent in parents)
        leading = with_offset(search, parents)[0]
    assert leading.names == hidden
    assert fitter.excess(leading.fit) < LITTLE


@pytest.mark.parametrize(("left", "is_kept"), [(1.5, True), (3.0, False)])
def test_two_that_explain_much_each_are_asked_before_a_dozen(
    left: float, is_kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    workers = Workers(fitter, 1)
    search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
    names = ["internal_wave", "actuator_rate_limit", "munk_moment"]
    singles = [
        replace(fitter.root, names=fitter.root.names | {name}, bic=fitter.root.bic - less)
        for name, less in zip(names, (300.0, 200.0, 100.0), strict=True)
    ]
    grown: list[str] = []

    def results(tasks: list[Task]) -> list[Explanation]:
        grown.extend(name for _, (_, name, _) in tasks)
        return [
            replace(fitter.root, names=singles[0].names | {name}, bic=fitter.root.bic - 900.0)
            for _, (_, name, _) in tasks
        ]

    monkeypatch.setattr(workers, "results", results)
    monkeypatch.setattr(Fitter, "excess", lambda *_: left)
    leading = _with_best_pair(search, singles)
    assert grown == names[1:]
    assert leading[-3:] == singles
    assert ({"internal_wave", "actuator_rate_limit"} <= leading[0].names) is is_kept


@pytest.mark.parametrize(("left", "asked_after"), [(LITTLE + 0.1, 1), (LITTLE - 0.1, 3), (None, None)])
def test_one_form_competes_with_one_effect_that_leaves_much_or_three(
    left: float | None, asked_after: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter = Fitter([hidden_dive(duration=20.0)])
    root = fitter.root
    if left is None:  # among forces nobody asks
        root = replace(root, fit=replace(root.fit, noise=np.array([*fitter.floor, 1e-6, 1e-6])))
    names = ["munk_moment", "actuator_lag", "actuator_backlash", "rudder_stall"]
    sizes: list[int] = []

    def grown(search: Search, _: list[Explanation], size: int) -> list[Explanation]:
        sizes.append(size)
        larger = replace(root, names=root.names | {*names[:size]}, bic=root.bic - 50.0 * size)
        return [search.remember(larger)]

    def lone_form(_: Search, leading: Explanation) -> Explanation:
        assert leading.names == root.names | {names[0]}
        asked.append(len(sizes))
        return replace(root, names=root.names | {"unknown_moment_q_q"}, bic=root.bic - 1000.0)

    asked: list[int] = []
    monkeypatch.setattr(beam, "grown", grown)
    monkeypatch.setattr(module, "grown", grown)
    monkeypatch.setattr(beam, "_needs_many", lambda *_: False)
    monkeypatch.setattr(Search, "_concluded", lambda search: min(search.tried.values(), key=lambda e: e.bic))
    monkeypatch.setattr(Fitter, "excess", lambda *_: left or 2.0)
    monkeypatch.setattr("host.diagnosis.search.beam.with_offset", lambda _, sets: sets)
    monkeypatch.setattr("host.diagnosis.search.beam.lone_form", lone_form)
    with Workers(fitter, 1) as workers:
        found = Search(fitter, workers, lambda _: None, fitter.base, root).run()
    assert asked == ([] if asked_after is None else [asked_after])
    assert found.names - root.names == ({*names} if asked_after is None else {"unknown_moment_q_q"})


@pytest.mark.parametrize(("left", "is_pair"), [(1.5, True), (3.0, False)])
def test_two_that_leave_far_less_than_a_dozen_are_gone_on_with(
    left: float, is_pair: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    pair = SimpleNamespace(fit=left, bic=-2.0)
    joint: Any = SimpleNamespace(fit=4.0)
    monkeypatch.setattr(beam, "grown", lambda *_: [SimpleNamespace(fit=9.0, bic=-1.0), pair])
    fitter: Any = SimpleNamespace(excess=lambda fit: fit)
    one: Any = SimpleNamespace(fit=5.0, bic=0.0)
    search = Search(fitter, cast("Any", None), lambda _: None, one, one)
    assert (_pair_instead(search, one, joint) is pair) is is_pair
    nothing_left: Any = SimpleNamespace(fit=1.0)
    assert _pair_instead(search, one, nothing_left) is None


@pytest.mark.parametrize(("waves_do", "ends"), [(True, "as it is"), (False, "concluded")])
def test_a_search_that_waves_make_needless_is_not_concluded(
    waves_do: bool, ends: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def leaving(left: float, *names: str) -> Any:
        one = SimpleNamespace(names=frozenset(names), fit=left, bic=10.0 * left, leaves_white=False)
        one.lean = lambda: one
        return one

    done: list[str] = []
    root, single = leaving(20.0, "free_trim"), leaving(10.0, "free_trim", "actuator_lag")
    monkeypatch.setattr(module, "grown", lambda search, *_: [search.remember(single)])
    monkeypatch.setattr(beam, "grown", lambda *_: [])
    monkeypatch.setattr(beam, "_needs_many", lambda search, _, size: size == 2 and not search.joint)
    monkeypatch.setattr(beam, "_with_best_pair", lambda _, sets: sets)
    monkeypatch.setattr(beam, "_most_without_form", lambda *_: None)
    monkeypatch.setattr(beam, "margin", lambda _: 6.0)
    monkeypatch.setattr(beam, "with_offset", lambda _, sets: sets)
    monkeypatch.setattr(beam, "at_once", lambda *_: leaving(9.0))
    monkeypatch.setattr(beam, "together", lambda *_: done.append("continuation") or single)
    monkeypatch.setattr(module, "with_best_offsets", lambda _: done.append("as it is"))
    monkeypatch.setattr(Search, "_concluded", lambda _: done.append("concluded"))
    fitter: Any = SimpleNamespace(excess=lambda left: left)
    search = Search(fitter, cast("Any", None), lambda _: None, leaving(30.0), root, instead=lambda: waves_do)
    search.run()
    assert done == ([ends] if waves_do else ["continuation", ends])


@pytest.mark.parametrize(
    ("form", "pair_leaves", "asked"),
    [
        ("unknown_wandering_moment", 3.0, ["a dozen", "continuation"]),
        ("unknown_wandering_moment", 1.05, ["a dozen"]),
        ("unknown_moment_q_q", 3.0, []),  # it is no more flexible than an effect is
    ],
    ids=["two are not enough", "two are", "a form of the motion"],
)
def test_what_wanders_ends_no_search_before_a_dozen_were_tried(
    form: str, pair_leaves: float, asked: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def leaving(left: float, bic: float, *names: str) -> Any:
        one = SimpleNamespace(names=frozenset(names), fit=left, bic=bic, leaves_white=False)
        one.lean = lambda: one
        return one

    root = leaving(20.0, 0.0, "free_trim")
    single = leaving(10.0, -50.0, "free_trim", "actuator_lag")
    pair = leaving(pair_leaves, -90.0, "free_trim", "actuator_lag", "munk_moment")
    foreign = leaving(1.0, -1000.0, "free_trim", form)
    done: list[str] = []
    monkeypatch.setattr(module, "grown", lambda search, *_: [search.remember(single)])
    monkeypatch.setattr(beam, "grown", lambda search, *_: [search.remember(pair)])
    monkeypatch.setattr(beam, "_needs_many", lambda *_: False)
    monkeypatch.setattr(beam, "_most_without_form", lambda *_: 1)
    monkeypatch.setattr(beam, "margin", lambda _: 6.0)
    monkeypatch.setattr(beam, "with_offset", lambda _, sets: sets)
    monkeypatch.setattr(beam, "lone_form", lambda *_: foreign)
    monkeypatch.setattr(beam, "at_once", lambda *_: done.append("a dozen") or leaving(9.0, 0.0))
    monkeypatch.setattr(beam, "together", lambda *_: done.append("continuation"))
    fitter: Any = SimpleNamespace(excess=lambda left: left)
    search = Search(fitter, cast("Any", None), lambda _: None, root, root)
    beam.beam_search(search)
    assert done == asked
    assert foreign.names in search.tried


@pytest.mark.long
def test_of_two_that_come_late_the_one_does_not_hide_the_other() -> None:
    names = frozenset({"actuator_delay", "pitch_sensor_lag"})
    fitter = Fitter([flown({"delay": 0.9, "pitch_lag_time": 0.33}, names)])
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        singles = sorted(map(search.remember, search.singles()), key=lambda e: e.bic)
        assert singles[0].names & {"actuator_delay", "pitch_sensor_lag"}
        pair, *_ = _with_best_pair(search, singles[:1])
    values = dict(zip(pair.fit.structure.names, pair.fit.parameters, strict=True))
    assert names < pair.names
    assert values["delay"] == pytest.approx(0.9, abs=0.05)
    assert values["pitch_lag_time"] == pytest.approx(0.33, abs=0.05)
