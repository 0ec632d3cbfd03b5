"""Whether a plane held its angles between the rows of a recording, or moved on."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal, cast

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive
from scipy.integrate import solve_ivp

from host.diagnosis.diagnose import _is_no_better, diagnose
from host.diagnosis.disturbances.seas import Explained
from host.diagnosis.explain import explain
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.sea_fits import with_waves
from host.diagnosis.fits.workers import Workers
from host.diagnosis.plane_choice import (
    _among_waves,
    _is_whole_likelier,
    by_single_effects,
    is_likelier,
    ways,
)
from host.diagnosis.search.search import Search
from host.diagnosis.told.files import write_extended_model
from host.dynamics.equations import NAMES
from host.errors import RecordingError
from host.identification.identify import identify
from host.identification.model import model_of, read_model, write_model
from host.identification.predict import predict
from host.identification.simulate import simulate
from host.recordings.plane_between_rows import NOTE, with_moving_plane
from host.recordings.recording import Array, Recording
from host.vehicle import default_vehicle

STEP = 0.1  # s
Way = Literal["held", "moving"]


def plane(time: float | Array) -> Array:
    return np.asarray(0.12 * np.sin(1.7 * time) + 0.1 * np.sin(0.7 * time + 1.0))


def dive(way: Way, *, carried: float = 0.0) -> Recording:
    """The paper's vehicle with a plane that swings, read off every 0.1 s; waves carry it, m/s each."""
    rng, time = np.random.default_rng(2), np.arange(600) * STEP
    met, phase = np.linspace(0.9, 1.5, 12), rng.uniform(0.0, 2.0 * np.pi, 12)  # rad/s

    def rate(t: float, x: Array) -> list[float]:
        w, q, theta, _ = x
        angle = plane(t if way == "moving" else STEP * np.floor(t / STEP + 1e-9))
        return [
            BASE["a1"] * w + BASE["b1"] * angle,
            BASE["a2"] * q + BASE["a3"] * theta + BASE["b2"] * angle,
            q,
            w - BASE["u0"] * theta + carried * float(np.sin(met * t + phase).sum()),
        ]

    start = [0.0, 0.0, 0.0, 20.0]
    states = solve_ivp(rate, (0.0, time[-1]), start, t_eval=time, rtol=1e-7, atol=1e-9, max_step=STEP / 2).y
    nan = np.full(time.size, np.nan)
    return replace(
        hidden_dive(duration=1.0),
        time=time,
        pitch=states[2] + np.deg2rad(0.05) * rng.standard_normal(time.size),
        depth=states[3] + 0.005 * rng.standard_normal(time.size),
        rudder=plane(time),
        speed=nan,
        pitch_rate=nan,
        step=STEP,
    )


def real_dive(*, lag: float) -> Recording:
    """A hull with coupling and drag whose plane follows held commands with a lag, s."""
    time = np.arange(500) * STEP
    commands = 0.15 * np.sin(2.7 * time) + 0.15 * np.sin(1.1 * time + 1.0) + 0.1 * np.sin(5.3 * time)

    def rate(t: float, x: Array) -> list[float]:
        w, q, theta, _, angle = x
        command = commands[min(int(t / STEP + 1e-9), time.size - 1)]
        return [
            BASE["a1"] * w + 0.9 * q + BASE["b1"] * angle,
            BASE["a2"] * q - 4.0 * q * abs(q) + BASE["a3"] * theta + BASE["b2"] * angle,
            q,
            w - BASE["u0"] * theta,
            (command - angle) / lag,
        ]

    start = [0.0, 0.0, 0.0, 20.0, commands[0]]
    states = solve_ivp(rate, (0.0, time[-1]), start, t_eval=time, rtol=1e-7, atol=1e-9, max_step=STEP / 4).y
    rng = np.random.default_rng(4)
    return replace(
        dive("held"),
        time=time,
        pitch=states[2] + np.deg2rad(0.05) * rng.standard_normal(time.size),
        depth=states[3] + 0.005 * rng.standard_normal(time.size),
        rudder=commands,
        speed=np.full(time.size, np.nan),
        pitch_rate=np.full(time.size, np.nan),
    )


