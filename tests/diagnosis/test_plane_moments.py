"""When a plane stepped that was read in few of the rows."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis import plane_moments
from host.diagnosis.diagnose import diagnose
from host.diagnosis.plane_moments import with_plane_moments
from host.diagnosis.recordings.spans import divide
from host.diagnosis.recordings.unseen_steps import UnseenSteps
from host.recordings.plane_in_table import plane_readings
from host.recordings.recording import Array, Recording, split_at_gaps
from tools.cli import main


def read_every(dive: Recording, rows: int) -> Recording:
    """The dive with a plane that was read in every so many rows, as its table is read."""
    seen = np.where(np.arange(dive.time.size) % rows == 0, dive.rudder, np.nan)
    told = replace(dive, rudder=seen, plane=plane_readings(dive.time, seen, dive.step))
    (recording,) = split_at_gaps(told, 1.0)
    return recording


def drag(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return -1.5 * x[0] * abs(x[0]), 0.0, 0.0


@pytest.mark.parametrize("rows", [2, 5])
def test_each_step_is_put_where_it_was(rows: int) -> None:
    true = hidden_dive()
    seen = read_every(true, rows)
    (moved,) = with_plane_moments([seen])
    late, left = (np.std(one.rudder - true.rudder) for one in (seen, moved))
    assert left < 0.2 * late
    assert np.mean(np.isclose(moved.rudder, true.rudder)) > 0.99
    assert moved.notes[-1].startswith("the plane was not read in every row: when it stepped")
    doubt = moved.plane_doubt
    assert doubt is not None
    assert doubt.shape == (UnseenSteps([seen]).mean.size, 2, seen.time.size)


def test_a_plane_that_is_told_when_it_is_read_holds_until_then() -> None:
    dive = hidden_dive()
    assert with_plane_moments(whole := [dive]) is whole
    count = 2 * dive.time.size
    known = np.arange(count) % 2 == 0
    between = {name: np.full(count, np.nan) for name in ("depth", "pitch", "rudder")}
    for name, column in between.items():
        column[known] = getattr(dive, name)
    time, nan = 0.05 * np.arange(count), np.full(count, np.nan)
    plane = plane_readings(time, between["rudder"], 0.05)
    finer = replace(dive, time=time, speed=nan, pitch_rate=nan, step=0.05, plane=plane, **between)
    told = split_at_gaps(finer, 1.0)
    assert UnseenSteps(told).steps
    assert with_plane_moments(told) is told


@pytest.mark.long
def test_where_each_row_may_have_a_reading_moments_must_differ(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = read_every(hidden_dive(), 5)
    assert seen.plane is not None
    doubtful = [replace(seen, plane=replace(seen.plane, is_doubtful=True))]
    (moved,) = with_plane_moments(doubtful)
    assert moved.plane_doubt is not None
    monkeypatch.setattr(plane_moments, "SCATTERED", 0.4)  # more than moments anywhere from 0 to 1 do
    assert with_plane_moments(doubtful) is doubtful


def test_where_the_vehicle_runs_away_no_step_leads_anywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = [read_every(hidden_dive(duration=40.0), 5)]
    nothing = [(np.zeros((2, 3)), np.full((2, 40, 3), np.inf), np.full((2, 9, 3), np.nan))]
    monkeypatch.setattr(plane_moments, "_residuals", lambda *_: nothing)
    unseen = UnseenSteps(seen)
    moved = plane_moments._anew(unseen, unseen.mean)
    aim = plane_moments._likeliest(unseen, moved)
    assert aim.moments is moved.moments
    assert aim.charge == 0.0


@pytest.mark.parametrize("by", [np.nan, np.inf, 1e200])
def test_where_another_moment_leads_it_away_none_is_doubted(
    by: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = [read_every(hidden_dive(duration=40.0), 5)]
    unseen = UnseenSteps(seen)
    moved = plane_moments._anew(unseen, unseen.mean)
    away = [(np.zeros((2, 3)), np.zeros((2, 9, 3)), np.full((2, len(unseen.mean), 3), by))]
    monkeypatch.setattr(plane_moments, "_residuals", lambda *_: away)
    (told,) = plane_moments._with_doubt(unseen, moved)
    assert told.plane_doubt is None
    assert np.array_equal(told.rudder, unseen.moved(moved.moments)[0].rudder)


def test_stretches_have_their_part_of_the_doubt() -> None:
    (moved,) = with_plane_moments([read_every(hidden_dive(), 5)])
    part = moved.between(20.0, 30.0)
    within = UnseenSteps([part])
    assert 0 < len(within.steps) < len(UnseenSteps([moved]).steps)
    assert len(within.within(0, part)) == len(within.steps)
    assert moved.plane_doubt is not None
    assert part.plane_doubt is not None
    assert np.array_equal(part.plane_doubt, moved.plane_doubt[:, :, 200:300])
    (teaching,) = divide([moved]).teaching
    assert teaching.plane_doubt is not None
    assert teaching.plane_doubt.shape[2] == teaching.time.size


@pytest.mark.long
@pytest.mark.parametrize("rows", [2, 5])
def test_drag_is_named_although_the_plane_was_hardly_read(rows: int) -> None:
    found = diagnose([read_every(hidden_dive(drag), rows)])
    assert found.verdict == "explained"
    assert [effect.name for effect in found.effects] == ["heave_quadratic_drag"]
    value, std, _ = found.effects[0].coefficients["c_ww"]
    assert value == pytest.approx(-1.5, abs=3.0 * std)


@pytest.mark.long
def test_drag_is_named_from_messages_that_come_seldom(tmp_path: Path) -> None:
    sparse = tmp_path / "sparse.csv"
    words = ["--scenario", "sparse_telemetry", "--link", "none", "--speed", "100000", "--quiet"]
    assert main(["sitl", *words, "--record", str(sparse)]) == 0
    assert main(["diagnose", str(sparse), "--out", str(tmp_path / "out"), "--jobs", "1", "--quiet"]) == 0
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert found["verdict"] == "explained"
    assert [effect["name"] for effect in found["effects"]] == ["heave_quadratic_drag"]


@pytest.mark.long
def test_of_long_recordings_all_is_moved_though_an_excerpt_begins(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plane_moments, "excerpt", lambda runs: [runs[0].between(0.0, 30.0)])
    (moved,) = with_plane_moments([read_every(hidden_dive(), 5)])
    assert moved.plane_doubt is not None
    assert (np.abs(moved.plane_doubt[:, :, moved.time > 60.0]) > 0.0).any()


@pytest.mark.long
def test_nothing_is_named_where_nothing_is_hidden() -> None:
    found = diagnose([read_every(hidden_dive(), 5)])
    assert found.verdict == "no_mismatch"
    assert found.effects == []
