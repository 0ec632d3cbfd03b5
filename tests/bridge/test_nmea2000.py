import random
import re
import struct
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.can_decoder import CanDecoder
from bridge.can_encoder import CanEncoder
from bridge.can_map import CanMap, CanSignal
from bridge.can_source import read_can_log
from bridge.errors import BridgeError, LogFormatError
from bridge.fast_packet import MAX_OPEN, FastPackets, to_frames
from bridge.link import Packet
from bridge.measurement import Measurement, Quantity
from bridge.nmea2000 import pgn_of

DATA = Path(__file__).parent.parent / "data" / "can"
BUS = DATA / "nmea2000_bus.txt"
NMEA2000 = CanMap(kind="nmea2000")
NOT_AVAILABLE = 0x7FFF


def attitude(t_us: int, pitch: int, address: int = 0x42) -> Packet:
    data = struct.pack("<BhhhB", 1, NOT_AVAILABLE, pitch, NOT_AVAILABLE, 0xFF)
    return Packet(t_us=t_us, data=data, can_id=0x09F11900 | address, extended=True)


def rudder(t_us: int, instance: int, position: int) -> Packet:
    data = struct.pack("<BBhhH", instance, 0xFF, NOT_AVAILABLE, position, 0xFFFF)
    return Packet(t_us=t_us, data=data, can_id=0x09F10D42, extended=True)


@pytest.mark.parametrize(
    ("can_id", "pgn"),
    [
        (0x09F119CC, 127257),
        (0x09F10DCC, 127245),
        (0x0DEDCC00, 126208),
        (0x18EAFF23, 59904),
        (0x1DFF64CC, 130916),
    ],
)
def test_pgn_of_both_kinds_of_identifier(can_id: int, pgn: int) -> None:
    assert pgn_of(can_id) == pgn


def test_real_bus_against_a_count_of_its_lines() -> None:
    text = BUS.read_text()
    attitudes = re.findall(r"09F119\w\w#\w\w\w{4}(\w{4})", text)
    planes = [p for p in re.findall(r"09F10D\w\w#00\w\w\w{4}(\w{4})", text) if p != "FF7F"]
    expected_pitch = [struct.unpack("<h", bytes.fromhex(p))[0] * 1e-4 for p in attitudes]
    expected_rudder = [struct.unpack("<h", bytes.fromhex(p))[0] * 1e-4 for p in planes]
    measured, counts, warnings = read_can_log(BUS, NMEA2000)
    pitch = [item.value for item in measured if item.quantity == "pitch"]
    assert pitch == pytest.approx(expected_pitch)
    assert len(pitch) == counts["NMEA2000 127257"] == 80
    angle = [item.value for item in measured if item.quantity == "rudder"]
    assert angle == pytest.approx(expected_rudder)
    assert len(angle) == 80
    assert counts["NMEA2000 127245"] == len(re.findall("09F10D", text)) == 239
    assert len([item for item in measured if item.quantity == "speed"]) == len(re.findall("09F503", text))
    assert not [item for item in measured if item.quantity == "depth"]
    assert measured[0].t_us == 1502984866421990
    assert measured[0].source == "NMEA2000 127257"
    assert warnings == []


def test_real_fast_packets_against_a_count_of_their_last_frames() -> None:
    text = BUS.read_text()
    _, counts, _ = read_can_log(BUS, NMEA2000)
    # 127237 is 21 bytes in 4 frames, 129039 27 bytes in 4.
    assert counts["NMEA2000 127237"] == len(re.findall(r"09F105AC#\w3", text)) > 20
    assert counts["NMEA2000 129039"] == len(re.findall(r"11F80F2B#\w3", text)) > 2
    assert not [cause for cause in counts if cause.startswith("refused.fast_packet")]


def test_recording_without_time_is_said_to_have_none() -> None:
    with pytest.raises(LogFormatError, match=r"no time stamps.*candump -L"):
        read_can_log(DATA / "nmea2000_without_time.txt", NMEA2000)


def test_signs_are_settings() -> None:
    decoder = CanDecoder(CanMap(kind="nmea2000", pitch_sign=-1, rudder_sign=-1, rudder_instance=3))
    measured = decoder.feed([attitude(1, 1000), rudder(2, 0, 500), rudder(3, 3, 600)])
    assert [(item.quantity, item.value) for item in measured] == [
        ("pitch", pytest.approx(-0.1)),
        ("rudder", pytest.approx(-0.06)),
    ]


@pytest.mark.parametrize("code", [0x7FFF, 0x7FFE, 0x7FFD])
def test_not_available_is_refused(code: int) -> None:
    decoder = CanDecoder(NMEA2000)
    assert decoder.feed([attitude(1, code)]) == []
    assert decoder.counts["refused.not_available"] == 1


def test_pressure_is_depth_and_water_under_the_keel_is_not() -> None:
    def pressure(t_us: int, source: int, pascal: float) -> Packet:
        data = struct.pack("<BBBiB", 1, 0, source, round(10 * pascal), 0xFF)
        return Packet(t_us=t_us, data=data, can_id=0x15FD0A42, extended=True)

    under_keel = Packet(t_us=4, data=struct.pack("<BIhB", 1, 1250, 0, 0xFF), can_id=0x0DF50B42, extended=True)
    decoder = CanDecoder(
        CanMap(kind="nmea2000", water_density=1000.0, gravity=10.0, surface_pressure_hpa=1000)
    )
    measured = decoder.feed(
        [pressure(1, 1, 180_000.0), pressure(2, 0, 101_325.0), pressure(3, 1, 0), under_keel]
    )
    assert [(item.quantity, item.value) for item in measured] == [("depth", pytest.approx(8.0))]
    assert decoder.counts["refused.range"] == 1
    with pytest.raises(BridgeError, match="under the transducer"):
        CanDecoder(
            CanMap(kind="nmea2000", signals=(CanSignal(quantity="depth", message="128267", signal="depth"),))
        )


