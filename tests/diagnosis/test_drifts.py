"""Sensors whose errors wander and water that rises and sinks are part of the noise, and hide no physics."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hidden_dive import Extra, hidden_dive, nothing

from host.catalogue import ORDINARY, UNKNOWN
from host.diagnosis.diagnose import diagnose
from host.diagnosis.disturbances import drifts, seas
from host.diagnosis.disturbances.drifts import again_in_drift, among_drift, in_drift
from host.diagnosis.disturbances.seas import Explained
from host.diagnosis.fits.drift_fits import beside, drifting
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import leftover
from host.diagnosis.fits.workers import Workers
from host.diagnosis.proof.scoring import misfit
from host.diagnosis.recordings.spans import divide
from host.diagnosis.search.search import Search
from host.diagnosis.told.files import write_extended_model
from host.recordings.recording import Array, Recording
from host.vehicle import default_vehicle


def walk(deviation: float, time: float, rows: int, seed: int) -> Array:
    """What wanders so at 10 Hz (first order)."""
    a, values = np.exp(-0.1 / time), deviation * np.random.default_rng(seed).standard_normal(rows)
    for k in range(1, rows):
        values[k] = a * values[k - 1] + np.sqrt(1.0 - a**2) * values[k]
    return values


def with_wandering_sensors(extra: Extra = nothing, duration: float = 120.0) -> Recording:
    """Pitch is off by 0.25 deg for a second or so, depth by 4 cm for three."""
    plain = hidden_dive(extra, duration=duration, seed=4)
    rows = plain.time.size
    pitch = plain.pitch + walk(np.deg2rad(0.25), 1.0, rows, 5)
    return replace(plain, pitch=pitch, depth=plain.depth + walk(0.04, 3.0, rows, 6))


def in_gusts(extra: Extra, duration: float = 150.0) -> Recording:
    """Water that rises and sinks by 5 cm/s for 6 s or so."""
    water = walk(0.05, 6.0, int(10 * duration) + 1, 7)

    def carried(time: float, x: Array, plane: float) -> tuple[float, float, float]:
        force, moment, climb = extra(time, x, plane)
        return force, moment, climb + float(water[int(10.0 * time)])

    return hidden_dive(carried, duration=duration, seed=8)


def damping(_: float, x: Array, __: float) -> tuple[float, float, float]:
    return 0.0, -8.0 * float(x[1] * abs(x[1])), 0.0


@pytest.mark.long
def test_physics_is_named_beside_sensors_that_wander(tmp_path: Path) -> None:
    found = diagnose([with_wandering_sensors(damping)])
    assert [effect.name for effect in found.effects] == ["pitch_quadratic_damping"]
    assert found.verdict == "explained"
    value, std, _ = found.effects[0].coefficients["c_qq"]
    assert abs(value + 8.0) < 3.0 * std
    assert "pitch is off by" in found.remaining
    assert "depth is off by" in found.remaining
    write_extended_model(found, default_vehicle(), tmp_path / "extended_model.json")
    noise = json.loads((tmp_path / "extended_model.json").read_text())["noise"]
    assert noise["depth_wander_m"] == pytest.approx(0.04, rel=0.4)
    assert noise["pitch_wander_rad"] == pytest.approx(np.deg2rad(0.25), rel=0.4)
    assert "current_wander_mps" not in noise


def test_nothing_drifts_where_all_that_is_left_is_white() -> None:
    fitter = Fitter([hidden_dive()])
    assert drifting(fitter, fitter.base) is None


@pytest.fixture(scope="module")
def gusty() -> tuple[Fitter, Explanation]:
    """The teaching stretches of a dive among gusts, and the base beside what drifts."""
    fitter = Fitter(divide([in_gusts(nothing)]).teaching)
    found = drifting(fitter, fitter.base)
    assert found is not None
    return fitter, found


def test_held_out_errors_are_weighed_by_how_far_water_may_carry_a_vehicle(
    gusty: tuple[Fitter, Explanation],
) -> None:
    fitter, found = gusty
    spans = divide([in_gusts(nothing)])
    plain, told = (misfit(one, spans, fitter.floor) for one in (fitter.base, found))
    assert plain.chi2_depth > 20.0
    assert told.chi2_depth < 3.0
    assert told.depth_rmse_m < plain.depth_rmse_m  # the filter knows how far it was carried before


def test_workers_keep_a_fitter_for_all_that_drifts(gusty: tuple[Fitter, Explanation]) -> None:
    fitter, found = gusty
    among = beside(fitter, found.fit.relative_wander)
    task = (Fitter.grown, (found, "heave_pitch_rate_coupling", []))
    with Workers(fitter, 2) as workers:
        (plain,) = workers.results([(Fitter.grown, (fitter.base, "heave_pitch_rate_coupling", []))])
        (here,) = workers.beside(among).results([task])
    assert not plain.fit.has_coloured_noise
    np.testing.assert_allclose(here.fit.wander[2], found.fit.wander[2], rtol=0.1)
    assert here.bic == pytest.approx(among.grown(found, "heave_pitch_rate_coupling", []).bic, abs=1e-6)


def test_what_was_found_beside_drift_that_is_not_there_is_remembered(
    gusty: tuple[Fitter, Explanation], monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter, found = gusty
    coupled = fitter.grown(fitter.base, "heave_pitch_rate_coupling", [])
    search = Search(fitter, Workers(fitter, 1), lambda _: None, fitter.base, fitter.root)
    monkeypatch.setattr(drifts, "drifting", lambda *_: None)
    monkeypatch.setattr(drifts, "form_gains", lambda *_: {})
    monkeypatch.setattr(drifts, "with_more", lambda _, one, **__: one)
    monkeypatch.setattr(Search, "run_from", lambda *_: coupled)
    assert in_drift(search, found) is None
    assert coupled.names in search.tried


def test_a_form_of_unknown_physics_may_have_passed_for_drift(
    gusty: tuple[Fitter, Explanation], monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter, found = gusty
    search = Search(fitter, Workers(fitter, 1), lambda _: None, fitter.base, fitter.root)
    monkeypatch.setattr(drifts, "drifting", lambda *_: None)
    monkeypatch.setattr(
        drifts, "form_gains", lambda *_: {"unknown_force_w_w": 1e3, "unknown_moment_w_w": 0.0}
    )
    monkeypatch.setattr(drifts, "with_more", lambda _, one, **__: one)
    monkeypatch.setattr(Search, "run_from", lambda *_: found)
    assert in_drift(search, found) is None
    (with_form,) = (names for names in search.tried if "unknown_force_w_w" in names)
    assert {*ORDINARY} < with_form
    assert not search.tried[with_form].fit.has_coloured_noise


@pytest.mark.parametrize(("a_sample", "is_pushed"), [(1.0, True), (0.3, False)])
def test_forces_that_are_far_likelier_than_drift_end_the_search_for_what_leaves_nothing(
    gusty: tuple[Fitter, Explanation], monkeypatch: pytest.MonkeyPatch, a_sample: float, is_pushed: bool
) -> None:
    fitter, found = gusty
    search = Search(fitter, Workers(fitter, 1), lambda _: None, fitter.base, fitter.root)
    forced = replace(found, bic=found.bic - a_sample * found.fit.samples)
    monkeypatch.setattr(drifts, "drifting", lambda *_: found)
    monkeypatch.setattr(drifts, "with_sea", lambda *_: forced)
    monkeypatch.setattr(drifts, "_instead", lambda *_: search.remember(replace(found, names=frozenset())))
    monkeypatch.setattr(Search, "run_from", lambda *_: found)
    assert in_drift(search, found) is None
    assert search.pushed is forced
    assert search.is_pushed_about == is_pushed
    assert seas._in_seas(search, found)[1] is forced


def test_what_drifts_on_a_part_is_looked_for_on_the_whole(gusty: tuple[Fitter, Explanation]) -> None:
    fitter, found = gusty
    search = Search(fitter, Workers(fitter, 1), lambda _: None, found, found)
    part = Explained(found, search, leftover(beside(fitter, found.fit.relative_wander), found), None)
    whole = Fitter([in_gusts(nothing)])
    told = again_in_drift(whole, Workers(whole, 1), lambda _: None, part)
    assert told.left.is_nothing
    assert not told.best.names
    assert np.sqrt(told.best.fit.wander[2, 0]) == pytest.approx(0.05, rel=0.4)


def test_no_form_of_unknown_physics_is_carried_into_what_drifts(
    gusty: tuple[Fitter, Explanation], monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter, drifted = gusty
    form = next(iter(UNKNOWN))
    names = frozenset({"actuator_lag", form})
    begun: list[Explanation] = []
    monkeypatch.setattr(drifts, "drifting", lambda _, one: begun.append(one) or drifted)
    with Workers(fitter, 1) as workers:
        calm = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        point = fitter.point(frozenset({"actuator_lag"}), fitter.base, "actuator_lag", np.array([0.1]))
        best = fitter.explained(names, fitter.grown(fitter.root, form, []).fit)
        monkeypatch.setattr(fitter, "point", lambda *_: point)
        assert among_drift(calm, Explanation(best.names, best.fit, -1e9)) is None  # as nothing is likelier
    assert begun[0].names == {"actuator_lag"}
    assert hash(begun[0].names) == hash(frozenset({"actuator_lag"}))  # by which a search remembers it
