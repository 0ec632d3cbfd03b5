"""The live alarm: every kind of change is told once and in its slot, and nothing where nothing changes."""

import json
import math
from collections.abc import Iterator
from dataclasses import asdict, replace
from itertools import chain
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_live import Run

from bridge.measurement import Measurement, Quantity
from firmware_model.config import EstimatorConfig
from firmware_model.sample import Sample
from host.errors import ConfigError
from host.live.journal import read_journal
from host.live.mismatch import SLOTS, Mismatch, MismatchConfig, MismatchWatch
from host.live.prediction_window import PredictionWindow
from host.live.reference import Reference, read_reference, reference_of

H = 0.1
VEHICLE = Reference(a1=-0.63, a2=-3.39, a3=-8.2, b1=0.41, b2=-3.94, u0=2.5)
ESTIMATOR = EstimatorConfig(step=H, speed=2.5)
QUICK = {"settling": 90.0, "memory": 300.0, "refresh": 20.0}


def dive(
    seconds: float,
    *,
    at: float = math.inf,
    plane: float = 1.0,
    heave: float = 0.0,
    pitch: float = 0.0,
    current: float = 0.0,
    datum: float = 0.0,
    noise: float = 1.0,
    lively_at: float = 0.0,
    seed: int = 1,
) -> Iterator[Sample]:
    """A linear vehicle under random steps of its plane, by Euler steps of 10 ms; changed from `at` s on."""
    rng = np.random.default_rng(seed)
    w = q = theta = 0.0
    zeta, delta, until = 20.0, 0.0, 0
    for k in range(round(seconds / H)):
        if k >= until:
            until = k + int(rng.integers(10, 60))
            delta = float(rng.uniform(-0.2, 0.2)) * (1.0 if k * H >= lively_at else 0.2)
        is_changed = k * H >= at
        yield Sample(
            t_us=k * 100_000,
            depth=zeta + noise * 0.01 * rng.normal(),
            pitch=theta + is_changed * datum + noise * 0.0017 * rng.normal(),
            rudder=delta,
        )
        force = delta * (plane if is_changed else 1.0)
        for _ in range(10):
            w, q, theta, zeta = (
                w + 0.01 * (VEHICLE.a1 * w + VEHICLE.b1 * force + is_changed * heave),
                q + 0.01 * (VEHICLE.a2 * q + VEHICLE.a3 * theta + VEHICLE.b2 * force + is_changed * pitch),
                theta + 0.01 * q,
                zeta + 0.01 * (w - VEHICLE.u0 * theta + is_changed * current),
            )


def alarms(samples: Iterator[Sample], known: Reference = VEHICLE, **settings: Any) -> list[Mismatch]:
    """What a watch tells that knows the vehicle beforehand."""
    watch = MismatchWatch(MismatchConfig(**(QUICK | settings)), ESTIMATOR)
    estimate: Any = SimpleNamespace(**asdict(known), updates=100_000)
    told = [watch.push(sample, estimate if watch.wants_estimate else None) for sample in samples]
    return [mismatch for mismatch in told if mismatch is not None]


@pytest.mark.parametrize(
    ("change", "slots"),
    [
        ({"plane": 0.7}, {"actuator"}),
        ({"heave": 0.05}, {"heave"}),
        ({"current": 0.08}, {"heave"}),
        ({"pitch": 0.2}, {"pitch"}),
        ({"datum": 0.02}, {"sensor", "pitch"}),
    ],
)
def test_a_change_is_told_once_in_its_slot_within_30_s(change: dict[str, float], slots: set[str]) -> None:
    (told,) = alarms(dive(360.0, at=300.0, **change))
    assert 0.0 < told.t_us / 1e6 - 300.0 <= 30.0
    assert told.slot in slots
    assert told.ratio > 1.3
    assert len(told.notice) <= 50
    assert SLOTS[round(told.values["mismatch"])] == told.slot


def test_nothing_is_told_where_nothing_changes() -> None:
    assert alarms(dive(1200.0, seed=5)) == []


def test_a_model_that_was_wrong_all_along_sets_its_own_level() -> None:
    assert alarms(dive(600.0), replace(VEHICLE, b2=-3.0, a1=-0.5)) == []
    (told,) = alarms(dive(360.0, at=300.0, plane=0.4), replace(VEHICLE, b2=-3.4))
    assert told.slot == "actuator"


