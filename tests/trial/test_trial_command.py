"""`mils blind-trial` from end to end."""

import json
from pathlib import Path

import pytest

from tools.cli import main


@pytest.mark.long
def test_a_small_trial_runs_and_is_taken_up_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["blind-trial", "--out", str(tmp_path), "--count", "2", "--seed", "3", "--quiet"]
    assert main(words) in (0, 1)
    first = json.loads((tmp_path / "trial.json").read_text())
    assert first["recordings"] == 2
    assert first["failed"] == []
    assert (tmp_path / "trial.html").is_file()
    said = capsys.readouterr().out
    assert first["answers_sha256"] in said
    assert said.index("answers sealed") < said.index("answers opened")
    assert main(words) in (0, 1)
    assert json.loads((tmp_path / "trial.json").read_text()) == first
    whole = {one["recording"] for one in first["judged"]}
    parts = []
    for limits in (["--count", "1"], ["--count", "2", "--first", "2"]):
        assert main([*words[:3], *limits, *words[5:]]) in (0, 1)
        (part,) = json.loads((tmp_path / "trial.json").read_text())["judged"]
        parts.append(part["recording"])
    assert whole == {*parts}
    capsys.readouterr()
    assert main([*words[:3], "--count", "9", "--first", "3", *words[5:]]) == 2
    assert capsys.readouterr().err == f"mils: {tmp_path} holds 2 recordings: --first must be 1 to 2\n"


def test_nonsense_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["blind-trial", "--out", str(tmp_path), "--count", "0"]) == 2
    assert capsys.readouterr().err.startswith("mils: --count")
    assert main(["blind-trial", "--out", str(tmp_path), "--count", "3", "--first", "4"]) == 2
    assert capsys.readouterr().err == "mils: --first must be 1 to 3, the --count\n"
    assert main(["blind-trial", "--out", str(tmp_path), "--usual", "--published"]) == 2
    assert (
        capsys.readouterr().err == "mils: --usual and --published are two kinds of trial: give one of them\n"
    )
    assert not [*tmp_path.iterdir()]
