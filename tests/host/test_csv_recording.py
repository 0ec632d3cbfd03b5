from pathlib import Path

import numpy as np
import pytest

from host.errors import RecordingError
from host.recordings.csv_map import CsvColumn, CsvMap
from host.recordings.csv_recording import read_csv_recording

HEADER = "time_s,depth_m,pitch_rad,rudder_rad"


def write(path: Path, rows: list[str], header: str = HEADER) -> Path:
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def rows(count: int, step: float = 0.1, start: float = 0.0) -> list[str]:
    return [f"{start + k * step:.3f},{10 + 0.01 * k:.4f},{0.001 * k:.4f},0.1" for k in range(count)]


def test_plain_recording_is_read_as_it_is(tmp_path: Path) -> None:
    (recording,) = read_csv_recording(write(tmp_path / "a.csv", rows(50)), CsvMap())
    assert recording.step == pytest.approx(0.1)
    assert recording.depth[3] == pytest.approx(10.03)
    assert recording.pitch[3] == pytest.approx(0.003)
    assert not recording.has_speed
    assert len(recording.sha256) == 64


def test_units_signs_and_scales_are_applied(tmp_path: Path) -> None:
    lines = [f"{100 * k};{-1000 - k};{k};{1500 + k}" for k in range(20)]
    path = write(tmp_path / "a.csv", [line.replace(";", ",") for line in lines], "ms,alt_cm,pitch_deg,servo")
    columns = CsvMap(
        time=CsvColumn(column="ms", unit="ms"),
        depth=CsvColumn(column="alt_cm", unit="cm", sign=-1),
        pitch=CsvColumn(column="pitch_deg", unit="deg"),
        rudder=CsvColumn(column="servo", unit="raw", scale=0.001, offset=-1.5),
    )
    (recording,) = read_csv_recording(path, columns)
    assert recording.time[1] == pytest.approx(0.1)
    assert recording.depth[1] == pytest.approx(10.01)
    assert recording.pitch[1] == pytest.approx(np.deg2rad(1.0))
    assert recording.rudder[1] == pytest.approx(0.001)


def test_gaps_stay_gaps_and_long_ones_cut(tmp_path: Path) -> None:
    lines = [*rows(30), *rows(30, start=60.0)]
    lines[5] = "0.500,,nan,0.1"
    pieces = read_csv_recording(write(tmp_path / "a.csv", lines), CsvMap())
    assert [piece.time.size for piece in pieces] == [30, 30]
    assert np.isnan(pieces[0].depth[5])
    assert np.isnan(pieces[0].pitch[5])
    assert pieces[1].time[0] == pytest.approx(60.0)


def test_rudder_lost_for_a_moment_is_held_and_for_long_cuts(tmp_path: Path) -> None:
    lines = rows(60)
    for k in (10, 11):
        lines[k] = f"{0.1 * k:.3f},10.0,0.0,"
    for k in range(30, 50):
        lines[k] = f"{0.1 * k:.3f},10.0,0.0,"
    pieces = read_csv_recording(write(tmp_path / "a.csv", lines), CsvMap())
    assert [piece.time.size for piece in pieces] == [40, 10]
    assert np.isfinite(pieces[0].rudder).all()


def test_time_running_backwards_and_repeated_is_dropped_and_counted(tmp_path: Path) -> None:
    lines = rows(30)
    lines.insert(10, "0.2,99,9,9")
    lines.insert(20, lines[19])
    lines.insert(5, "x,1,1,1")
    (recording,) = read_csv_recording(write(tmp_path / "a.csv", lines), CsvMap())
    assert recording.time.size == 30
    assert recording.depth.max() < 11
    assert recording.counts["refused.time_not_advancing"] == 2
    assert recording.counts["refused.time_missing"] == 1


@pytest.mark.parametrize(("decimals", "step"), [(0, 0.1), (1, 0.02), (1, 0.125), (2, 1.0 / 12.0)])
def test_rows_of_rounded_times_are_spread_evenly(tmp_path: Path, decimals: int, step: float) -> None:
    lines = [f"{round(7.3 + step * k, decimals)},{10 + 0.01 * k:.4f},{0.001 * k:.4f},0.1" for k in range(200)]
    (recording,) = read_csv_recording(write(tmp_path / "a.csv", lines), CsvMap())
    assert recording.time == pytest.approx(step * np.arange(200), abs=0.1 * 10**-decimals)
    assert recording.step == pytest.approx(step, rel=0.01)
    assert recording.notes == (
        f"its times are rounded to {10**-decimals:.3g} s: the rows are taken as evenly spaced",
    )


