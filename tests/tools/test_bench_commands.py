"""The bench commands as a user calls them: files in, files and one clear line out."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from tools.bench import progress
from tools.cli import main

COLUMNS = ("time_s", "depth_m", "pitch_rad", "rudder_rad")


def dive(path: Path, seed: int = 0, rows: int = 900, amplitude: float = 0.25) -> Path:
    """An Euler-discretised dive of the paper's vehicle, with sensor noise."""
    rng = np.random.default_rng(seed)
    w = q = theta = 0.0
    zeta, rudder, h = 20.0, 0.0, 0.02
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for k in range(rows):
            if k % 25 == 0:
                rudder = rng.uniform(-amplitude, amplitude)
            noise = rng.standard_normal(2)
            writer.writerow([f"{0.1 * k:.1f}", zeta + 0.01 * noise[0], theta + 0.0017 * noise[1], rudder])
            for _ in range(5):
                w, q, theta, zeta = (
                    w + h * (-0.63084 * w + 0.41385 * rudder),
                    q + h * (-3.38699 * q - 8.19858 * theta - 3.94120 * rudder),
                    theta + h * q,
                    zeta + h * (w - 2.5 * theta),
                )
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return dive(tmp_path_factory.mktemp("dive") / "dive.csv")


@pytest.fixture(scope="module")
def model(recording: Path) -> Path:
    out = recording.parent / "out"
    assert main(["identify", str(recording), "--out", str(out), "--quiet"]) == 0
    return out / "model.json"


def test_identify_writes_a_model_and_a_self_contained_report(model: Path) -> None:
    document = json.loads(model.read_text())
    assert document["parameters"]["u0"]["value"] == pytest.approx(2.5, rel=0.1)
    page = (model.parent / "report.html").read_text()
    assert "Held-out" in page
    assert page.count("data:image/png;base64,") >= 3
    assert "http://" not in page
    assert "https://" not in page


