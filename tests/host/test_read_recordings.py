"""Recordings of any kind on the grid; what reading them decided or lost comes along."""

from pathlib import Path

import numpy as np
import pytest

from bridge.measurement import Measurement, Quantity
from host.errors import RecordingError
from host.live.journal import Journal
from host.recordings.read import read_recordings
from host.vehicle import default_vehicle


def journal(folder: Path, boots: int = 1) -> Path:
    """Ten seconds of everything at 10 Hz for each boot."""
    writer = Journal(folder / "dive.jsonl", vehicle="v", configuration={}, wall_s=lambda: 1.7e9, warn=print)
    for boot in range(boots):
        for k in range(100):
            t_us = 20_000_000 * boot + 100_000 * k
            writer.measurements(
                Measurement(quantity=quantity, value=0.01 * k, t_us=t_us, source="x", boot=boot)
                for quantity in (Quantity.DEPTH, Quantity.PITCH, Quantity.RUDDER)
            )
    writer.close()
    return writer.path


def test_a_killed_journal_is_read_to_its_last_line_and_says_so(tmp_path: Path) -> None:
    path = journal(tmp_path)
    path.write_bytes(path.read_bytes()[:-5])
    (recording,) = read_recordings(path, default_vehicle())
    assert recording.time.size >= 99
    assert recording.notes == ("the last line is cut: the program was stopped while writing it",)
    assert recording.counts["damaged"] == 1


def test_a_restart_of_the_vehicle_cuts_in_two(tmp_path: Path) -> None:
    pieces = read_recordings(journal(tmp_path, boots=2), default_vehicle())
    assert [piece.time.size for piece in pieces] == [100, 100]
    assert {piece.notes for piece in pieces} == {()}


def test_alarms_belong_to_the_boot_and_the_stretch_in_which_they_came(tmp_path: Path) -> None:
    path = tmp_path / "dive.jsonl"
    writer = Journal(path, vehicle="v", configuration={}, wall_s=lambda: 1.7e9, warn=print)
    for boot in range(2):
        for k in range(100):
            t_us = 5_000_000 + 100_000 * k
            writer.measurements(
                Measurement(quantity=quantity, value=0.01 * k, t_us=t_us, source="x", boot=boot)
                for quantity in (Quantity.DEPTH, Quantity.PITCH, Quantity.RUDDER)
            )
            if boot == 1 and k == 70:
                writer.event("mismatch", "changed", {"t_us": t_us})
                writer.event("mismatch", "of another clock", {"t_us": 50_000_000})
                writer.event("link", "came back", {})
    writer.close()
    first, second = read_recordings(path, default_vehicle())
    assert first.alarms == ()
    assert second.alarms == pytest.approx((7.0,))


def test_a_plane_that_turned_unheard_is_on_its_way(tmp_path: Path) -> None:
    path = journal(tmp_path)
    lines = path.read_text().splitlines(keepends=True)
    lost = [f'"value":{0.01 * k},' for k in (40, 60, 61, 62)]
    path.write_text("".join(x for x in lines if '"rudder"' not in x or not any(value in x for value in lost)))
    (recording,) = read_recordings(path, default_vehicle())
    assert len(lines) - len(path.read_text().splitlines()) == 4
    assert recording.rudder == pytest.approx([0.01 * k for k in range(100)])


@pytest.mark.parametrize(
    ("name", "says"),
    [("none.csv", "no such file"), (".", "is a folder"), ("empty.jsonl", "is empty")],
)
def test_what_cannot_be_read_is_one_line(tmp_path: Path, name: str, says: str) -> None:
    (tmp_path / "empty.jsonl").touch()
    with pytest.raises(RecordingError, match=says) as caught:
        read_recordings(tmp_path / name, default_vehicle())
    assert "\n" not in str(caught.value)


def test_a_log_whose_channels_come_seldom_is_taken_as_they_come(tmp_path: Path) -> None:
    writer = Journal(tmp_path / "dive.jsonl", vehicle="v", configuration={}, wall_s=lambda: 1.7e9, warn=print)
    periods = {Quantity.PITCH: 250_000, Quantity.DEPTH: 420_000, Quantity.RUDDER: 500_000}
    sent = [
        Measurement(quantity=quantity, value=1e-6 * t_us, t_us=t_us, source="x", boot=0)
        for quantity, period in periods.items()
        for t_us in range(0, 60_000_000, period)
    ]
    writer.measurements(sorted(sent, key=lambda one: one.t_us))
    writer.close()
    (recording,) = read_recordings(writer.path, default_vehicle(), on_grid=False)
    assert recording.step == 0.25
    assert recording.notes == ("its pitch comes every 0.25 s: taken at that step",)
    for values, period in ((recording.pitch, 0.25), (recording.depth, 0.42)):
        known = np.isfinite(values)
        assert values[known] == pytest.approx(recording.time[known], abs=0.05 * 0.25)  # in one row
        assert np.diff(values[known]) == pytest.approx(period)
    assert recording.plane is not None
    assert recording.plane.time == pytest.approx(recording.plane.angle)
