"""A depth that comes more seldom than pitch."""

from pathlib import Path

import numpy as np
import pytest
from test_aligned import truth, write

from host.recordings.read import read_recordings
from host.recordings.recording import Recording
from host.recordings.slow_depth import on_the_grid, with_own_rows
from host.vehicle import default_vehicle


def told(path: Path, every: int) -> tuple[list[str], list[float]]:
    """Lines of a table of messages with every so many depths, and the times of these."""
    header, *rows = path.read_text().splitlines()
    deep = [row for row in rows if row.split(",")[1]][::every]
    others = [row for row in rows if not row.split(",")[1]]
    lines = sorted([*others, *deep], key=lambda row: float(row.split(",")[0]))
    return [header, *lines], [float(row.split(",")[0]) for row in deep]


@pytest.mark.parametrize("every", [2, 5, 20])
def test_each_reading_stands_in_a_row_of_its_own(tmp_path: Path, every: int) -> None:
    path = write(tmp_path / "dive.csv")
    (whole,) = read_recordings(path, default_vehicle())
    assert whole.own_rows is None
    lines, times = told(path, every)
    path.write_text("\n".join(lines) + "\n")
    (slow,) = read_recordings(path, default_vehicle())
    assert slow.own_rows is not None
    measured = np.isfinite(slow.depth)
    assert np.array_equal(measured, slow.own_rows)
    inside = [t for t in times if slow.time[0] <= t <= slow.time[-1]]
    assert slow.time[measured] == pytest.approx(inside, abs=1e-6)
    assert slow.depth[measured] == pytest.approx(truth(slow.time[measured])["depth"])
    assert np.array_equal(slow.time[~measured], whole.time)
    assert np.array_equal(slow.pitch[~measured], whole.pitch)
    assert np.isnan(slow.pitch[measured]).all()
    part = slow.between(10.0, 20.0)
    assert part.own_rows is not None
    assert part.own_rows.size == part.time.size


def test_methods_that_are_fed_at_every_step_get_the_grid(tmp_path: Path) -> None:
    path = write(tmp_path / "dive.csv")
    (whole,) = read_recordings(path, default_vehicle())
    assert on_the_grid(whole) is whole
    path.write_text("\n".join(told(path, 2)[0]) + "\n")
    (slow,) = read_recordings(path, default_vehicle())
    grid = on_the_grid(slow)
    assert grid.own_rows is None
    assert np.array_equal(grid.time, whole.time)
    assert np.isfinite(grid.depth).mean() > 0.98
    known = np.isfinite(grid.depth)
    assert grid.depth[known] == pytest.approx(truth(grid.time[known])["depth"], abs=5e-3)
    path.write_text("\n".join(told(path, 5)[0]) + "\n")
    (slower,) = read_recordings(path, default_vehicle())
    assert np.isnan(on_the_grid(slower).depth).all()  # too far apart for a line


def recording(time: np.ndarray) -> Recording:
    nan = np.full(time.size, np.nan)
    return Recording(
        name="dive.csv",
        sha256="0" * 64,
        time=time,
        depth=nan,
        pitch=0.01 * time,
        rudder=np.floor(time),
        speed=nan,
        pitch_rate=nan,
        step=0.1,
    )


def test_a_reading_at_a_rows_time_stands_in_that_row_and_the_plane_goes_on() -> None:
    grid = recording(0.1 * np.arange(100))
    times = np.append(0.5 * np.arange(1, 19), 9.23)
    slow = with_own_rows(grid, times, 20.0 + times)
    assert slow.own_rows is not None
    assert slow.own_rows.sum() == 1
    assert slow.time[slow.own_rows] == pytest.approx([9.23])
    assert slow.rudder[slow.own_rows] == pytest.approx([9.0])
    assert slow.time[np.isfinite(slow.depth)] == pytest.approx(times)


def test_a_depth_that_comes_at_every_step_or_hardly_ever_stays_as_it_is() -> None:
    grid = recording(0.1 * np.arange(100))
    often, few = 0.1 * np.arange(90) + 0.03, np.arange(1.0, 9.0)
    for times in (often, few):
        assert with_own_rows(grid, times, times) is grid