def test_predict_scores_and_writes_json(
    model: Path, recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = dive(recording.parent / "other.csv", seed=5)
    target = recording.parent / "score.json"
    assert main(["predict", str(model), str(other), "--json", str(target)]) == 0
    score = json.loads(target.read_text())
    assert set(score) == {
        "depth_rmse_m", "pitch_rmse_rad", "depth_fit_percent", "pitch_fit_percent", "samples",
    }  # fmt: skip
    assert score["pitch_fit_percent"] > 95
    assert "m rms" in capsys.readouterr().out


def test_simulate_writes_a_recording_that_can_be_read_back(model: Path, recording: Path) -> None:
    simulated = recording.parent / "sim.csv"
    assert main(["simulate", str(model), str(recording), "--out", str(simulated)]) == 0
    assert main(["predict", str(model), str(simulated), "--json", str(recording.parent / "s.json")]) == 0
    assert json.loads((recording.parent / "s.json").read_text())["depth_rmse_m"] < 1e-3


def test_simulate_needs_no_more_than_time_and_rudder(model: Path, tmp_path: Path) -> None:
    (tmp_path / "in.csv").write_text("time_s,rudder_rad\n" + "\n".join(f"{k / 10},0.1" for k in range(50)))
    assert main(["simulate", str(model), str(tmp_path / "in.csv"), "--out", str(tmp_path / "sim.csv")]) == 0
    assert len((tmp_path / "sim.csv").read_text().splitlines()) == 51


def test_each_recording_gets_a_model_of_its_own(recording: Path, tmp_path: Path) -> None:
    second = dive(tmp_path / "second.csv", seed=2)
    assert main(["identify", str(recording), str(second), "--each", "--out", str(tmp_path), "--quiet"]) == 0
    assert (tmp_path / "dive" / "model.json").exists()
    assert (tmp_path / "second" / "model.json").exists()


def test_what_is_left_out_teaches_nothing(
    recording: Path, model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    header, *rows = recording.read_text().splitlines()
    for k in range(300, 400):  # as if it turned
        time, depth, pitch, rudder = rows[k].split(",")
        rows[k] = f"{time},{float(depth) + 3.0},{0.5 * float(pitch) + 0.3},{rudder}"
    turned = tmp_path / "turned.csv"
    turned.write_text("\n".join([header, *rows]) + "\n")
    main(["identify", str(turned), "--leave-out", "30-40", "--out", str(tmp_path), "--quiet"])
    assert "left out as asked: 30 to 40 s" in capsys.readouterr().err
    without, whole = (
        json.loads((folder / "model.json").read_text())["parameters"] for folder in (tmp_path, model.parent)
    )
    for name in ("a2", "a3", "b2", "u0"):
        assert without[name]["value"] == pytest.approx(whole[name]["value"], rel=0.1), name


@pytest.mark.parametrize("method", ["car", "mils"])
def test_regression_methods_say_that_noise_biases_them(
    recording: Path, tmp_path: Path, method: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["identify", str(recording), "--method", method, "--out", str(tmp_path), "--quiet"])
    assert "biased" in capsys.readouterr().out
    assert (tmp_path / "report.html").exists()


def test_the_live_estimator_over_a_recording_agrees_with_the_bench(
    recording: Path, tmp_path: Path, model: Path
) -> None:
    assert main(["identify", str(recording), "--method", "robust", "--out", str(tmp_path), "--quiet"]) == 0
    live, bench = (json.loads((p / "model.json").read_text())["parameters"] for p in (tmp_path, model.parent))
    for name in ("a2", "a3", "b2", "u0"):
        spread = live[name]["std"] + bench[name]["std"]
        assert abs(live[name]["value"] - bench[name]["value"]) < 4.0 * spread, name


def test_a_plane_that_never_moved_ends_with_no(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    still = dive(tmp_path / "still.csv", amplitude=0.0)
    assert main(["identify", str(still), "--out", str(tmp_path), "--quiet"]) == 1
    said = capsys.readouterr().out
    assert "does not tell" in said
    assert "b2: plane steps" in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["identify", "nowhere.csv"], "no such file"),
        (["predict", "nowhere.json", "nowhere.csv"], "No such file"),
        (["identify", "."], "is a folder"),
        (["identify", "{empty}"], "is empty"),
        (["identify", "{garbage}"], "is not UTF-8 text"),
        (["identify", "{recording}", "--vehicle", "nowhere.toml"], "nowhere.toml"),
        (["identify", "{recording}", "--leave-out", "60-x"], "give START-END"),
        (["identify", "{recording}", "--leave-out", "0-100"], "leaves nothing"),
        (["diagnose", "{recording}", "--leave-out", "7", "--quiet"], "give START-END"),
        (["diagnose", "{recording}", "--minutes", "-1"], "--minutes must not be negative"),
        (
            ["diagnose", "{recording}", "--leave-out", "6-9", "--simulation", "{recording}"],
            "--leave-out cannot",
        ),
        (["diagnose", "{recording}", "--around", "0", "--simulation", "{recording}"], "--around cannot"),
        (["predict", "{recording}", "{recording}"], "is not a model file"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    arguments: list[str],
    message: str,
    recording: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "empty.csv").touch()
    (tmp_path / "garbage.csv").write_bytes(bytes(range(256)) * 20)
    places = {
        "{empty}": tmp_path / "empty.csv",
        "{garbage}": tmp_path / "garbage.csv",
        "{recording}": recording,
    }
    filled = [str(places.get(argument, argument)) for argument in arguments]
    if filled[0] == "identify":
        filled += ["--out", str(tmp_path), "--quiet"]
    assert main(filled) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1


def test_unknown_command_and_option_end_with_2(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (["frobnicate"], ["identify"], ["identify", "x.csv", "--metod", "ml"]):
        with pytest.raises(SystemExit) as caught:
            main(arguments)
        assert caught.value.code == 2
        assert capsys.readouterr().err.startswith("mils")


def test_on_a_pipe_progress_is_a_line_a_stage(capsys: pytest.CaptureFixture[str]) -> None:
    with progress(quiet=False) as say:
        for text in ("reading 1.csv", "1 effect, 1/2: drag", "1 effect, 2/2: lag", "2 effects, 1/1: all"):
            say(text)
    assert capsys.readouterr().err.splitlines() == ["reading 1.csv", "1 effect", "2 effects"]
    with progress(quiet=True) as say:
        say("reading 1.csv")
    assert capsys.readouterr().err == ""
