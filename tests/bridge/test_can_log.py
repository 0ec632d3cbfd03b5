import io
import random
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import can
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bridge.blf import read_blf
from bridge.can_encoder import CanEncoder
from bridge.can_log import CanLog, write_can_log
from bridge.can_map import CanMap
from bridge.can_source import read_can_log
from bridge.errors import LogFormatError
from bridge.link import Packet
from bridge.measurement import Measurement, Quantity

START_US = 1_600_000_000_123_456
SUFFIXES = [".log", ".txt", ".asc", ".blf"]


def packets(count: int = 3000) -> list[Packet]:
    """Frames of both kinds and of every length, and depth in the default DBC, 10 ms apart."""
    encoder = CanEncoder(CanMap())
    made = []
    for n in range(count):
        t_us = START_US + 10_000 * n
        if n % 2:
            made.append(Packet(t_us=t_us, data=bytes(range(n % 9)), can_id=0x18F00000 + n, extended=True))
        else:
            depth = Measurement(quantity=Quantity.DEPTH, value=5 + n * 1e-3, t_us=t_us, source="")
            made += encoder.encode(depth)
    return made


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_frame_survives_every_format(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"dive{suffix}"
    write_can_log(path, packets())
    log = CanLog(path)
    read = list(log)
    assert not log.counts
    assert log.warnings == []
    assert [(p.data, p.can_id, p.extended) for p in read] == [
        (p.data, p.can_id, p.extended) for p in packets()
    ]
    # The start is kept to a millisecond by .asc and .blf, the rest to a microsecond.
    late = read[0].t_us - START_US
    assert abs(late) <= (1000 if suffix in (".asc", ".blf") else 1)
    assert max(abs(r.t_us - p.t_us - late) for r, p in zip(read, packets(), strict=True)) <= 2
    measured, counts, _ = read_can_log(path, CanMap())
    assert len(measured) == counts["DEPTH"] == 1500
    assert measured[-1].value == pytest.approx(5 + 2998 * 1e-3)


def test_own_reader_agrees_with_python_can_on_blf(tmp_path: Path) -> None:
    path = tmp_path / "dive.blf"
    write_can_log(path, [*packets(), Packet(t_us=START_US + 10**9, data=bytes(64), can_id=5)])
    with can.BLFReader(str(path)) as reader:
        theirs = [(bytes(m.data), m.arbitration_id, m.is_extended_id, m.timestamp) for m in reader]
    ours = list(CanLog(path))
    assert [(p.data, p.can_id, p.extended) for p in ours] == [row[:3] for row in theirs]
    assert [p.t_us * 1e-6 for p in ours] == pytest.approx([row[3] for row in theirs], abs=2e-6)


def text_log(tmp_path: Path, name: str, text: str) -> CanLog:
    path = tmp_path / name
    path.write_bytes(text.encode())
    return CanLog(path)


def test_candump_lines_of_every_kind(tmp_path: Path) -> None:
    log = text_log(
        tmp_path,
        "bus.log",
        "# a comment\n\n"
        "(1502984866.421964) slcan0 09F119CC#FF725AFAF7FF04FF\n"
        "(1502984866.421965) can0 123#0011 R\r\n"
        "(1502984866.421966) can0 123##1001122\n"
        "(1502984866.421967) can0 123#R\n"
        "(1502984866.421968) can0 20000080#0000000000000000\n"
        " (1502984866.500000)  can0  123   [2]  00 11\n"
        " (1502984866.500001)  can0  RX - -  09F119CC   [8]  FF 72 5A FA F7 FF 04 FF   '.rZ.....'\n"
        " (2017-08-17 15:47:46.500002)  can0  123   [0]\n"
        "  can0  123   [2]  00 11\n"
        " (1502984866.500004)  can0  123   [3]  00 11\n"
        "(1502984866.4219\n"
        "(garbage) can0 123   [1]  00\n",
    )
    read = list(log)
    attitude = bytes.fromhex("FF725AFAF7FF04FF")
    local_us = round(datetime(2017, 8, 17, 15, 47, 46, 500002).timestamp() * 1e6)
    assert [(p.t_us, p.data, p.can_id, p.extended) for p in read] == [
        (1502984866421964, attitude, 0x09F119CC, True),
        (1502984866421965, b"\x00\x11", 0x123, False),
        (1502984866421966, b"\x00\x11\x22", 0x123, False),
        (1502984866500000, b"\x00\x11", 0x123, False),
        (1502984866500001, attitude, 0x09F119CC, True),
        (local_us, b"", 0x123, False),
    ]
    assert log.counts == {
        "refused.remote_frame": 1,
        "refused.error_frame": 1,
        "refused.no_time": 1,
        "refused.line": 3,
    }
    assert "1 frames have no time stamps" in log.warnings[0]


def test_asc_of_other_programs(tmp_path: Path) -> None:
    log = text_log(
        tmp_path,
        "bus.asc",
        "date Don Okt 5 03:06:13.191 pm 2017\n"
        "base dec  timestamps relative\n"
        "no internal events logged\n"
        "// version 9.0.0\n"
        "   0.500000 Start of measurement\n"
        "   0.250000 1  291             Rx   d 2 16 255  Length = 0 BitCount = 64 ID = 291\n"
        "   0.250000 1  166795724x      Tx   d 1 1\n"
        "   0.000001 1  291             Rx   r\n"
        "   0.000001 1  ErrorFrame\n"
        "   0.000001 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%\n"
        "   0.000001 1  999999          Rx   d 1 1\n"
        "   0.000001 1  291             Rx   d 8 1 2\n"
        "   0.000001 1  291             Rx   d 1 zz\n",
    )
    started_us = round(datetime(2017, 10, 5, 15, 6, 13, 191000).timestamp() * 1e6)
    assert [(p.t_us, p.data, p.can_id, p.extended) for p in log] == [
        (started_us + 750_000, b"\x10\xff", 291, False),
        (started_us + 1_000_000, b"\x01", 166795724, True),
    ]
    assert log.counts == {"refused.remote_frame": 1, "refused.error_frame": 1, "refused.line": 3}
    assert log.warnings == []


def test_asc_without_a_date_says_so(tmp_path: Path) -> None:
    log = text_log(tmp_path, "bus.asc", "base hex  timestamps absolute\n 1.5 1  123  Rx   d 1 7F\n")
    assert [(p.t_us, p.data) for p in log] == [(1_500_000, b"\x7f")]
    assert "no date in the header" in log.warnings[0]
    odd = text_log(tmp_path, "odd.asc", "date Sat Foo 30 25:06:13 2017\n 1.5 1  123  Rx   d 1 7F\n")
    assert [p.t_us for p in odd] == [1_500_000]
    assert "date not understood" in odd.warnings[0]


def test_blf_of_a_killed_writer_keeps_what_was_written(tmp_path: Path) -> None:
    """python-can writes the start time and the last container only when it is stopped."""
    path = tmp_path / "killed.blf"
    writer = can.BLFWriter(str(path))
    for packet in packets(8000):
        writer.on_message_received(
            can.Message(timestamp=packet.t_us * 1e-6, arbitration_id=packet.can_id or 0, data=packet.data)
        )
    writer.file.flush()
    log = CanLog(path)
    read = list(log)
    assert 2700 < len(read) < 8000
    assert "start time is missing" in log.warnings[0]
    assert read[1].t_us - read[0].t_us == pytest.approx(10_000, abs=1)
    writer.stop()


@pytest.mark.parametrize("share", [0.2, 0.5, 0.99])
def test_cut_blf_keeps_its_beginning(tmp_path: Path, share: float) -> None:
    path = tmp_path / "dive.blf"
    random.seed(1)
    whole = [
        Packet(t_us=p.t_us, data=random.randbytes(8), can_id=p.can_id)
        for p in packets(8000)
        if not p.extended
    ]
    write_can_log(path, whole)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    log = CanLog(path)
    read = list(log)
    assert [p.data for p in read] == [p.data for p in whole[: len(read)]]
    assert share - 0.15 < len(read) / len(whole) < share + 0.15
    assert log.counts["refused.container"] == 1
    assert log.counts["refused.object"] <= 1


def test_damaged_container_costs_that_container(tmp_path: Path) -> None:
    path = tmp_path / "dive.blf"
    random.seed(2)
    whole = [Packet(t_us=START_US + 10_000 * n, data=random.randbytes(8), can_id=7) for n in range(9000)]
    write_can_log(path, whole)
    data = bytearray(path.read_bytes())
    second = data.index(b"LOBJ", 200)
    data[second + 40 : second + 1000] = bytes(960)
    path.write_bytes(data)
    log = CanLog(path)
    read = list(log)
    assert 4000 < len(read) < 9000
    assert read[-1].data == whole[-1].data
    assert log.counts["refused.container"] == 1


def test_blf_object_of_length_zero_does_not_turn_in_circles(tmp_path: Path) -> None:
    path = tmp_path / "dive.blf"
    buffer = io.BytesIO()
    writer = can.BLFWriter(buffer, compression_level=0)  # type: ignore[arg-type]
    for n in range(10):
        writer.on_message_received(can.Message(timestamp=1.6e9 + n, arbitration_id=n, data=bytes(8)))
    writer._flush()
    data = bytearray(buffer.getvalue())
    fifth = [at for at in range(len(data)) if data.startswith(b"LOBJ", at)][5]
    data[fifth + 8 : fifth + 12] = bytes(4)
    path.write_bytes(data)
    log = CanLog(path)
    assert [p.can_id for p in log] == [0, 1, 2, 3, 5, 6, 7, 8, 9]
    assert log.counts["refused.object"] >= 1


def test_cut_asc_keeps_its_beginning(tmp_path: Path) -> None:
    path = tmp_path / "dive.asc"
    write_can_log(path, packets(300))
    text = path.read_bytes()
    path.write_bytes(text[: len(text) // 2] + b"\x00\xff\xfe\x80 1 2 Rx d\n" + text[len(text) // 2 :])
    log = CanLog(path)
    assert len(list(log)) == 299
    assert log.counts["refused.line"] >= 1


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize(
    "content",
    [b"x", b"\x00" * 5000, random.Random(3).randbytes(5000), b"a,b,c\n1,2,3\n" * 50, b"LOGG" + bytes(200)],
)
def test_what_is_no_log_is_said_in_one_line(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"dive{suffix}"
    path.write_bytes(content)
    with pytest.raises(LogFormatError, match=f"dive{suffix}") as caught:
        list(CanLog(path))
    assert "\n" not in str(caught.value)


def test_empty_missing_and_unknown_files(tmp_path: Path) -> None:
    empty = tmp_path / "empty.asc"
    empty.touch()
    with pytest.raises(LogFormatError, match=r"empty\.asc is empty"):
        CanLog(empty)
    with pytest.raises(FileNotFoundError):
        CanLog(tmp_path / "missing.log")
    with pytest.raises(LogFormatError, match="must end in"):
        CanLog(tmp_path / "dive.csv")
    with pytest.raises(LogFormatError, match="must end in"):
        write_can_log(tmp_path / "dive.csv", [])


@pytest.fixture(scope="module")
def small_logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("logs")
    logs = {}
    for suffix in (".log", ".asc", ".blf"):
        path = folder / f"small{suffix}"
        write_can_log(path, packets(40))
        logs[suffix] = path.read_bytes()
    buffer = io.BytesIO()
    writer = can.BLFWriter(buffer, compression_level=0)  # type: ignore[arg-type]
    for packet in packets(40):
        writer.on_message_received(
            can.Message(timestamp=packet.t_us * 1e-6, arbitration_id=7, data=packet.data)
        )
    writer._flush()
    return logs | {".plain.blf": buffer.getvalue()}


Damage = Callable[[bytes], bytes]


@settings(max_examples=250, deadline=2000, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from([".log", ".asc", ".blf", ".plain.blf"]),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), min_size=1, max_size=8),
    st.floats(0.1, 1),
)
def test_damage_anywhere_ends_in_packets_or_a_log_format_error(
    tmp_path: Path,
    small_logs: dict[str, bytes],
    suffix: str,
    flips: list[tuple[float, int]],
    share: float,
) -> None:
    data = bytearray(small_logs[suffix])
    for place, value in flips:
        data[int(place * (len(data) - 1))] = value
    path = tmp_path / f"damaged{suffix}"
    path.write_bytes(data[: int(len(data) * share)])
    try:
        read = list(CanLog(path))
    except LogFormatError:
        return
    assert len(read) <= 45
    assert all(len(p.data) <= 64 for p in read)


def test_blf_reader_refuses_a_foreign_file(tmp_path: Path) -> None:
    path = tmp_path / "x.blf"
    path.write_bytes(b"PK\x03\x04" + bytes(300))
    with pytest.raises(LogFormatError, match="must begin with LOGG"):
        list(read_blf(path, CanLog(path).counts, []))