@pytest.mark.parametrize("jitter", [0.0, 1e-3, 0.03])
def test_exact_times_and_those_of_an_uneven_clock_stay_as_they_are(tmp_path: Path, jitter: float) -> None:
    off = np.random.default_rng(1).uniform(0.0, jitter, 200)
    told = [f"{0.1 * k + off[k]:.3f}" for k in range(200)]
    lines = [f"{at},{10 + 0.01 * k:.4f},{0.001 * k:.4f},0.1" for k, at in enumerate(told)]
    (recording,) = read_csv_recording(write(tmp_path / "a.csv", lines), CsvMap())
    assert recording.time == pytest.approx(np.array(told, dtype=float) - float(told[0]), abs=1e-9)
    assert recording.notes == ()


def test_rows_that_share_a_time_are_spread_where_others_were_lost_or_none_came(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    exact = 0.45 + 0.1 * np.arange(400)[rng.random(400) > 0.05]
    exact[exact > 20.0] += 30.0
    lines = [f"{int(t)},{10 + 0.01 * t:.4f},{0.001 * t:.4f},0.1" for t in exact]
    found = read_csv_recording(write(tmp_path / "a.csv", lines), CsvMap())
    assert [one.time.size for one in found] == [np.sum(exact < 20.0), np.sum(exact > 20.0)]
    time = np.concatenate([one.time for one in found])
    assert np.abs(time - exact - np.median(time - exact)).max() < 0.2
    assert np.std(time - exact) < 0.05
    assert found[0].notes == ("its times are rounded to 1 s: the rows are taken as evenly spaced",)


def test_two_rows_of_a_time_or_rows_written_twice_are_dropped(tmp_path: Path) -> None:
    pairs = [f"{int(2.0 * k) // 4},{10 + 0.01 * k:.4f},{0.001 * k:.4f},0.1" for k in range(200)]
    pairs[100:] = [f"{int(line.split(',')[0]) + 30},{line.split(',', 1)[1]}" for line in pairs[100:]]
    twice = [line for line in rows(50) for _ in range(2)]
    for lines, left, is_noted in ((pairs, 100, True), (twice, 50, False)):
        found = read_csv_recording(write(tmp_path / "a.csv", lines), CsvMap())
        assert sum(recording.time.size for recording in found) == left
        assert found[0].counts["refused.time_not_advancing"] == len(lines) - left
        assert ("many rows repeat" in " ".join(found[0].notes)) == is_noted


def test_rows_of_two_sensors_each_at_its_pace_are_not_rounded(tmp_path: Path) -> None:
    times = sorted({*np.round(0.1 * np.arange(100), 3), *np.round(0.25 * np.arange(40), 3)})
    lines = [f"{t:.3f},{10 + 0.1 * t:.4f},{0.01 * t:.4f},0.1" for t in times]
    (recording,) = read_csv_recording(write(tmp_path / "a.csv", lines), CsvMap())
    assert recording.time == pytest.approx(times)
    assert recording.notes == ()


@pytest.mark.parametrize("every", [1, 3, 10, 20])
def test_a_slow_speed_sensor_is_one(tmp_path: Path, every: int) -> None:
    lines = [f"{line},{2.0 + 0.01 * k if k % every == 0 else ''}" for k, line in enumerate(rows(60))]
    (recording,) = read_csv_recording(write(tmp_path / "a.csv", lines, HEADER + ",speed_mps"), CsvMap())
    assert recording.has_speed
    assert np.isfinite(recording.speed).sum() == -(-60 // every)


def test_a_speed_that_is_silent_half_of_the_time_is_no_speed_and_that_is_said(tmp_path: Path) -> None:
    lines = [f"{line},{2.0 if 20 <= k < 90 else ''}" for k, line in enumerate(rows(200))]
    (recording,) = read_csv_recording(write(tmp_path / "b.csv", lines, HEADER + ",speed_mps"), CsvMap())
    assert not recording.has_speed
    assert any("speed" in note for note in recording.notes)


def test_a_speed_of_zero_all_along_is_no_speed_and_that_is_said(tmp_path: Path) -> None:
    lines = [f"{line},0.0" for line in rows(50)]
    (recording,) = read_csv_recording(write(tmp_path / "a.csv", lines, f"{HEADER},speed_mps"), CsvMap())
    assert not recording.has_speed
    assert recording.notes == ("the speed is said to be zero all along, so none is taken as measured",)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\x00\xff\xfe\x80garbage" * 50, "is not UTF-8 text"),
        (b"time_s,depth_m,pitch_rad\n0,1,2\n", "column 'rudder_rad' for rudder is not in the file"),
        (HEADER.encode() + b"\n0,1,0,0\n", "only 1 rows"),
        (HEADER.encode() + b"\n" + b"\n".join(b"%d,,,0" % k for k in range(20)), "no stretch of 10 rows"),
        (
            HEADER.encode() + b"\n" + b"\n".join(b"a,b,c,d" for _ in range(20)),
            "for time holds neither seconds nor times",
        ),
    ],
)
def test_bad_file_says_what_is_wrong_in_one_line(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_bytes(content)
    with pytest.raises(RecordingError) as caught:
        read_csv_recording(path, CsvMap())
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_other_separators_are_read(tmp_path: Path, separator: str) -> None:
    """Semicolons come with decimal commas."""
    text = "\n".join([HEADER, *rows(20)]).replace(",", separator)
    path = tmp_path / "a.csv"
    path.write_text(text.replace(".", ",") if separator == ";" else text)
    (recording,) = read_csv_recording(path, CsvMap())
    assert recording.depth[3] == pytest.approx(10.03)
    assert recording.rudder[3] == pytest.approx(0.1)


def test_single_values_that_no_vehicle_has_are_not_measured(tmp_path: Path) -> None:
    lines = rows(50)
    lines[7] = "0.700,-99999,0.0,0.1"
    (recording,) = read_csv_recording(write(tmp_path / "a.csv", lines), CsvMap())
    assert np.isnan(recording.depth[7])
    assert recording.counts["refused.range.depth"] == 1


def test_a_column_in_another_unit_is_refused(tmp_path: Path) -> None:
    lines = [f"{0.1 * k:.1f},10.0,{k % 20},0.1" for k in range(50)]
    with pytest.raises(
        RecordingError, match=r"pitch must be within 3\.142 .*got 19 from 'pitch_rad'.*\[csv\.pitch\]"
    ):
        read_csv_recording(write(tmp_path / "a.csv", lines), CsvMap())


def test_a_time_of_day_is_read(tmp_path: Path) -> None:
    lines = [f"12:00:{k:02d},10,{0.01 * k},0.1" for k in range(50)]
    (recording,) = read_csv_recording(write(tmp_path / "a.csv", lines), CsvMap())
    assert recording.time == pytest.approx(np.arange(50.0))


def test_a_time_that_is_none_is_told(tmp_path: Path) -> None:
    lines = [f"1/3/2026 12:00:{k:02d},10,{0.01 * k},0.1" for k in range(50)]
    with pytest.raises(RecordingError, match=r"for time holds neither seconds nor .*'1/3/2026 12:00:00'"):
        read_csv_recording(write(tmp_path / "a.csv", lines), CsvMap())


def test_a_time_in_milliseconds_is_told(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", rows(50, step=100.0))
    with pytest.raises(RecordingError, match=r'rows are 100 s apart.*unit = "ms" under \[csv.time\]'):
        read_csv_recording(path, CsvMap())
    (recording,) = read_csv_recording(path, CsvMap(time=CsvColumn(column="time_s", unit="ms")))
    assert recording.step == pytest.approx(0.1)


def test_a_column_that_is_there_twice_is_refused(tmp_path: Path) -> None:
    lines = [line + ",0.0" for line in rows(20)]
    with pytest.raises(RecordingError, match="'depth_m' is in the file 2 times"):
        read_csv_recording(write(tmp_path / "a.csv", lines, f"{HEADER},depth_m"), CsvMap())


def test_another_encoding_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes("# \u00dcbung\n".encode("latin-1") + "\n".join([HEADER, *rows(20)]).encode())
    with pytest.raises(RecordingError, match=r"is not UTF-8 text \(byte 2\)"):
        read_csv_recording(path, CsvMap())


def test_a_scale_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="scale must not be 0"):
        CsvColumn(column="x", unit="m", scale=0.0)
