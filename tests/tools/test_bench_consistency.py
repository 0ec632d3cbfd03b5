"""`python -m tools.bench_consistency` on recordings whose signs and units are known."""

import csv
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.hidden_dive import hidden_dive
from tools.bench_consistency import main


def write(path: Path, sign: float) -> str:
    dive = hidden_dive(duration=60.0)
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time_s", "depth_m", "pitch_rad", "rudder_rad"])
        writer.writerows(np.column_stack([dive.time, sign * dive.depth, dive.pitch, dive.rudder]).tolist())
    return str(path)


def test_it_prints_what_share_would_be_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    right, wrong = write(tmp_path / "right.csv", 1.0), write(tmp_path / "wrong.csv", -1.0)
    assert main(["--quiet", right, wrong]) == 0
    assert "refused, of 2: 50.0%; if one sign were wrong: 50.0%" in capsys.readouterr().out


def test_a_missing_file_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["--quiet", str(tmp_path / "none.csv")])
    assert left.value.code == 2
    assert "none.csv: no such file" in capsys.readouterr().err
