"""A plane that was read more seldom than there are rows."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from host.recordings.csv_map import CsvMap
from host.recordings.csv_recording import read_csv_recording
from host.recordings.plane_between_rows import between_readings, ways_between, with_moving_plane
from host.recordings.plane_in_table import plane_readings
from host.recordings.plane_readings import PlaneReadings
from host.recordings.recording import Array, Recording

STEP = 0.1
TIME = STEP * np.arange(400)


def stepping(seed: int = 1) -> Array:
    """Angles that change at random rows."""
    rng = np.random.default_rng(seed)
    changes = np.cumsum(rng.integers(4, 12, 60))
    return np.asarray(
        0.01 * rng.integers(-20, 20, 61)[np.searchsorted(changes, np.arange(TIME.size), "right")]
    )


def read_every(values: Array, rows: int, fill: str) -> Array:
    known = np.arange(values.size) % rows == 0
    if fill == "empty":
        return np.where(known, values, np.nan)
    if fill == "last":
        return values[np.arange(values.size) // rows * rows]
    return np.asarray(np.round(np.interp(TIME, TIME[known], values[known]), 6))


@pytest.mark.parametrize("fill", ["empty", "last", "line"])
@pytest.mark.parametrize("rows", [2, 5])
def test_readings_are_found_in_however_filled_a_table(rows: int, fill: str) -> None:
    plane = plane_readings(TIME, read_every(stepping(), rows, fill), STEP)
    assert plane is not None
    assert plane.is_slow
    assert plane.time == pytest.approx(TIME[::rows])
    assert plane.angle == pytest.approx(stepping()[::rows])


def test_a_table_with_a_reading_in_each_row_has_none_between() -> None:
    assert plane_readings(TIME, stepping(), STEP) is None
    pulses = np.where(TIME % 6.0 < 3.0, 0.1, -0.1)  # told so seldom that nothing tells a logger's pace
    assert plane_readings(TIME, pulses, STEP) is None


def test_a_step_at_every_second_may_be_a_logger_s_or_the_plane_s_own() -> None:
    time = STEP * np.arange(2000)
    steps = 0.1 * np.random.default_rng(5).integers(-1, 2, 200).repeat(10)
    plane = plane_readings(time, steps, STEP)
    assert plane is not None
    assert plane.is_doubtful
    assert plane.time == pytest.approx(time[::10])
    still = dict.fromkeys(("depth", "pitch", "speed", "pitch_rate"), time)
    recording = Recording(name="dive", sha256="", time=time, rudder=steps, step=STEP, plane=plane, **still)
    assert len(ways_between([recording])) == 1  # nothing else is made of it than what the rows say
    swinging = np.sin(0.1 * np.arange(200)).repeat(10)
    assert plane_readings(time, swinging, STEP) is None  # no step that might have come earlier
    pulses = 0.1 * (-1.0) ** (np.arange(2000) // 30)
    assert plane_readings(time, pulses, STEP) is None  # a logger as slow as that is none


def test_where_rows_are_lost_only_what_happened_there_is_unseen() -> None:
    kept = np.random.default_rng(2).random(TIME.size) > 0.2
    plane = plane_readings(TIME[kept], stepping()[kept], STEP)
    assert plane is not None
    assert not plane.is_slow
    assert 0 < plane.steps.size < np.count_nonzero(np.diff(plane.angle))
    assert (np.diff(plane.time)[plane.steps] > 1.5 * STEP).all()


def test_a_step_comes_at_its_moment_and_what_was_seen_at_its_reading() -> None:
    plane = PlaneReadings(np.array([0.0, 0.1, 0.2, 0.6]), np.array([0.0, 0.3, 0.3, 0.7]), STEP)
    assert plane.steps.tolist() == [2]
    rows = STEP * np.arange(8)
    assert plane.means(rows, rows + STEP, np.array([0.625])) == pytest.approx(
        [0.0, 0.3, 0.3, 0.3, 0.5, 0.7, 0.7, 0.7]
    )


def test_a_moment_may_be_any_or_that_of_any_row_up_to_the_next_reading() -> None:
    any_time = PlaneReadings(np.array([0.0, 0.5, 1.0]), np.array([0.0, 0.0, 1.0]), STEP)
    assert any_time.mean_moments == pytest.approx([0.5])
    assert any_time.moment_variances == pytest.approx([1.0 / 12.0])
    of_rows = PlaneReadings(any_time.time, any_time.angle, STEP, pace=STEP)
    rows = np.arange(1, 6) / 5
    assert of_rows.mean_moments == pytest.approx([rows.mean()])
    assert of_rows.moment_variances == pytest.approx([rows.var()])


def test_a_plane_that_swings_goes_on_swinging_from_reading_to_reading() -> None:
    swing = 0.2 * np.sin(TIME)
    plane = plane_readings(TIME, read_every(swing, 5, "empty"), STEP)
    assert plane is not None
    assert plane.steps.size == 0
    within = slice(0, 395)
    fine = TIME[:, None] + np.linspace(0.0, STEP, 50)
    means = 0.2 * np.sin(fine).mean(axis=1)
    assert plane.means(TIME, TIME + STEP)[within] == pytest.approx(means[within], abs=0.002)
    held = plane.means(TIME, TIME + STEP, holds_between=True)
    assert held[within] == pytest.approx(swing[within], abs=0.002)


def test_where_a_swinging_plane_moves_at_once_it_steps() -> None:
    swing = 0.2 * np.sin(0.5 * TIME) + np.where(TIME > 12.3, 0.3, 0.0)
    plane = plane_readings(TIME, read_every(swing, 5, "empty"), STEP)
    assert plane is not None
    (step,) = plane.steps
    assert plane.time[step] == pytest.approx(12.0)
    moment = np.array([(12.4 - 12.0) / 0.5])
    held = plane.means(TIME, TIME + STEP, moment, holds_between=True)
    assert held[:395] == pytest.approx(swing[:395], abs=0.002)


@given(
    st.lists(st.sampled_from([-0.3, 0.0, 0.5]), min_size=4, max_size=12),
    st.lists(st.floats(0.05, 1.0), min_size=11, max_size=11),
    st.data(),
)
def test_means_lie_among_the_readings_and_add_up(
    angles: list[float], gaps: list[float], data: st.DataObject
) -> None:
    time = np.concatenate([[0.0], np.cumsum(gaps[: len(angles) - 1])])
    plane = PlaneReadings(time, np.array(angles), STEP)
    one = st.floats(0.0, 1.0)
    moments = np.array(data.draw(st.lists(one, min_size=plane.steps.size, max_size=plane.steps.size)))
    edges = np.linspace(-0.3, time[-1] + 0.3, 30)
    means = plane.means(edges[:-1], edges[1:], moments)
    whole = plane.means(edges[:1], edges[-1:], moments)
    if not plane.is_stepping:
        return  # what swings may go beyond its readings between them
    assert means.min() >= min(angles) - 1e-9
    assert means.max() <= max(angles) + 1e-9
    assert np.sum(means * np.diff(edges)) == pytest.approx(float(whole[0]) * np.ptp(edges), abs=1e-9)


def test_a_slow_plane_of_a_table_that_lost_rows_is_one_stretch(tmp_path: Path) -> None:
    cells = ["" if np.isnan(a) else f"{a:.3f}" for a in read_every(stepping(), 10, "empty")]
    lines = [f"{t:.1f},{10 + 0.1 * t:.3f},0.0,{cell}" for t, cell in zip(TIME, cells, strict=True)]
    kept = np.random.default_rng(3).random(TIME.size) > 0.3
    kept[0] = True
    path = tmp_path / "slow.csv"
    lines = [line for line, is_kept in zip(lines, kept, strict=True) if is_kept]
    path.write_text("\n".join(["time_s,depth_m,pitch_rad,rudder_rad", *lines]))
    (recording,) = read_csv_recording(path, CsvMap())
    assert recording.plane is not None
    assert np.diff(recording.plane.time).max() > 1.5
    assert recording.time.size == kept.sum()


def test_where_most_rows_are_lost_those_that_are_left_do_not_tell_all(tmp_path: Path) -> None:
    kept = np.random.default_rng(2).random(TIME.size) > 0.6
    lines = [f"{t:.1f},{10 + 0.1 * t:.3f},0.0,{a:.3f}" for t, a in zip(TIME, stepping(), strict=True)]
    path = tmp_path / "lost.csv"
    lines = [line for line, is_kept in zip(lines, kept, strict=True) if is_kept]
    path.write_text("\n".join(["time_s,depth_m,pitch_rad,rudder_rad", *lines]))
    recording, *_ = read_csv_recording(path, CsvMap())
    assert recording.step == pytest.approx(0.2)
    assert recording.plane is not None
    assert recording.plane.pace == pytest.approx(0.1)
    changes, gaps = np.diff(recording.plane.angle), np.diff(recording.plane.time)
    assert recording.plane.steps.size == np.count_nonzero((changes != 0.0) & (gaps > 0.15))


def test_a_recording_is_moved_once(tmp_path: Path) -> None:
    cells = ["" if np.isnan(a) else f"{a:.3f}" for a in read_every(stepping(), 5, "empty")]
    lines = [f"{t:.1f},{10 + 0.1 * t:.3f},0.0,{cell}" for t, cell in zip(TIME, cells, strict=True)]
    path = tmp_path / "slow.csv"
    path.write_text("\n".join(["time_s,depth_m,pitch_rad,rudder_rad", *lines]))
    (recording,) = read_csv_recording(path, CsvMap())
    assert recording.plane is not None
    moved = with_moving_plane(recording)
    assert moved.rudder == pytest.approx(between_readings(recording, recording.plane).rudder)
    assert np.abs(moved.rudder - recording.rudder).max() > 0.05
    assert with_moving_plane(moved) is moved


def test_a_program_of_even_units_may_be_the_plane_s_own() -> None:
    time = 0.1 * np.arange(2400)
    signs = np.repeat([1.0, -1.0, 1.0, -1.0, 0.0], [48, 32, 16, 16, 140])  # 3-2-1-1 of 1.6 s, a pause of 14 s
    program = 0.2 * np.concatenate([np.zeros(50), np.tile(signs, 10)])[: time.size]
    plane = plane_readings(time, program, 0.1)
    assert plane is not None  # all turns lie on every second row
    assert plane.is_doubtful
    swinging = plane_readings(time, np.repeat(0.1 * np.sin(0.4 * time[::2]), 2), 0.1)
    assert swinging is not None
    assert not swinging.is_doubtful
