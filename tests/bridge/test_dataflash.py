"""Dataflash logs: pymavlink's counts on real ones, damage, and the columns of each version."""

from collections import Counter
from math import nan, radians
from pathlib import Path

import pytest
from dataflash_writer import ATT, BARO, CSRV, RCOU, DataflashWriter
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.DFReader import DFReader_binary
from tlog_files import DATA
from vehicle_frames import of

from bridge.dataflash import read_dataflash
from bridge.dataflash_records import walk_dataflash
from bridge.errors import LogFormatError
from bridge.mavlink_map import MavlinkMap, ServoTerm
from bridge.measurement import Measurement, Quantity

MAPPING = MavlinkMap(
    depth_source="SCALED_PRESSURE2",
    surface_pressure_hpa=1013.25,
    rudder=(ServoTerm(channel=2, rad_per_us=1e-3),),
)


def written(tmp_path: Path, *records: bytes) -> Path:
    path = tmp_path / "dive.BIN"
    path.write_bytes(b"".join(records))
    return path


def read(
    tmp_path: Path, *records: bytes, mapping: MavlinkMap = MAPPING
) -> tuple[list[Measurement], Counter[str], list[str]]:
    return read_dataflash(written(tmp_path, *records), mapping)


@pytest.mark.parametrize("name", ["small.BIN", "dive.BIN"])
def test_counts_equal_pymavlinks(name: str) -> None:
    log = DFReader_binary(str(DATA / name))
    theirs: Counter[str] = Counter()
    while (message := log.recv_msg()) is not None:
        theirs[message.get_type()] += 1
    _, counts, _ = read_dataflash(DATA / name, MavlinkMap())
    ours = {kind: n for kind, n in counts.items() if "." not in kind}
    assert ours == theirs


def test_values_equal_pymavlinks() -> None:
    log = DFReader_binary(str(DATA / "small.BIN"))
    theirs = []
    while (message := log.recv_match(type="ATT")) is not None:
        theirs.append((message.TimeUS, radians(message.Pitch)))
    measurements, _, _ = read_dataflash(DATA / "small.BIN", MAPPING)
    ours = [(item.t_us, item.value) for item in of(measurements, Quantity.PITCH)]
    assert [t for t, _ in ours] == [t for t, _ in theirs]
    assert [v for _, v in ours] == pytest.approx([v for _, v in theirs])


def test_barometer_instance_and_its_true_sample_time(tmp_path: Path) -> None:
    w = DataflashWriter()
    out, counts, _ = read(
        tmp_path,
        w.define(*BARO),
        w.record("BARO", 5_000_000, 0, 0.0, 99_000.0, 4980, 1),
        w.record("BARO", 5_000_000, 1, 0.0, 201_325.0, 4980, 1),
        w.record("BARO", 5_100_000, 1, 0.0, 201_325.0, 5080, 0),
    )
    (depth,) = out
    assert (depth.t_us, depth.source) == (4_980_000, "BARO[1]")
    assert depth.value == pytest.approx(1e5 / (1025 * 9.80665))
    assert counts["refused.unhealthy"] == 1


def test_centidegrees_and_outputs(tmp_path: Path) -> None:
    w = DataflashWriter()
    out, _, _ = read(
        tmp_path,
        w.define(*ATT),
        w.define(*RCOU),
        w.record("ATT", 1_000_000, 0, -1234, 0),
        w.record("RCOU", 1_000_000, 1500, 1600, 0),
    )
    assert [item.value for item in out] == pytest.approx([radians(-12.34), 0.1])


def test_reported_servo_angle_replaces_the_mix(tmp_path: Path) -> None:
    w = DataflashWriter()
    mapping = MavlinkMap(rudder=MAPPING.rudder, csrv_id=4, csrv_sign=-1)
    out, _, _ = read(
        tmp_path,
        w.define(*RCOU),
        w.define(*CSRV),
        w.record("RCOU", 1_000_000, 1500, 1600, 0),
        w.record("CSRV", 1_000_000, 3, 0.5),
        w.record("CSRV", 1_000_000, 4, 0.25),
        mapping=mapping,
    )
    assert [(item.value, item.source) for item in out] == [(-0.25, "CSRV")]


def test_nan_time_running_back_and_absurd_time_are_refused_by_cause(tmp_path: Path) -> None:
    w = DataflashWriter()
    out, counts, _ = read(
        tmp_path,
        w.define("ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw"),
        w.record("ATT", 5_000_000, 0.0, 1.0, 0.0),
        w.record("ATT", 5_100_000, 0.0, nan, 0.0),
        w.record("ATT", 4_900_000, 0.0, 1.0, 0.0),
        w.record("ATT", 2**63, 0.0, 1.0, 0.0),
        w.record("ATT", 0, 0.0, 1.0, 0.0),
        w.record("ATT", 5_200_000, 0.0, 1.0, 0.0),
    )
    assert [item.t_us for item in out] == [5_000_000, 5_200_000]
    assert counts["refused.non_finite"] == 1
    assert counts["refused.backwards"] == 1
    assert counts["refused.time_step"] == 2


def test_missing_column_is_counted(tmp_path: Path) -> None:
    w = DataflashWriter()
    out, counts, _ = read(tmp_path, w.define("ATT", "Qf", "TimeUS,Roll"), w.record("ATT", 1_000_000, 0.0))
    assert out == []
    assert counts["refused.column"] == 1


def test_lost_block_costs_itself_and_the_record_before() -> None:
    data = (DATA / "small.BIN").read_bytes()
    whole: Counter[str] = Counter()
    list(walk_dataflash(data, set(), whole))
    # Behind the definitions, where pymavlink's reader would meet an unknown type and stop.
    holed: Counter[str] = Counter()
    list(walk_dataflash(data[:90_000] + data[90_400:], set(), holed))
    lost = {name: whole[name] - holed[name] for name in whole if "." not in name}
    assert 400 / 90 <= sum(lost.values()) <= 400 / 11 + 2
    assert holed["refused.record"] + holed["refused.bytes"] > 0


def test_cut_tail_costs_only_the_last_record() -> None:
    data = (DATA / "dive.BIN").read_bytes()
    whole: Counter[str] = Counter()
    list(walk_dataflash(data, set(), whole))
    cut: Counter[str] = Counter()
    list(walk_dataflash(data[:-1], set(), cut))
    assert sum(n for name, n in (whole - cut).items() if "." not in name) == 1
    assert cut["refused.unfinished"] == 1


@pytest.mark.parametrize("content", [b"TimeUS,Pitch\n1,2\n", b"\x00" * 100, b"\xa3\x95"])
def test_file_that_is_no_dataflash_log_is_refused(tmp_path: Path, content: bytes) -> None:
    with pytest.raises(LogFormatError, match=r"^dive\.BIN: ") as caught:
        read(tmp_path, content)
    assert "\n" not in str(caught.value)


@given(at=st.integers(0, 88_000), noise=st.binary(min_size=1, max_size=300))
@settings(max_examples=25, deadline=None)
def test_overwritten_bytes_never_raise(at: int, noise: bytes) -> None:
    data = bytearray((DATA / "dive.BIN").read_bytes())
    data[at : at + len(noise)] = noise
    counts: Counter[str] = Counter()
    for _ in walk_dataflash(bytes(data), {"ATT", "BARO", "RCOU"}, counts):
        pass