def test_livelier_steering_of_a_wrong_model_is_no_mismatch() -> None:
    told = alarms(dive(500.0, lively_at=400.0), replace(VEHICLE, b2=-3.5), settling=250.0)
    assert told == []


def test_it_arms_again_and_tells_the_next_change() -> None:
    first = dive(300.0, at=240.0, plane=0.6)
    second = (replace(s, t_us=s.t_us + 300_000_000) for s in dive(500.0, at=400.0, pitch=0.5, seed=3))
    told = alarms(chain(first, second))
    assert [mismatch.t_us > 700_000_000 for mismatch in told] == [False, True]


def test_the_reference_is_not_taken_from_an_estimate_that_learns_the_fault() -> None:
    watch = MismatchWatch(MismatchConfig(**QUICK), ESTIMATOR)
    told = []
    for sample in dive(360.0, at=300.0, plane=0.7):
        # An estimator that knows the fault at once.
        gain = 0.7 if sample.t_us >= 300_000_000 else 1.0
        known = replace(VEHICLE, b1=gain * VEHICLE.b1, b2=gain * VEHICLE.b2)
        estimate: Any = SimpleNamespace(**asdict(known), updates=100_000)
        told.append(watch.push(sample, estimate if watch.wants_estimate else None))
    assert sum(mismatch is not None for mismatch in told) == 1


def test_a_gap_is_not_bridged() -> None:
    window = PredictionWindow(50, H)
    for sample in dive(4.9):
        window.push(sample)
    assert not window.is_full
    window.push(Sample(t_us=60_000_000, depth=1.0, pitch=0.0, rudder=0.0))
    for sample in dive(4.8):
        window.push(replace(sample, t_us=sample.t_us + 60_100_000))
    assert not window.is_full
    window.push(Sample(t_us=64_900_000, depth=1.0, pitch=0.0, rudder=0.0))
    assert window.is_full


def test_the_right_model_misses_nothing_but_the_noise() -> None:
    window = PredictionWindow(100, H)
    for sample in dive(30.0, noise=0.0):
        window.push(sample)
    errors = window.errors(VEHICLE, np.array([0.0017, 0.01]))
    assert (errors < 0.15).all()  # Euler's steps are not exact


def test_outliers_and_gaps_of_a_sensor_do_no_harm() -> None:
    levels = np.array([0.0017, 0.01])
    windows = PredictionWindow(100, H), PredictionWindow(100, H)
    for k, sample in enumerate(dive(20.0)):
        windows[0].push(sample)
        hurt = replace(sample, depth=sample.depth + 5.0) if k == 150 else sample
        windows[1].push(replace(hurt, pitch=math.nan) if k % 7 == 0 else hurt)
    clean, hurt = (window.errors(VEHICLE, levels) for window in windows)
    assert hurt == pytest.approx(clean, rel=0.3)


def test_a_plane_that_was_not_heard_for_a_while_was_on_its_way() -> None:
    windows = PredictionWindow(100, H), PredictionWindow(100, H)
    for k, sample in enumerate(dive(10.3)):
        turning = replace(sample, rudder=0.002 * k)
        windows[0].push(turning)
        windows[1].push(replace(turning, rudder=math.nan) if k % 4 else turning)
        if k % 4 == 0 and windows[1].is_full:
            always, seldom = (window.errors(VEHICLE, np.array([0.0017, 0.01])) for window in windows)
            assert seldom == pytest.approx(always, rel=1e-6)


def model_file(path: Path, **changes: Any) -> Path:
    parameters = {name: {"value": value} for name, value in (asdict(VEHICLE) | changes).items()}
    path.write_text(json.dumps({"schema": 1, "parameters": parameters, "effects": []}))
    return path


def test_a_model_file_may_be_the_reference(tmp_path: Path) -> None:
    assert read_reference(model_file(tmp_path / "model.json")) == VEHICLE
    watch = MismatchWatch(MismatchConfig(model=model_file(tmp_path / "m.json"), **QUICK), ESTIMATOR)
    told = []
    for sample in dive(360.0, at=300.0, plane=0.7):
        assert not watch.wants_estimate
        told.append(watch.push(sample))
    assert sum(mismatch is not None for mismatch in told) == 1