def test_second_sender_is_refused_until_the_first_is_silent() -> None:
    decoder = CanDecoder(NMEA2000)
    packets = [attitude(0, 100, 1), attitude(50_000, 200, 2), attitude(100_000, 101, 1)]
    assert [item.value for item in decoder.feed(packets)] == pytest.approx([0.01, 0.0101])
    assert decoder.counts["refused.other_sender"] == 1
    assert [item.value for item in decoder.feed([attitude(2_200_000, 201, 2)])] == pytest.approx([0.0201])
    only = CanDecoder(CanMap(kind="nmea2000", source_address=2))
    assert [item.value for item in only.feed(packets)] == pytest.approx([0.02])


def test_speed_by_a_fast_packet_both_ways() -> None:
    signals = (CanSignal(quantity="speed", message="130578", signal="longitudinal_water"),)
    can_map = CanMap(kind="nmea2000", signals=signals)
    sent = Measurement(quantity=Quantity.SPEED, value=1.234, t_us=500, source="")
    packets = CanEncoder(can_map).encode(sent)
    assert [packet.data[:2] for packet in packets] == [b"\x00\x0c", b"\x01\x7f"]
    measured = CanDecoder(can_map).feed(packets)
    assert [(item.value, item.source) for item in measured] == [(pytest.approx(1.234), "NMEA2000 130578")]


@pytest.mark.parametrize(
    ("signal", "words"),
    [
        (CanSignal(quantity="pitch", message="127250", signal="heading"), "one of the PGNs"),
        (CanSignal(quantity="pitch", message="ATTITUDE", signal="pitch"), "one of the PGNs"),
        (CanSignal(quantity="pitch", message="127257", signal="tilt"), "sid, yaw, pitch, roll"),
        (CanSignal(quantity="pitch", message="127257", signal="pitch", time="sid"), "time must be left out"),
    ],
)
def test_map_that_names_what_is_not_there(signal: CanSignal, words: str) -> None:
    with pytest.raises(BridgeError, match=words):
        CanDecoder(CanMap(kind="nmea2000", signals=(signal,)))


def fast(payload: bytes, sequence: int = 0, address: int = 1, t_us: int = 0) -> list[Packet]:
    can_id = 0x09F20100 | address
    return [
        Packet(t_us=t_us + n, data=data, can_id=can_id, extended=True)
        for n, data in enumerate(to_frames(payload, sequence))
    ]


@given(st.binary(min_size=1, max_size=223), st.integers(0, 7))
def test_fast_packet_round_trip(payload: bytes, sequence: int) -> None:
    counts: Counter[str] = Counter()
    joined = [FastPackets(counts).feed(packet) for packet in fast(payload, sequence)[:1]]
    assembler = FastPackets(counts)
    joined = [assembler.feed(packet) for packet in fast(payload, sequence)]
    assert joined == [None] * (len(joined) - 1) + [payload]
    assert len(assembler) == 0
    assert not counts


def test_fast_packets_of_several_senders_interleave() -> None:
    counts: Counter[str] = Counter()
    assembler = FastPackets(counts)
    rows = zip(fast(b"a" * 20, 1, 1), fast(b"b" * 20, 1, 2), fast(b"c" * 20, 2, 1), strict=True)
    joined = [assembler.feed(packet) for row in rows for packet in row]
    assert [message for message in joined if message is not None] == [b"a" * 20, b"b" * 20, b"c" * 20]
    assert not counts


@pytest.mark.parametrize("lost", [0, 1, 2, 3])
def test_lost_frame_costs_one_message_and_is_counted(lost: int) -> None:
    counts: Counter[str] = Counter()
    assembler = FastPackets(counts)
    first, second = fast(b"a" * 27, 5), fast(b"b" * 27, 5)
    del first[lost]
    joined = [assembler.feed(packet) for packet in first + second]
    assert [message for message in joined if message is not None] == [b"b" * 27]
    assert counts["refused.fast_packet_lost"] == (0 if lost == 0 else 1)
    assert counts["refused.fast_packet_headless"] == {0: 3, 1: 1, 2: 0, 3: 0}[lost]


def test_old_head_is_not_joined_to_a_new_tail() -> None:
    counts: Counter[str] = Counter()
    assembler = FastPackets(counts)
    head, tail = fast(b"a" * 10), fast(b"b" * 10, t_us=2_000_000)
    assert [assembler.feed(packet) for packet in (head[0], tail[1])] == [None, None]
    assert counts == {"refused.fast_packet_lost": 1}


def test_memory_stays_bounded_on_a_hostile_bus() -> None:
    counts: Counter[str] = Counter()
    assembler = FastPackets(counts)
    for address in range(250):
        for sequence in range(8):
            assembler.feed(fast(b"x" * 200, sequence, address)[0])
    assert len(assembler) == MAX_OPEN
    assert counts["refused.fast_packet_lost"] == 2000 - MAX_OPEN
    generator = random.Random(2)
    decoder = CanDecoder(NMEA2000)
    decoder.feed(
        Packet(t_us=n, data=generator.randbytes(8), can_id=generator.randrange(2**29), extended=True)
        for n in range(20_000)
    )
    assert len(decoder.counts) < 320


@settings(max_examples=100)
@given(st.lists(st.binary(max_size=9), max_size=60))
def test_fast_packets_never_raise(rows: list[bytes]) -> None:
    assembler = FastPackets(Counter())
    for n, data in enumerate(rows):
        message = assembler.feed(Packet(t_us=n, data=data, can_id=0x09F20101, extended=True))
        assert message is None or 0 < len(message) <= 223
