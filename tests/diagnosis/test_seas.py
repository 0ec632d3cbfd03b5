"""Waves are named by their swing, and what acts beside them is still found."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import BASE, Extra, hidden_dive

from host.catalogue import ORDINARY, structure_of
from host.diagnosis.diagnose import _unnamed, diagnose
from host.diagnosis.disturbances import plain_waves as plain_waves_module
from host.diagnosis.disturbances.plain_waves import _beside_hull, _follow_the_plane, _linear_in, plain_waves
from host.diagnosis.disturbances.seas import (
    Explained,
    Waves,
    _of_the_waves,
    _rough,
    against,
    among_waves,
    evidence,
    explains_more,
    in_plain_waves,
    left_among,
    told_waves,
)
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import leftover
from host.diagnosis.fits.sea_fits import with_sea, with_waves
from host.diagnosis.fits.trims import retrimmed
from host.diagnosis.fits.workers import Workers
from host.diagnosis.judge import judge
from host.diagnosis.recordings.spans import divide
from host.diagnosis.search.search import Search
from host.likelihood.waves import mean_moment
from host.recordings.recording import Array


def in_waves(extra: Extra, carried: float, turned: float) -> Extra:
    """The effect, and an irregular sea of twelve waves: m/s and rad/s^2 each."""
    rng = np.random.default_rng(4)
    met = rng.uniform(0.8, 1.6, 12)  # rad/s
    phase = rng.uniform(0.0, 2.0 * np.pi, 12)

    def rough(time: float, x: Array, plane: float) -> tuple[float, float, float]:
        own = extra(time, x, plane)
        climb, slope = np.sin(met * time + phase).sum(), np.cos(met * time + phase).sum()
        return own[0], own[1] - turned * float(slope), own[2] + carried * float(climb)

    return rough


@pytest.mark.long
def test_a_coupling_is_found_among_waves() -> None:
    coupled = in_waves(lambda time, x, plane: (0.8 * x[1], 0.0, 0.0), 0.01, 0.02)  # noqa: ARG005
    said: list[str] = []
    found = diagnose([hidden_dive(coupled, duration=90.0)], said.append)
    assert "in the waves" in said  # which were plain to see: not among white forces first
    assert "random forces" not in said
    names = [effect.name for effect in found.effects]
    assert names.count("surface_waves") == 1
    coupling = next(effect for effect in found.effects if effect.name != "surface_waves")
    assert "heave_pitch_rate_coupling" in {coupling.name, *coupling.twins}
    assert "surface_waves" in found.extended.names
    assert found.has_sea


def test_waves_are_estimated_beside_what_was_found_without_them(monkeypatch: pytest.MonkeyPatch) -> None:
    damped = in_waves(lambda time, x, plane: (0.0, -6.0 * x[1] * abs(x[1]), 0.0), 0.01, 0.06)  # noqa: ARG005
    fitter = Fitter([hidden_dive(damped, duration=90.0)])
    calm = fitter.grown(fitter.base, "pitch_quadratic_damping", [])
    base, root = with_sea(fitter, fitter.base), with_sea(fitter, fitter.root)
    monkeypatch.setattr(Search, "run", lambda _, also: min(also, key=lambda e: e.bic))
    with Workers(fitter, 1) as workers:
        for known, names in ((fitter.base, set()), (calm, {"pitch_quadratic_damping"})):
            rough = Search(fitter, workers, lambda _: None, base, root)
            _, found, waves = among_waves(rough, base, known)
            assert waves is not None
            assert found.names == waves.fitted.names == names


def test_a_band_broader_than_that_of_any_sea_is_no_waves(monkeypatch: pytest.MonkeyPatch) -> None:
    rough = in_waves(lambda time, x, plane: (0.0, 0.0, 0.0), 0.01, 0.06)  # noqa: ARG005
    fitter = Fitter([hidden_dive(rough, duration=90.0)])
    base, root = with_sea(fitter, fitter.base), with_sea(fitter, fitter.root)
    monkeypatch.setattr(Search, "run", lambda _, also: min(also, key=lambda e: e.bic))
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, base, root)
        assert among_waves(search, base, fitter.base)[2] is not None
        monkeypatch.setattr("host.likelihood.waves.BROADEST", 0.001)
        assert among_waves(search, base, fitter.base)[2] is None


@pytest.mark.parametrize("period", [10.0, 37.0])
def test_what_swings_may_be_waves_if_it_has_a_period_of_theirs(
    period: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    def moved(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        return 0.0, 0.05 * np.sin(2.0 * np.pi * time / period), 0.0

    fitter = Fitter([hidden_dive(moved, duration=90.0)])
    swinging = fitter.grown(fitter.base, "unknown_swinging_moment", [])
    monkeypatch.setattr("host.diagnosis.disturbances.seas.is_sea", lambda _: False)
    said: list[str] = []
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, said.append, fitter.base, fitter.root)
        assert among_waves(search, search.remember(swinging), fitter.base) == (search, swinging.lean(), None)
    assert ("waves" in said) == (period < 20.0)


@pytest.mark.parametrize(("behind", "are_waves"), [(5.0, True), (7.0, False)])
def test_what_swings_as_waves_do_is_waves_unless_it_is_clearly_likelier(
    behind: float, are_waves: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def moved(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        return 0.0, 0.05 * np.sin(2.0 * np.pi * time / 10.0), 0.0

    fitter = Fitter([hidden_dive(moved, duration=60.0)])
    swinging = fitter.grown(fitter.base, "unknown_swinging_moment", [])
    among = replace(fitter.base, bic=swinging.bic + behind)
    where = "host.diagnosis.disturbances.seas"
    monkeypatch.setattr(f"{where}.is_sea", lambda _: True)
    monkeypatch.setattr(f"{where}._in_own_waves", lambda *_: [among])
    monkeypatch.setattr(f"{where}._lean", lambda _, first: first)
    told = Waves(delta_bic=among.bic, fitted=among, model=among, theirs=frozenset())
    monkeypatch.setattr(
        f"{where}.searched_among",
        lambda search, first, least: (search, first, replace(told, delta_bic=least - first.bic)),
    )
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        search.remember(fitter.base)
        _, found, waves = among_waves(search, search.remember(swinging), fitter.base)
    assert (found is among) == are_waves
    assert (waves is not None) == are_waves
    if waves is not None:  # worth what nothing in their place loses, and no likelier than that moment
        assert waves.delta_bic > 10.0
        assert evidence(waves) == pytest.approx(-behind)


def test_what_only_passes_for_waves_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    rough = in_waves(lambda time, x, plane: (0.0, 0.0, 0.0), 0.02, 0.06)  # noqa: ARG005
    fitter = Fitter([hidden_dive(rough, duration=60.0)])
    waves = plain_waves(fitter)
    assert waves is not None
    with Workers(fitter, 1) as workers:
        calm = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        better = replace(fitter.root, bic=waves.bic)
        monkeypatch.setattr(Search, "run", lambda _, also: also[0])
        plain = in_plain_waves(calm, waves)
        assert plain.left.is_nothing
        assert against(plain, waves, better) is None  # what acts without waves explains as much
        told = against(plain, waves, fitter.root)
        assert told is not None
        assert told.waves is not None
        assert told.waves.delta_bic == pytest.approx(fitter.root.bic - waves.bic)
        assert explains_more(plain, fitter.root)
        assert not explains_more(plain, better)
        coloured = replace(leftover(fitter, waves), is_coloured=True)
        monkeypatch.setattr("host.diagnosis.disturbances.seas.leftover", lambda *_: coloured)
        doubtful = in_plain_waves(calm, waves)
        assert not doubtful.left.is_nothing  # something else is left among them
    assert plain_waves(Fitter([hidden_dive(duration=60.0)])) is None


@pytest.mark.parametrize("beyond", [0.0, 0.3])
def test_waves_hide_no_plane_that_bites_better_one_way(beyond: float) -> None:
    def one_sided(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        return BASE["b1"] * beyond * abs(plane), BASE["b2"] * beyond * abs(plane), 0.0

    fitter = Fitter([hidden_dive(in_waves(one_sided, 0.02, 0.06), duration=60.0)])
    waves = told_waves(fitter, with_waves(fitter, with_sea(fitter, fitter.root)), 100.0)
    assert left_among(fitter, waves).is_smooth == (beyond > 0.0)


def test_water_does_not_follow_the_plane(monkeypatch: pytest.MonkeyPatch) -> None:
    fitter = Fitter([hidden_dive(lambda _, x, __: (0.0, 2.0 * x[0], 0.0), duration=60.0)])
    sea = with_sea(fitter, fitter.root)
    gain = fitter.root.bic - fitter.linear.bic
    assert gain > 1000.0

    def follow(bic: float, *, band: float = 1.0) -> bool:
        waves = replace(sea.fit, waves=np.array([1.0, band, 0.0, 0.0, 0.0]))
        return _follow_the_plane(fitter, sea, replace(sea, bic=bic, fit=waves))

    monkeypatch.setattr(plain_waves_module, "PARTLY", np.inf)
    assert follow(fitter.linear.bic)
    assert not follow(fitter.linear.bic - gain)  # twice as much
    monkeypatch.undo()
    monkeypatch.setattr(plain_waves_module, "MOSTLY", np.inf)
    assert follow(sea.bic - 20.0)  # among white forces a linear hull explains more than that
    hull = _linear_in(fitter, sea)
    for among, is_answered in ((hull.bic - 50.0, True), (hull.bic - 200.0, False), (hull.bic + 1.0, False)):
        # What follows the plane in a narrow band may be what an autopilot answers.
        end = replace(sea, bic=among)
        monkeypatch.setattr(plain_waves_module, "with_waves", lambda *_, end=end: end)
        assert follow(hull.bic - 100.0, band=0.1) != is_answered
        assert follow(hull.bic - 100.0, band=0.3)
    assert not follow(sea.bic - 100.0 * gain)
    monkeypatch.undo()
    rough = Fitter([hidden_dive(in_waves(lambda *_: (0.0, 0.0, 0.0), 0.02, 0.06), duration=60.0)])
    waves = plain_waves(rough)
    assert waves is not None
    sea = with_sea(rough, rough.root)
    hull = _linear_in(rough, sea)
    assert not _follow_the_plane(rough, sea, waves)
    monkeypatch.setattr(plain_waves_module, "_follow_the_plane", lambda *_: True)
    gain = hull.bic - with_waves(rough, hull).bic
    assert gain > 100.0
    assert _beside_hull(rough, hull, 0.9 * gain) is not None  # true waves gain more beside a hull
    assert _beside_hull(rough, hull, 1.1 * gain) is None
    # What a linear hull does without forces, for waves as narrow as these it does not make up.
    monkeypatch.setattr(plain_waves_module, "_does_a_linear_hull", lambda *_: True)
    monkeypatch.setattr(plain_waves_module, "_beside_hull", lambda *_: waves)
    assert plain_waves(rough) is not None
    monkeypatch.setattr(plain_waves_module, "NARROW", 0.02)
    assert plain_waves(rough) is None


@pytest.mark.parametrize(("members", "is_settled"), [(ORDINARY[:5], True), (ORDINARY[:2], False)])
def test_many_effects_that_leave_little_are_not_exchanged_again_among_forces(
    members: tuple[str, ...], is_settled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    calm = Search(fitter, Workers(fitter, 1), lambda _: None, fitter.base, fitter.root)
    best, likelier = (replace(fitter.base, bic=fitter.base.bic - less) for less in (0.0, 100.0))
    went_on_from: list[Search | None] = []

    def run(search: Search, also: list[Explanation]) -> Explanation:
        went_on_from.append(search.part)
        return also[0]

    monkeypatch.setattr(Search, "run", run)
    assert _rough(calm, replace(best, names=frozenset(members)), [likelier]) is not None
    assert went_on_from == [calm if is_settled else None]


def test_a_moment_no_larger_than_the_waves_own_is_theirs() -> None:
    base = Fitter([hidden_dive(duration=40.0)]).base
    structure = structure_of(frozenset({"trim_moment"}))
    s, d, z = 1.3, 0.1, 0.2  # of a wave in which the vehicle is carried up and down by z
    number = s**2 / 9.80665
    turning = (number * s * z) ** 2 / 2.0
    waves = np.array([s, d, 0.0, 0.0, turning * 4.0 * d * s**3])
    known = dict(zip(base.fit.structure.names, base.fit.parameters.tolist(), strict=True))
    depth = z * np.cos(np.linspace(0.0, 2.0 * np.pi, 1000, endpoint=False))
    on_the_mean = np.mean(number * s * depth * np.exp(-number * depth))
    assert on_the_mean < 0.0
    for moment, theirs in ((1.0, {"trim_moment"}), (3.0, set())):
        known["c_q0"] = moment * known["a2"] * on_the_mean
        values = np.array([known[name] for name in structure.names])
        fit = replace(base.fit, structure=structure, parameters=values, waves=waves)
        assert mean_moment(fit) == pytest.approx(abs(known["a2"] * on_the_mean), rel=0.01)
        assert _of_the_waves(Explanation(frozenset({"trim_moment"}), fit, 0.0)) == theirs


def test_an_offset_that_is_the_waves_own_stays_in_the_model_without_a_name() -> None:
    rough = in_waves(lambda time, x, plane: (0.0, 0.3, 0.0), 0.01, 0.02)  # noqa: ARG005
    spans = divide([hidden_dive(rough, duration=60.0)])
    fitter = Fitter(spans.teaching)
    waves = plain_waves(fitter)
    assert waves is not None
    best = retrimmed(fitter, waves, frozenset({"trim_moment"}))
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, waves)
        for theirs, named in (
            (frozenset[str](), {"trim_moment", "surface_waves"}),
            (best.names, {"surface_waves"}),
        ):
            told = Waves(delta_bic=100.0, fitted=best, model=best, theirs=theirs)
            judged = judge(
                Explained(best, search, leftover(fitter, best), told), spans, fitter.floor, lambda _: None
            )
            assert {effect.name for effect in judged.effects} == named
            assert ["trim moment" in said for said in _unnamed(best, told, [])] == [True] * len(theirs)
    assert _unnamed(fitter.base, None, []) == []