def test_all_that_a_vehicle_has_may_speak_for_the_other_way() -> None:
    held = real_dive(lag=0.1)
    fitters = {"held": Fitter([held]), "moving": Fitter([with_moving_plane(held)])}
    names = ("heave_pitch_rate_coupling", "pitch_quadratic_damping", "actuator_delay")
    for way, other in (("held", "moving"), ("moving", "held")):
        search = searched(fitters[way])
        best = search.base
        for name in names:
            best = search.fitter.grown(best, name, [])
        best = search.fitter.polished(best)
        assert _is_whole_likelier(fitters[other], search, best) is (other == "held")


def searched(fitter: Fitter) -> Search:
    return Search(fitter, Workers(fitter, 1), lambda _: None, fitter.base, fitter.root)


def test_a_plane_that_moves_on_is_taken_at_its_mean_and_a_step_stays_a_step() -> None:
    swinging = dive("moving")
    mean = np.array([plane(np.linspace(t, t + STEP, 21)).mean() for t in swinging.time])
    held, moving = (
        np.sqrt(np.mean((each.rudder - mean)[2:-3] ** 2)) for each in (swinging, with_moving_plane(swinging))
    )
    assert moving < 0.1 * held
    stepped = hidden_dive(seed=1)
    assert np.array_equal(with_moving_plane(stepped).rudder, stepped.rudder)
    assert [way.recordings for way in ways([stepped])] == [[stepped]]


@pytest.mark.parametrize("way", ["held", "moving"])
def test_what_the_plane_did_is_read_off_the_motion(way: Way) -> None:
    recording = dive(way)
    first, second = ways([recording])
    assert (NOTE in first.recordings[0].notes) == (way == "moving")
    assert is_likelier(first, searched(second.fitter), second.fitter.base)
    assert not is_likelier(second, searched(first.fitter), first.fitter.base)


def test_among_waves_the_other_way_is_asked_with_waves_of_its_own() -> None:
    first, second = _among_waves(ways([dive("moving", carried=0.02)]))
    assert first.waves is not None
    assert second.waves is not None
    assert NOTE in first.recordings[0].notes
    held, moving = (with_waves(way.fitter, way.fitter.base) for way in (second, first))
    assert is_likelier(first, searched(second.fitter), second.fitter.base, held)
    assert not is_likelier(second, searched(first.fitter), first.fitter.base, moving)


def test_a_set_that_came_close_may_speak_for_the_other_way() -> None:
    right, wrong = ways([dive("moving")])
    least = right.fitter.base.bic
    idle = right.fitter.grown(right.fitter.base, "munk_moment", []).bic
    assert idle > least
    # So good that it would not do better the other way, but the base would.
    best = replace(wrong.fitter.grown(wrong.fitter.base, "munk_moment", []), bic=0.5 * (least + idle) + 6.0)
    search = searched(wrong.fitter)
    assert not is_likelier(right, search, best)
    search.remember(wrong.fitter.root)
    assert is_likelier(right, search, best)


@pytest.mark.parametrize("way", ["held", "moving"])
def test_identification_reads_it_off_the_motion_too(way: Way) -> None:
    model = identify([dive(way)], default_vehicle()).model
    assert model.has_moving_plane == (way == "moving")
    for name in ("a2", "a3", "b2"):
        assert model.values[name] == pytest.approx(BASE[name], abs=4.0 * model.std[name])
        assert model.std[name] < 0.02 * abs(BASE[name])
    on_board = identify([dive(way)], default_vehicle(), "mils").model
    assert not on_board.has_moving_plane


def test_a_moving_plane_is_not_taken_for_physics_and_the_model_moves_it_again(tmp_path: Path) -> None:
    recording = dive("moving")
    found = diagnose([recording])
    assert found.verdict == "no_mismatch"
    assert NOTE in found.recordings[0].notes
    write_extended_model(found, default_vehicle(), path := tmp_path / "extended_model.json")
    model = read_model(path)
    assert model.has_moving_plane
    moved, held = (predict(replace(model, has_moving_plane=flag), recording).score for flag in (True, False))
    assert moved.pitch_rmse_rad < 0.8 * held.pitch_rmse_rad
    assert np.array_equal(simulate(model, recording).rudder, recording.rudder)


