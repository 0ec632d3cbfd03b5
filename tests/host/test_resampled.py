"""Rows that fill the time between two readings are no readings."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from host.recordings.csv_map import CsvMap
from host.recordings.csv_recording import read_csv_recording
from host.recordings.resampled import between, repeats

Find = Callable[[np.ndarray, np.ndarray], np.ndarray | None]


def dive(rows: int = 2000, noise: float = 0.008) -> np.ndarray:
    """Depth that climbs and sinks, m, at 10 Hz."""
    time = 0.1 * np.arange(rows)
    return 20 + 3 * np.sin(time / 7) + noise * np.random.default_rng(5).standard_normal(rows)


@pytest.mark.parametrize("digits", [2, 9])
@pytest.mark.parametrize("every", [2, 3, 10])
def test_held_readings_count_once_each_when_it_came(every: int, digits: int) -> None:
    depth = np.round(dive(), digits)
    held = depth[np.arange(depth.size) // every * every]
    rows = repeats(0.1 * np.arange(held.size), held)
    assert rows is not None
    new = np.diff(held, prepend=np.nan) != 0.0
    assert not rows[new].any()
    assert rows.mean() == pytest.approx(1.0 - 1.0 / every, abs=0.01)


@pytest.mark.parametrize("find", [repeats, between])
def test_readings_are_found_although_rows_were_lost(find: Find) -> None:
    depth, at = dive(), np.arange(2000)
    kept = np.random.default_rng(3).random(at.size) > 0.12
    read = kept & (at % 6 == 0)
    if find is repeats:
        filled = depth[np.maximum.accumulate(np.where(read, at, 0))]
    else:
        filled = np.interp(at, at[read], depth[read])
    written = np.array([float(f"{value:.9g}") for value in filled])
    rows = find(0.1 * at[kept], written[kept])
    assert rows is not None
    assert (~rows[read[kept]]).mean() > 0.95
    assert (~rows).sum() == pytest.approx(read.sum(), rel=0.15)


@pytest.mark.parametrize("every", [2, 3, 10])
def test_rows_on_a_line_between_readings_are_found(every: int) -> None:
    depth, at = dive(), np.arange(2000)
    drawn = np.round(np.interp(at, at[::every], depth[::every]), 5)
    rows = between(0.1 * np.arange(drawn.size), drawn)
    assert rows is not None
    assert rows.mean() == pytest.approx(1.0 - 1.0 / every, abs=0.03)
    kept = ~rows
    assert np.abs(np.interp(at[::every], at[kept], drawn[kept]) - depth[::every])[:-1].max() < 0.01


def test_readings_between_two_rows_leave_one_row_each() -> None:
    depth, at = dive(), np.arange(2000.0)
    drawn = np.interp(at, at[2::5] + 0.37, depth[2::5])
    rows = between(0.1 * np.arange(drawn.size), drawn)
    assert rows is not None
    assert (~rows).sum() == pytest.approx(400, abs=3)


@pytest.mark.parametrize("digits", [0, 1, 2, 3, 9])
@pytest.mark.parametrize("noise", [0.0, 0.008, 0.05])
def test_what_a_sensor_says_every_row_is_left_alone(digits: int, noise: float) -> None:
    depth = np.round(dive(noise=noise), digits)
    assert repeats(0.1 * np.arange(depth.size), depth) is None
    assert between(0.1 * np.arange(depth.size), depth) is None


def test_a_vehicle_that_rests_for_long_is_no_held_reading() -> None:
    depth = np.concatenate([np.full(1500, 20.0), dive(500)])
    assert repeats(0.1 * np.arange(depth.size), depth) is None
    assert between(0.1 * np.arange(depth.size), depth) is None


def test_a_reading_that_stands_longer_than_usual_was_made_again() -> None:
    depth = dive()[np.arange(2000) // 5 * 5]
    depth[1000:1100] = depth[1000]
    rows = repeats(0.1 * np.arange(depth.size), depth)
    assert rows is not None
    assert (~rows)[1000:1100].sum() == 20


def test_a_table_says_what_is_no_measurement(tmp_path: Path) -> None:
    depth = dive(300)[np.arange(300) // 5 * 5]
    pitch = 0.1 * np.sin(np.arange(300) / 20.0) + 1e-3 * np.random.default_rng(1).standard_normal(300)
    lines = [f"{0.1 * k:.1f},{z:.6f},{p:.6f},0.1" for k, (z, p) in enumerate(zip(depth, pitch, strict=True))]
    path = tmp_path / "held.csv"
    path.write_text("\n".join(["time_s,depth_m,pitch_rad,rudder_rad", *lines]))
    (recording,) = read_csv_recording(path, CsvMap())
    assert np.isfinite(recording.depth).sum() == 60
    assert np.isfinite(recording.pitch).all()
    assert recording.notes == (
        "depth repeats the last reading in 80 % of the rows: these are not measurements",
    )