@pytest.mark.parametrize("text", ["", "[]", '{"parameters": {"a1": 3}}', '{"parameters": {}}'])
def test_a_model_file_that_is_none_is_one_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "model.json").write_text(text)
    with pytest.raises(ConfigError, match=r"mismatch\.model .*model\.json") as error:
        read_reference(tmp_path / "model.json")
    assert "\n" not in str(error.value)


def test_a_model_that_runs_away_or_is_missing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="stable"):
        read_reference(model_file(tmp_path / "model.json", a3=5.0))
    with pytest.raises(ConfigError, match="goes ahead"):
        read_reference(model_file(tmp_path / "model.json", u0=0.0))
    with pytest.raises(ConfigError, match="cannot be read"):
        read_reference(tmp_path / "none.json")


@pytest.mark.parametrize(
    "wrong", [{"horizon": 0.0}, {"threshold": -1.0}, {"persistence": 0}, {"settling": -1.0}, {"memory": 0.0}]
)
def test_settings_out_of_range_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=f"{next(iter(wrong))} must be"):
        MismatchConfig(**wrong)


def script(samples: Iterator[Sample]) -> list[Any]:
    return [
        [
            Measurement(quantity=quantity, value=value, t_us=s.t_us, source="test", boot=0)
            for quantity, value in (
                (Quantity.PITCH, s.pitch),
                (Quantity.DEPTH, s.depth),
                (Quantity.RUDDER, s.rudder),
            )
        ]
        for s in samples
    ]


def test_an_alarm_is_said_published_once_and_marked_in_a_journal_that_shows_it_again(tmp_path: Path) -> None:
    model = model_file(tmp_path / "model.json")
    settings = QUICK | {"model": str(model)}
    run = Run(tmp_path, script(dive(360.0, at=300.0, plane=0.6)), mismatch=settings)
    end = run.run()
    assert end.alarms == 1
    ((t_us, notice, values),) = run.sources[0].warned
    assert notice.startswith("mils mismatch: actuator")
    assert values["mismatch"] == SLOTS.index("actuator")
    assert sum("no longer moves as predicted" in sentence for sentence in run.said) == 1
    (mark,) = [event for event in run.journal.events if event["event"] == "mismatch"]
    assert (mark["t_us"], mark["slot"], mark["detail"]) == (
        t_us,
        "actuator",
        end.mismatch and end.mismatch.sentence,
    )
    # The journal's measurements, run again, give the same alarm.
    recorded = read_journal(run.path)
    assert recorded.counts["damaged"] == 0
    again = Run(tmp_path / "again", [[m] for m in recorded.measurements], mismatch=settings)
    again.run()
    assert [warned[:2] for warned in again.sources[0].warned] == [(t_us, notice)]


def test_it_can_be_switched_off(tmp_path: Path) -> None:
    run = Run(tmp_path, script(dive(20.0)), mismatch={"enabled": False})
    end = run.run()
    assert (end.alarms, end.mismatch) == (0, None)


def test_an_estimate_without_coupling_is_a_reference_without_it() -> None:
    estimate: Any = SimpleNamespace(**(asdict(VEHICLE) | {"c_wq": math.nan}))
    assert reference_of(estimate) == VEHICLE


def test_sensors_that_become_much_noisier_are_told_and_no_change_is_blamed() -> None:
    rng = np.random.default_rng(4)
    noisy = (
        replace(s, depth=s.depth + 0.2 * rng.normal(), pitch=s.pitch + 0.03 * rng.normal())
        if s.t_us >= 400_000_000
        else s
        for s in dive(440.0)
    )
    (told,) = alarms(noisy)
    assert told.slot == "unknown"
    assert told.ratio > 4.0


def test_evidence_is_no_alarm_while_the_free_run_misses_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    fault = {"at": 300.0, "plane": 0.7}
    assert len(alarms(dive(330.0, **fault))) == 1
    monkeypatch.setattr(PredictionWindow, "errors", lambda *_: np.ones(2))
    assert alarms(dive(330.0, **fault)) == []
