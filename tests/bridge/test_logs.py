"""Every kind of log by its suffix, and one clear line for what is none."""

from pathlib import Path

import pytest
from tlog_files import DATA

from bridge.can_map import CanMap
from bridge.errors import LogFormatError
from bridge.logs import READERS, read_log
from bridge.mavlink_map import MavlinkMap


def read(path: Path) -> list[object]:
    return list(read_log(path, MavlinkMap(), CanMap()).measurements)


@pytest.mark.parametrize("name", ["small.tlog", "small.BIN"])
def test_measurements_are_in_order_of_time(name: str) -> None:
    reading = read_log(DATA / name, MavlinkMap(), CanMap())
    times = [item.t_us for item in reading.measurements]
    assert len(times) > 100
    assert times == sorted(times)
    assert reading.notes


def test_suffix_counts_in_any_case(tmp_path: Path) -> None:
    path = tmp_path / "DIVE.TLOG"
    path.write_bytes((DATA / "dive.tlog").read_bytes())
    assert read(path)


def test_unknown_suffix_lists_the_known(tmp_path: Path) -> None:
    with pytest.raises(LogFormatError, match=r"unknown kind of log '\.ulg'; known are \.tlog, \.bin"):
        read(tmp_path / "dive.ulg")


@pytest.mark.parametrize("suffix", sorted(READERS))
def test_missing_file_is_one_clear_line(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(LogFormatError, match="cannot be read: No such file") as caught:
        read(tmp_path / f"none{suffix}")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", sorted(READERS))
def test_empty_file_is_one_clear_line(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"dive{suffix}"
    path.touch()
    with pytest.raises(LogFormatError, match=r"^dive\..* the file is empty$"):
        read(path)


@pytest.mark.parametrize("suffix", sorted(READERS))
def test_folder_and_garbage_are_one_clear_line(tmp_path: Path, suffix: str) -> None:
    garbage = tmp_path / f"garbage{suffix}"
    garbage.write_bytes(bytes(range(256)) * 40)
    folder = tmp_path / f"folder{suffix}"
    folder.mkdir()
    for path in (garbage, folder):
        with pytest.raises(LogFormatError) as caught:
            read(path)
        assert path.name in str(caught.value)
        assert "\n" not in str(caught.value)
