"""Messages at their own times, where no method needs a grid."""

from pathlib import Path

import numpy as np
import pytest
from test_aligned import truth, write

from host.noise.noise_floor import noise_floor
from host.recordings.own_times import Sent, at_own_times
from host.recordings.read import read_recordings
from host.recordings.recording import Array, Recording
from host.vehicle import default_vehicle

STEP = 0.1
GRID = STEP * np.arange(600)


def grid() -> Recording:
    nan = np.full(GRID.size, np.nan)
    return Recording(
        name="dive.csv",
        sha256="0" * 64,
        time=GRID,
        depth=nan,
        pitch=nan,
        rudder=np.zeros(GRID.size),
        speed=nan,
        pitch_rate=nan,
        step=STEP,
    )


def sent(pitch: Array, depth: Array, rudder: Array) -> dict[str, Sent]:
    """Channels at these times; each tells the time at which it was read."""
    none = Sent(np.zeros(0), np.zeros(0))
    times = {"pitch": pitch, "depth": depth, "rudder": rudder}
    return {"speed": none, "pitch_rate": none} | {name: Sent(t, t.copy()) for name, t in times.items()}


HEARD = np.ones(GRID.size, dtype=bool)


@pytest.mark.parametrize("late", [0.05, 0.02])
def test_each_reading_stands_at_the_time_at_which_it_was_made(late: float) -> None:
    depth = GRID[:-1] + late
    own = at_own_times(grid(), sent(GRID, depth, GRID), HEARD)
    assert own.time == pytest.approx(np.sort(np.concatenate([GRID, depth])))
    for values, times in ((own.pitch, GRID), (own.depth, depth)):
        known = np.isfinite(values)
        assert own.time[known] == pytest.approx(times)
        assert values[known] == pytest.approx(times)


def test_readings_next_to_each_other_share_a_row() -> None:
    own = at_own_times(grid(), sent(GRID, GRID[:-1] + 0.003, GRID), HEARD)
    assert own.time == pytest.approx(GRID)
    assert own.depth[:-1] == pytest.approx(GRID[:-1] + 0.003)


def test_of_many_readings_those_nearest_to_the_grid_are_kept() -> None:
    often = 0.02 * np.arange(2990) + 0.001
    own = at_own_times(grid(), sent(often, often, GRID), HEARD)
    assert own.time.size == pytest.approx(GRID.size, abs=2)
    assert np.abs(own.pitch - own.time).max() < 1e-9
    assert np.diff(own.time) == pytest.approx(STEP, abs=0.021)


def test_the_plane_is_at_its_mean_over_each_row_but_where_it_was_not_heard() -> None:
    channels = sent(GRID, GRID[:-1] + 0.05, 0.5 * np.arange(120) + 0.275)
    heard = HEARD & ((GRID < 20.0) | (GRID > 30.0))
    own = at_own_times(grid(), channels, heard)
    fine = own.time[:-1, None] + np.diff(own.time)[:, None] * (np.arange(100) + 0.5) / 100
    last = np.maximum(np.searchsorted(channels["rudder"].time, fine, side="right") - 1, 0)
    means = channels["rudder"].value[last].mean(axis=1)
    known = (own.time[:-1] < 20.0) | (own.time[:-1] > 30.05)
    assert own.rudder[:-1][known] == pytest.approx(means[known], abs=0.01)
    assert not own.rudder[:-1][~known].any()


def test_without_a_plane_or_a_reading_it_stays_on_the_grid() -> None:
    none, own = np.zeros(0), grid()
    assert at_own_times(own, sent(GRID, GRID, none), HEARD) is own
    assert at_own_times(own, sent(none, none, GRID), HEARD) is own
    assert at_own_times(own, sent(none, GRID, GRID[:1]), HEARD).depth == pytest.approx(GRID)


def test_the_noise_of_a_depth_between_the_instants_is_that_of_its_sensor(tmp_path: Path) -> None:
    path, rng = write(tmp_path / "dive.csv"), np.random.default_rng(1)
    header, *rows = path.read_text().splitlines()
    noisy = [header]
    for row in rows:
        time, depth, *others = row.split(",")
        noisy.append(",".join([time, str(float(depth) + 0.02 * rng.normal()) if depth else "", *others]))
    path.write_text("\n".join(noisy) + "\n")
    (gridded,) = read_recordings(path, default_vehicle())
    (own,) = read_recordings(path, default_vehicle(), on_grid=False)
    known = np.isfinite(own.depth)
    assert np.std(own.depth[known] - truth(own.time[known])["depth"]) == pytest.approx(0.02, rel=0.1)
    assert np.std(gridded.depth - truth(gridded.time)["depth"]) < 0.018
    assert np.sqrt(noise_floor([own])[1]) == pytest.approx(0.02, rel=0.15)
