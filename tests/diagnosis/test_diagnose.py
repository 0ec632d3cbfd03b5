"""Hidden physics is found, nothing is found where nothing is hidden, and the answer can be used."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.diagnose import Diagnosis, diagnose
from host.diagnosis.recordings.spans import clear_of, divide
from host.noise.noise_floor import noise_floor
from tools.cli import main


def test_noise_floor_is_that_of_the_sensors() -> None:
    floor = np.sqrt(noise_floor([hidden_dive()]))
    assert floor == pytest.approx([np.deg2rad(0.1), 0.01], rel=0.15)


def test_noise_floor_of_a_channel_slower_than_the_grid() -> None:
    dive = hidden_dive()
    dive.depth[1::2] = np.nan
    assert np.sqrt(noise_floor([dive])[1]) == pytest.approx(0.01, rel=0.2)


def test_judging_spans_teach_nothing() -> None:
    recording = hidden_dive()
    spans = divide([recording])
    (teaching,) = spans.teaching
    judged = np.isin(recording.time, np.concatenate([piece.time for piece in spans.judging]))
    np.testing.assert_array_equal(teaching.time, recording.time)
    assert np.isnan(teaching.depth[judged]).all()
    assert np.isnan(teaching.pitch[judged]).all()
    np.testing.assert_array_equal(teaching.pitch[~judged], recording.pitch[~judged])
    assert 0.15 < judged.mean() < 0.35
    (unseen,) = spans.unseen
    np.testing.assert_array_equal(np.isfinite(unseen.depth), judged)
    np.testing.assert_array_equal(unseen.depth[judged], recording.depth[judged])


def test_a_stretch_in_which_something_changed_does_not_judge() -> None:
    spans = divide([hidden_dive(duration=100.0)])
    first, second = spans.judging
    inside = float(first.time[3])
    rest = clear_of(spans, [inside])
    assert [piece.time[0] for piece in rest.judging] == [second.time[0]]
    (unseen,) = rest.unseen
    known = unseen.time[np.isfinite(unseen.depth)]
    assert known.min() == pytest.approx(second.time[0])
    assert known.max() == pytest.approx(second.time[-1])
    assert clear_of(spans, [float(first.time[0]) - 1.0]).judging == spans.judging
    assert clear_of(spans, [inside, float(second.time[3])]) is spans  # else none would judge
    several = replace(spans, teaching=[*spans.teaching, replace(spans.teaching[0], name="other.csv")])
    assert clear_of(several, [inside]) is several


@pytest.mark.parametrize(("every", "readings"), [(5, [24, 24]), (10, [])])
def test_a_slow_sensor_judges_by_longer_stretches_while_these_leave_enough_to_learn(
    every: int, readings: list[int]
) -> None:
    recording = hidden_dive(duration=90.0)
    slow = np.where(np.arange(recording.time.size) % every == 0, recording.depth, np.nan)
    judging = divide([replace(recording, depth=slow)]).judging
    assert [int(np.isfinite(span.depth).sum()) for span in judging] == readings


def test_of_many_short_dives_every_third_judges() -> None:
    dives = [hidden_dive(seed=seed, duration=20.0) for seed in range(5)]
    spans = divide(dives)
    assert [dive is dives[i] for dive, i in zip(spans.judging, (1, 4), strict=True)] == [True, True]
    assert len(spans.teaching) == 3


def test_nothing_hidden_is_no_mismatch() -> None:
    found = diagnose([hidden_dive()])
    assert found.verdict == "no_mismatch"
    assert not found.effects
    assert sum(found.slots.values()) == 0.0


def test_coupling_of_pitch_rate_into_heave_is_named_with_its_coefficient(coupled: Diagnosis) -> None:
    found = coupled
    assert found.verdict == "explained"
    assert found.effects[0].name == "heave_pitch_rate_coupling"
    value, std, unit = found.effects[0].coefficients["c_wq"]
    assert unit == "m/s"
    assert abs(value - 0.8) < 4.0 * std
    assert sum(found.slots.values()) == pytest.approx(1.0)
    assert found.extended_misfit.chi2 < found.base_misfit.chi2
    assert found.effects[0].heldout_gain > 0.0
    # With one input and u0 unknown a lever arm gives the same transfer function: it must be admitted.
    assert "depth_sensor_lever_arm" in found.effects[0].twins


def test_spikes_change_no_name(coupled: Diagnosis) -> None:
    dive = hidden_dive(lambda _, x, __: (0.8 * x[1], 0.0, 0.0), seed=1)
    rng = np.random.default_rng(5)
    for channel, size in ((dive.depth, 4.0), (dive.pitch, 0.4)):
        at = rng.choice(dive.time.size, dive.time.size // 100, replace=False)
        channel[at] += size * rng.choice([-1.0, 1.0], at.size)
    found = diagnose([dive])
    assert [effect.name for effect in found.effects] == [effect.name for effect in coupled.effects]
    assert found.verdict == coupled.verdict
    assert found.recordings[0].counts["outlier.depth"] == 9


@pytest.mark.long
def test_two_hidden_effects_are_both_named() -> None:
    def both(_: float, x: np.ndarray, __: float) -> tuple[float, float, float]:  # type: ignore[type-arg]
        return -1.5 * x[0] * abs(x[0]) + 0.8 * x[1], 0.0, 0.0

    found = diagnose([hidden_dive(both, duration=200.0)])
    assert {"heave_pitch_rate_coupling", "heave_quadratic_drag"} <= {e.name for e in found.effects}


def test_the_command_writes_an_answer_that_can_be_simulated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dive = hidden_dive(lambda _, x, __: (0.8 * x[1], 0.0, 0.0), seed=1, duration=70.0)
    path = tmp_path / "dive.csv"
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time_s", "depth_m", "pitch_rad", "rudder_rad"])
        writer.writerows(zip(dive.time, dive.depth, dive.pitch, dive.rudder, strict=True))
    assert main(["diagnose", str(path), "--out", str(tmp_path), "--quiet"]) in (0, 1)
    assert "heave_pitch_rate_coupling" in capsys.readouterr().out
    answer = json.loads((tmp_path / "diagnosis.json").read_text())
    assert set(answer) >= {"schema", "verdict", "base", "location", "effects", "extended", "remaining"}
    assert answer["effects"][0]["name"] == "heave_pitch_rate_coupling"
    assert sum(answer["location"]["slots"].values()) == pytest.approx(1.0)
    page = (tmp_path / "report.html").read_text()
    assert page.count("data:image/png;base64,") >= 4
    assert "https://" not in page
    score = tmp_path / "score.json"
    assert main(["predict", str(tmp_path / "extended_model.json"), str(path), "--json", str(score)]) == 0
    assert json.loads(score.read_text())["depth_rmse_m"] < 0.05
    sim = tmp_path / "sim.csv"
    assert main(["simulate", str(tmp_path / "extended_model.json"), str(path), "--out", str(sim)]) == 0
