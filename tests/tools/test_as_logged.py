"""A recording as a slower logger would have kept it."""

from pathlib import Path

import numpy as np
import pytest

from tools.as_logged import main
from tools.trial.recorded import read_recorded


@pytest.fixture
def dive(tmp_path: Path) -> Path:
    path = tmp_path / "dive.csv"
    rows = [f"{0.1 * k:.1f},{20 + 0.01 * k:.2f},0.01,{0.1 * (k // 7 % 2)}" for k in range(100)]
    path.write_text("\n".join(["time_s,depth_m,pitch_rad,rudder_rad", *rows]) + "\n")
    return path


def test_channels_are_thinned_rows_lost_and_times_rounded(
    dive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [str(dive), str(tmp_path / "kept.csv"), "--plane", "5", "--depth", "2", "--time-step", "1"]
    assert main(words) == 0
    kept, whole = read_recorded(tmp_path / "kept.csv"), read_recorded(dive)
    assert np.isfinite(kept["rudder_rad"]).sum() == 20
    assert kept["depth_m"][::2] == pytest.approx(whole["depth_m"][::2])
    assert np.isnan(kept["depth_m"][1::2]).all()
    assert kept["time_s"] == pytest.approx(np.floor(whole["time_s"] + 1e-9))
    assert "100 rows of 100" in capsys.readouterr().out
    assert main([*words[:2], "--lost", "0.4", "--plane", "5", "--fill", "last"]) == 0
    kept = read_recorded(tmp_path / "kept.csv")
    assert 45 < kept["time_s"].size < 75
    assert np.isfinite(kept["rudder_rad"]).all()


@pytest.mark.parametrize(
    ("more", "says"),
    [(["--plane", "0"], "at least 1"), (["--lost", "1"], "share lost"), ([], "is no table of numbers")],
)
def test_nonsense_is_one_line(
    dive: Path, tmp_path: Path, more: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    source = dive if more else tmp_path / "none.csv"
    with pytest.raises(SystemExit) as ended:
        main([str(source), str(tmp_path / "kept.csv"), *more])
    assert ended.value.code == 2
    assert says in capsys.readouterr().err
