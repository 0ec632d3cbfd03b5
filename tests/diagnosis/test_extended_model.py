"""The model that a diagnosis hands back flies: on a voyage it never saw it beats the base equations."""

import csv
import json
from pathlib import Path

import pytest

from tools.cli import main

SCENARIO = """
flavour = "linear"
duration_s = 90.0
[effects]
heave_pitch_rate_coupling = 1.0
large_angle_restoring = 1.0
large_angle_kinematics = 1.0
[excitation]
program = "multistep"
amplitude = 0.3
[sensors.depth]
noise = 0.01
[sensors.pitch]
noise = 0.0017453
[sensors.speed]
noise = 0.02
"""


def voyage(tmp_path: Path, seed: int) -> Path:
    """A recording of the simulated vehicle with a speed sensor."""
    (tmp_path / "vehicle.toml").write_text(SCENARIO)
    whole, kept = tmp_path / f"all_{seed}.csv", tmp_path / f"voyage_{seed}.csv"
    command = ["sitl", "--scenario", str(tmp_path / "vehicle.toml"), "--link", "none", "--quiet"]
    assert main([*command, "--seed", str(seed), "--record", str(whole)]) == 0
    columns = ["time_s", "depth_m", "pitch_rad", "rudder_rad", "speed_mps"]
    with whole.open() as source, kept.open("w", newline="") as target:
        writer = csv.DictWriter(target, columns, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(csv.DictReader(source))
    return kept


def score(model: Path, recording: Path, tmp_path: Path) -> dict[str, float]:
    assert main(["predict", str(model), str(recording), "--json", str(tmp_path / "score.json")]) == 0
    found: dict[str, float] = json.loads((tmp_path / "score.json").read_text())
    return found


@pytest.mark.long
def test_the_extended_model_beats_the_base_on_another_voyage(tmp_path: Path) -> None:
    learnt, other = voyage(tmp_path, 1), voyage(tmp_path, 2)
    assert main(["identify", str(learnt), "--out", str(tmp_path), "--quiet"]) in (0, 1)
    assert main(["diagnose", str(learnt), "--out", str(tmp_path), "--quiet", "--jobs", "1"]) == 0
    base = score(tmp_path / "model.json", other, tmp_path)
    extended = score(tmp_path / "extended_model.json", other, tmp_path)
    assert extended["depth_rmse_m"] < 0.5 * base["depth_rmse_m"]
    assert extended["pitch_rmse_rad"] < 1.1 * base["pitch_rmse_rad"]
    # Flown on the other voyage's planes, it is where the vehicle was.
    sim = tmp_path / "sim.csv"
    assert main(["simulate", str(tmp_path / "extended_model.json"), str(other), "--out", str(sim)]) == 0
    with sim.open() as flown, other.open() as measured:
        apart = [
            abs(float(a["depth_m"]) - float(b["depth_m"]))
            for a, b in zip(csv.DictReader(flown), csv.DictReader(measured), strict=True)
            if b["depth_m"]
        ]
    assert len(apart) > 800
    assert max(apart) == pytest.approx(0.0, abs=0.3)
