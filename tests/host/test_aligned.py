"""Tables whose rows tell one message each, on the grid that logs of messages get."""

from pathlib import Path

import numpy as np
import pytest

from host.errors import RecordingError
from host.recordings.read import read_recordings
from host.recordings.recording import Array
from host.vehicle import default_vehicle

HEADER = "time_s,depth_m,pitch_rad,rudder_rad,speed_mps,pitch_rate_radps"
LATER = {"depth": 0.03, "pitch": 0.0, "rudder": 0.055}  # s, after each step


def truth(time: Array) -> dict[str, Array]:
    plane = np.where(np.sin(0.3 * time) > 0.0, 0.1, -0.1)
    return {"depth": 20.0 + np.sin(0.5 * time), "pitch": 0.2 * np.cos(0.5 * time), "rudder": plane}


def write(
    path: Path, step: float = 0.1, silent: tuple[float, float] = (0.0, 0.0), duration: float = 60.0
) -> Path:
    rows = []
    for name, late in LATER.items():
        time = np.arange(0.0, duration, step) + late
        time = time[(time < silent[0]) | (time >= silent[1])]
        column = list(LATER).index(name)
        for at, value in zip(time.tolist(), truth(time)[name].tolist(), strict=True):
            cells = ["", "", ""]
            cells[column] = repr(value)
            rows.append((at, f"{at:.6f},{','.join(cells)},,"))
    path.write_text("\n".join([HEADER, *(row for _, row in sorted(rows))]) + "\n")
    return path


def test_each_channel_is_taken_at_the_grid_from_its_own_times(tmp_path: Path) -> None:
    (recording,) = read_recordings(write(tmp_path / "dive.csv"), default_vehicle())
    assert recording.step == 0.1
    # From where the plane's first angle is known; that of the last step is not known to its end.
    np.testing.assert_allclose(recording.time, 0.1 * np.arange(1, 600), atol=1e-9)
    at_rows = truth(recording.time)
    np.testing.assert_allclose(recording.depth, at_rows["depth"], atol=1e-3)
    np.testing.assert_allclose(recording.pitch, at_rows["pitch"], atol=1e-12)
    assert "its rows tell one message each: taken at every 0.1 s" in recording.notes
    assert recording.counts["missing.depth"] == 1200
    assert not recording.has_speed


def test_a_plane_that_is_sent_seldom_keeps_its_readings(tmp_path: Path) -> None:
    path = write(tmp_path / "dive.csv")
    (whole,) = read_recordings(path, default_vehicle())
    assert whole.plane is None
    header, *rows = path.read_text().splitlines()
    others = [row for row in rows if not row.split(",")[3]]
    sent = [row for row in rows if row.split(",")[3]][::5]
    lines = sorted([*others, *sent], key=lambda row: float(row.split(",")[0]))
    path.write_text("\n".join([header, *lines]) + "\n")
    (seldom,) = read_recordings(path, default_vehicle())
    assert seldom.plane is not None
    assert seldom.plane.is_slow
    assert seldom.plane.time == pytest.approx(0.055 + 0.5 * np.arange(120), abs=1e-6)
    assert seldom.plane.angle == pytest.approx(truth(seldom.plane.time)["rudder"])
    assert seldom.plane.mean_moments == pytest.approx(0.5)


def test_a_spike_is_left_out_before_it_spreads(tmp_path: Path) -> None:
    path = write(tmp_path / "dive.csv")
    lines = path.read_text().splitlines()
    row = next(k for k, line in enumerate(lines) if line.startswith("30.030000,"))
    lines[row] = "30.030000,22.0,,,,"
    path.write_text("\n".join(lines) + "\n")
    (recording,) = read_recordings(path, default_vehicle())
    known = np.isfinite(recording.depth)
    np.testing.assert_allclose(recording.depth[known], truth(recording.time)["depth"][known], atol=2e-3)
    assert recording.counts["outlier.depth"] == 1
    assert "1 of 600 depth values lie off their neighbours and were left out" in recording.notes


def test_it_comes_at_the_step_of_its_pitch_where_that_is_not_the_vehicles(tmp_path: Path) -> None:
    (recording,) = read_recordings(write(tmp_path / "slow.csv", step=0.25), default_vehicle())
    assert recording.step == pytest.approx(0.25)
    (recording,) = read_recordings(write(tmp_path / "near.csv", step=0.104), default_vehicle())
    assert recording.step == 0.1


def test_time_goes_on_over_a_silence(tmp_path: Path) -> None:
    pieces = read_recordings(write(tmp_path / "dive.csv", silent=(20.0, 30.0)), default_vehicle())
    assert [round(float(piece.time[0]), 1) for piece in pieces] == [0.1, 30.1]


def test_rows_that_lost_a_reading_stay_as_they_are(tmp_path: Path) -> None:
    path, time = tmp_path / "dive.csv", 0.1 * np.arange(200)
    values = truth(time)
    lines = [HEADER]
    for k in range(time.size):
        depth = values["depth"][k] if k % 5 == 0 else ""
        pitch = values["pitch"][k] if k % 10 else ""
        lines.append(f"{time[k]},{depth},{pitch},{values['rudder'][k]},,")
    path.write_text("\n".join(lines) + "\n")
    (recording,) = read_recordings(path, default_vehicle())
    assert recording.time.size == 200
    assert not recording.notes


def test_one_line_tells_where_the_channels_never_come_together(tmp_path: Path) -> None:
    path = tmp_path / "apart.csv"
    early = [f"{0.1 * k:.1f},,0.{k % 7},,," for k in range(100)]
    late = [f"{30 + 0.1 * k:.1f},2{k % 7},,0.1,," for k in range(100)]
    path.write_text("\n".join([HEADER, *early, *late]) + "\n")
    with pytest.raises(RecordingError, match="no stretch of 10 rows has depth, pitch, rudder together"):
        read_recordings(path, default_vehicle())


@pytest.mark.parametrize("pitched", [1, 9])
def test_a_channel_of_few_messages_makes_no_grid(pitched: int, tmp_path: Path) -> None:
    path = tmp_path / "few.csv"
    rows = [f"{0.1 * k:.1f},2{k % 7},,0.1,," for k in range(100)]
    rows += [f"{20.0 + k},,0.1{k},0.1,," for k in range(pitched)]
    path.write_text("\n".join([HEADER, *rows]) + "\n")
    with pytest.raises(RecordingError, match="no stretch of 10 rows has depth, pitch, rudder together"):
        read_recordings(path, default_vehicle())


def test_messages_that_come_faster_than_any_grid_are_taken_at_the_finest(tmp_path: Path) -> None:
    (recording,) = read_recordings(write(tmp_path / "dive.csv", step=5e-4, duration=1.0), default_vehicle())
    assert recording.step == pytest.approx(1e-3)