def test_a_model_file_says_what_the_plane_does_or_the_plane_is_held(tmp_path: Path) -> None:
    found = Fitter([hidden_dive(duration=20.0)])
    values = dict(zip(NAMES, found.base.fit.parameters[: len(NAMES)].tolist(), strict=True))
    write_model(model_of(found.recordings, "v", "ml", values, dict.fromkeys(NAMES, 0.0)), tmp_path / "m.json")
    document = json.loads((tmp_path / "m.json").read_text())
    assert document["plane_between_rows"] == "held"
    del document["plane_between_rows"]
    (tmp_path / "m.json").write_text(json.dumps(document))
    assert not read_model(tmp_path / "m.json").has_moving_plane
    (tmp_path / "m.json").write_text(json.dumps(document | {"plane_between_rows": "flying"}))
    with pytest.raises(RecordingError, match="must be 'held' or 'moving'"):
        read_model(tmp_path / "m.json")


def test_a_linear_hull_may_speak_against_the_base() -> None:
    found = ways([dive("moving")])
    turned, again = by_single_effects(found[::-1], lambda _: None, 1)
    assert turned.recordings is found[0].recordings
    assert [bool(one.alone) for one in (turned, again)] == [True, False]  # before any effect is tried


def test_what_explains_most_alone_may_speak_against_the_base(monkeypatch: pytest.MonkeyPatch) -> None:
    found = ways([dive("moving")])
    kept, *_ = by_single_effects(found, lambda _: None, 1)
    right, wrong = (way.fitter for way in found)
    wrong_root = wrong.root
    monkeypatch.setattr(wrong, "linear", wrong_root)
    for name in ("root", "linear"):  # as if neither said so
        monkeypatch.setattr(right, name, replace(right.root, bic=wrong_root.bic + 1.0))
    turned, again = by_single_effects(found[::-1], lambda _: None, 1)
    assert kept.recordings is turned.recordings is found[0].recordings
    assert [e.names for e in turned.alone] == [e.names for e in again.alone]  # begun where the others ended
    assert min(e.bic for e in turned.alone) < min(e.bic for e in again.alone)
    assert by_single_effects([found[0]], lambda _: None, 1) == [found[0]]  # no other way: not asked


@pytest.mark.long
def test_what_is_found_may_speak_against_the_first_choice(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("host.diagnosis.diagnose.ways", lambda recordings: ways(recordings)[::-1])
    monkeypatch.setattr("host.diagnosis.diagnose.likelier_first", lambda found, *_: found)
    begun: list[tuple[Explanation | None, bool]] = []
    found_so: list[Explanation] = []

    def explain_and_note(*args: Any, like: Explanation | None, is_second: bool) -> Explained:
        begun.append((like, is_second))
        explained = explain(*args, like=like, is_second=is_second)
        found_so.append(explained.best)
        return explained

    monkeypatch.setattr("host.diagnosis.diagnose.explain", explain_and_note)
    found = diagnose([dive("moving")])
    assert begun == [
        (None, False),
        (found_so[0], True),
    ]  # what was found with the plane the wrong way is begun with
    assert found.ranking
    assert found.verdict == "no_mismatch"
    assert NOTE in found.recordings[0].notes


@pytest.mark.parametrize(
    ("second", "has_sea", "first", "is_no_better"),
    [
        (-9.0, False, -10.0, True),
        (-15.0, False, -10.0, True),
        (-17.0, False, -10.0, False),
        (-9.0, True, -10.0, False),
    ],
)
def test_two_ways_are_compared_where_neither_is_among_forces(
    second: float, has_sea: bool, first: float, is_no_better: bool
) -> None:
    best = SimpleNamespace(bic=first, fit=SimpleNamespace(has_process_noise=has_sea))
    found, before = SimpleNamespace(bic=second, has_sea=False), SimpleNamespace(best=best)
    assert _is_no_better(cast("Any", found), cast("Any", before)) == is_no_better


@pytest.mark.long
def test_what_promised_more_the_other_way_but_came_to_less_is_not_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said: list[str] = []
    known = diagnose([dive("moving")])
    monkeypatch.setattr("host.diagnosis.diagnose.is_likelier", lambda *_: True)
    found = diagnose([dive("moving")], said.append)
    assert "the plane between rows" in said
    assert found.bic == known.bic
    assert found.recordings[0].has_moving_plane
    assert found.verdict == known.verdict
