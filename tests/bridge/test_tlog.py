"""Real recordings give exactly pymavlink's counts; damage costs itself and no more."""

from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tlog_files import DATA, pymavlink_counts, record
from vehicle_frames import Vehicle, of

from bridge.errors import LogFormatError
from bridge.mavlink_map import MavlinkMap
from bridge.measurement import Quantity
from bridge.tlog import read_tlog, walk_tlog

NOW = 1_700_000_000_000_000
KNOWN = MavlinkMap(system_id=1)


def frames_in(data: bytes) -> tuple[list[int], Counter[str]]:
    counts: Counter[str] = Counter()
    return [t_us for t_us, _ in walk_tlog(data, counts)], counts


def steady(n: int = 50) -> list[bytes]:
    vehicle = Vehicle()
    return [record(NOW + 100_000 * k, vehicle.attitude(5000 + 100 * k, 0.001 * k)) for k in range(n)]


@pytest.mark.parametrize("name", ["small.tlog", "2023-04-18_11-03-34.tlog", "dive.tlog"])
def test_counts_equal_pymavlinks(name: str) -> None:
    theirs = pymavlink_counts(DATA / name)
    bad = theirs.pop("BAD_DATA", 0)
    _, counts, _ = read_tlog(DATA / name, MavlinkMap())
    assert Counter({kind: n for kind, n in counts.items() if kind.isupper()}) == theirs
    assert counts["refused.crc"] == bad


def test_each_attitude_of_the_vehicle_is_a_pitch() -> None:
    measurements, counts, _ = read_tlog(DATA / "dive.tlog", KNOWN)
    assert len(of(measurements, Quantity.PITCH)) == counts["ATTITUDE"]


def test_text_inside_a_log_costs_only_itself() -> None:
    text = b"mavproxy: link 1 down\n"
    times, counts = frames_in(text.join(steady()))
    assert times == [NOW + 100_000 * k for k in range(50)]
    assert counts["refused.bytes"] == 49 * len(text)


def test_cut_tail_costs_only_the_last_record() -> None:
    data = b"".join(steady())
    for cut in range(1, len(steady()[-1])):
        assert len(frames_in(data[:-cut])[0]) == 49


def test_damaged_record_costs_only_itself() -> None:
    records = steady()
    records[10] = records[10][:20] + b"\x00\xfd\xfe" + records[10][23:]
    times, counts = frames_in(b"".join(records))
    assert len(times) == 49
    assert counts["refused.crc"] == 1


def test_lost_bytes_cost_only_the_records_they_are_in() -> None:
    data = b"".join(steady())
    assert len(frames_in(data[:500] + data[533:])[0]) >= 47


@pytest.mark.parametrize("absurd", [0, 2**64 - 1, NOW + 10**15])
def test_absurd_stamp_stands_still_and_is_counted(absurd: int) -> None:
    records = steady()
    records[20] = record(absurd, records[20][8:])
    times, counts = frames_in(b"".join(records))
    assert times == sorted(times)
    assert times[-1] - times[0] == 49 * 100_000 - 200_000
    assert counts["refused.timestamp"] == 2  # there and back


def test_computer_clock_set_during_the_dive_makes_no_gap_in_the_vehicles_time() -> None:
    vehicle = Vehicle()
    raw = b"".join(
        record(NOW + 100_000 * k - (10**15 if k < 25 else 0), vehicle.attitude(5000 + 100 * k))
        for k in range(50)
    )
    counts: Counter[str] = Counter()
    times = [t_us for t_us, _ in walk_tlog(raw, counts)]
    assert times[-1] - times[0] == 48 * 100_000
    assert counts == {"refused.timestamp": 1}


def test_log_without_an_autopilots_heartbeat_says_what_to_set(tmp_path: Path) -> None:
    path = tmp_path / "quiet.tlog"
    path.write_bytes(b"".join(steady()))
    measurements, counts, notes = read_tlog(path, MavlinkMap())
    assert measurements == []
    assert counts["refused.no_vehicle_yet"] == 50
    assert "set system_id" in notes[-1]
    assert len(read_tlog(path, KNOWN)[0]) == 100


def test_what_stands_before_the_first_heartbeat_is_used(tmp_path: Path) -> None:
    path = tmp_path / "late.tlog"
    path.write_bytes(b"".join(steady()) + record(NOW + 5_000_000, Vehicle().heartbeat()))
    measurements, counts, _ = read_tlog(path, MavlinkMap())
    assert len(measurements) == 100
    assert counts["refused.no_vehicle_yet"] == 0


def test_file_without_mavlink_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "dive.tlog"
    path.write_bytes((DATA / "small.BIN").read_bytes())
    with pytest.raises(LogFormatError, match=r"^dive\.tlog: no MAVLink in it"):
        read_tlog(path, KNOWN)


@given(garbage=st.lists(st.binary(max_size=60), min_size=50, max_size=50))
@settings(max_examples=40, deadline=None)
def test_garbage_between_records_loses_none(garbage: list[bytes]) -> None:
    data = b"".join(noise + entry for noise, entry in zip(garbage, steady(), strict=True))
    assert len(frames_in(data)[0]) >= 50


@given(data=st.binary(max_size=3000))
@settings(max_examples=60, deadline=None)
def test_random_bytes_never_raise(data: bytes) -> None:
    frames_in(data)
