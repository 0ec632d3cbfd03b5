import math
import random
import struct
from collections import Counter
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path

import cantools
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.can_dbc import DEFAULT_DBC
from bridge.can_decoder import CanDecoder
from bridge.can_encoder import CanEncoder
from bridge.can_map import CanMap, CanSelector, CanSignal
from bridge.errors import BridgeError
from bridge.link import Packet
from bridge.measurement import Measurement, Quantity

DATA = Path(__file__).parent.parent / "data" / "can"
VALUES = {"depth": 12.3456, "pitch": -0.251, "rudder": 0.1, "speed": 1.75, "pitch_rate": -0.04}
RESOLUTION = {"depth": 1e-4, "pitch": 1e-6, "rudder": 1e-6, "speed": 1e-4, "pitch_rate": 1e-6}
DEFAULT = CanMap()
USER_MAP = CanMap(
    dbc=str(DATA / "multiplexed.dbc"),
    signals=(
        CanSignal(
            quantity="depth",
            message="SENSORS",
            signal="keel_depth_cm",
            scale=0.01,
            offset=-0.5,
            only=(CanSelector(signal="page", value=0),),
        ),
        CanSignal(
            quantity="pitch",
            message="SENSORS",
            signal="pitch_cdeg",
            scale=math.radians(0.01),
            only=(CanSelector(signal="page", value=1),),
        ),
        CanSignal(
            quantity="pitch_rate",
            message="SENSORS",
            signal="pitch_rate_dps",
            scale=math.radians(1),
            only=(CanSelector(signal="page", value=1),),
        ),
        CanSignal(
            quantity="rudder",
            message="FINS",
            signal="angle",
            scale=math.radians(1),
            only=(CanSelector(signal="fin", value=2),),
        ),
        CanSignal(quantity="pressure", message="HULL", signal="pressure_kpa", scale=1000.0),
    ),
    rudder_sign=-1,
)


def frames(can_map: CanMap = DEFAULT, start_us: int = 1_000_000, steps: int = 5) -> list[Packet]:
    """All quantities, `steps` times, 0.1 s apart."""
    encoder = CanEncoder(can_map)
    return [
        packet
        for n in range(steps)
        for name, value in VALUES.items()
        for packet in encoder.encode(
            Measurement(
                quantity=Quantity(name), value=value + 1e-3 * n, t_us=start_us + 100_000 * n, source="test"
            )
        )
    ]


def decode(packets: Iterable[Packet], can_map: CanMap = DEFAULT) -> tuple[list[Measurement], Counter[str]]:
    decoder = CanDecoder(can_map)
    return decoder.feed(packets), decoder.counts


def frame(message: str, t_us: int, dbc: Path = DEFAULT_DBC, **values: float) -> Packet:
    """One frame made by cantools alone."""
    definition = cantools.database.load_file(dbc).get_message_by_name(message)
    return Packet(
        t_us=t_us,
        data=definition.encode(values, strict=False),
        can_id=definition.frame_id,
        extended=definition.is_extended_frame,
    )


def test_every_quantity_survives_the_default_dbc() -> None:
    measured, counts = decode(frames())
    assert len(measured) == 25
    for index, item in enumerate(measured):
        name = list(VALUES)[index % 5]
        assert item.quantity == name
        assert item.value == pytest.approx(VALUES[name] + 1e-3 * (index // 5), abs=0.51 * RESOLUTION[name])
        assert item.t_us == 1_000_000 + 100_000 * (index // 5)
        assert item.source == name.upper()
        assert item.boot == 0
    assert counts == {name.upper(): 5 for name in VALUES}


def test_default_dbc_as_other_programs_see_it() -> None:
    """Identifiers and layout are a contract: a change must be meant."""
    database = cantools.database.load_file(DEFAULT_DBC)
    depth = next(packet for packet in frames() if packet.can_id == 256)
    assert depth.data == struct.pack("<iI", 123456, 10_000)
    assert {message.name: message.frame_id for message in database.messages} == {
        "DEPTH": 256,
        "PITCH": 257,
        "RUDDER": 258,
        "SPEED": 259,
        "PITCH_RATE": 260,
        "ESTIMATE_STATE": 432,
        "ESTIMATE_A1": 433,
        "ESTIMATE_A2": 434,
        "ESTIMATE_A3": 435,
        "ESTIMATE_B1": 436,
        "ESTIMATE_B2": 437,
        "ESTIMATE_U0": 438,
        "MISMATCH": 439,
    }


@pytest.mark.parametrize("can_map", [CanMap(), CanMap(kind="nmea2000"), CanMap(kind="dronecan"), USER_MAP])
def test_whole_one_by_one_and_after_garbage(can_map: CanMap) -> None:
    packets = frames(can_map)
    whole, _ = decode(packets, can_map)
    assert len({item.quantity for item in whole}) >= 4
    decoder = CanDecoder(can_map)
    assert [item for packet in packets for item in decoder.feed([packet])] == whole
    generator = random.Random(1)
    garbage = [
        Packet(t_us=n, data=generator.randbytes(n % 9), can_id=generator.randrange(2**29), extended=n % 3 > 0)
        for n in range(500)
        if can_map.kind == "dbc"
    ]
    assert [item.value for item in decode(garbage + packets, can_map)[0]] == [item.value for item in whole]
    truncated, counts = decode(
        [Packet(t_us=p.t_us, data=p.data[:2], can_id=p.can_id, extended=p.extended) for p in packets], can_map
    )
    assert truncated == []
    assert sum(count for cause, count in counts.items() if cause.startswith("refused.")) > 0


def test_user_dbc_scales_selects_and_signs() -> None:
    dbc = DATA / "multiplexed.dbc"
    packets = [
        frame("SENSORS", 1_000, dbc, page=0, keel_depth_cm=1250, tick=0),
        frame("SENSORS", 2_000, dbc, page=1, pitch_cdeg=-1500, pitch_rate_dps=2.5, tock=0),
        frame("FINS", 3_000, dbc, fin=1, angle=40),
        frame("FINS", 4_000, dbc, fin=2, angle=10),
        frame("HULL", 5_000, dbc, pressure_kpa=101.325 + 1025 * 9.80665 * 20 / 1000),
    ]
    measured, counts = decode(packets, USER_MAP)
    assert [(item.quantity, item.t_us) for item in measured] == [
        ("depth", 1_000),
        ("pitch", 2_000),
        ("pitch_rate", 2_000),
        ("rudder", 4_000),
        ("depth", 5_000),
    ]
    expected = [12.0, math.radians(-15), math.radians(2.5), -math.radians(10), 20.0]
    assert [item.value for item in measured] == pytest.approx(expected, abs=1e-4)
    assert counts == {"SENSORS": 2, "FINS": 2, "HULL": 1}


def test_each_refusal_is_counted_by_its_cause() -> None:
    dbc = DATA / "multiplexed.dbc"
    packets = [
        Packet(t_us=1, data=b"x" * 8),  # not a CAN packet
        Packet(t_us=2, data=b"x" * 8, can_id=0x7FF),
        Packet(t_us=3, data=b"\x09" + bytes(7), can_id=0x123),  # no such page
        Packet(t_us=4, data=b"\x00", can_id=0x123),
        Packet(t_us=5, data=b"\x01" + struct.pack("<hfB", 9001, 1.0, 0), can_id=0x123),  # pitch > 90 degrees
        Packet(t_us=6, data=b"\x01" + struct.pack("<hfB", 0, math.nan, 0), can_id=0x123),
        frame("HULL", 7, dbc, pressure_kpa=0),
        Packet(t_us=8, data=bytes(8), can_id=0x18FEF100, extended=False),  # not the 29-bit one
    ]
    measured, counts = decode(packets, USER_MAP)
    assert [item.quantity for item in measured] == ["pitch_rate", "pitch"]
    assert counts == {
        "refused.not_can": 1,
        "other": 2,
        "SENSORS": 4,
        "refused.not_decodable": 1,
        "refused.short": 1,
        "refused.range": 2,
        "refused.non_finite": 1,
        "HULL": 1,
    }


def test_time_that_does_not_advance_is_refused_per_source() -> None:
    packets = [frame("DEPTH", 10, time=1.0, depth=1), frame("PITCH", 11, time=0.9, pitch=0.1)]
    packets += [frame("DEPTH", 12, time=1.0, depth=2), frame("DEPTH", 13, time=0.95, depth=3)]
    packets += [frame("PITCH", 14, time=0.95, pitch=0.2)]
    measured, counts = decode(packets)
    assert [(item.quantity, item.t_us) for item in measured] == [
        ("depth", 1_000_000),
        ("pitch", 900_000),
        ("pitch", 950_000),
    ]
    assert counts["refused.duplicate"] == 1
    assert counts["refused.backwards"] == 1


def test_stamps_wrap_and_restarts_start_a_new_boot() -> None:
    period_s = 2**32 * 1e-4
    packets = [frame("DEPTH", 0, time=period_s - 0.1, depth=1), frame("DEPTH", 100_000, time=0.0, depth=2)]
    packets += [frame("DEPTH", 200_000, time=0.1, depth=3)]
    packets += [frame("DEPTH", 60_000_000 + 100_000 * n, time=50 + 0.1 * n, depth=4 + n) for n in range(3)]
    restarted = [frame("DEPTH", 70_000_000 + 100_000 * n, time=5 + 0.1 * n, depth=7 + n) for n in range(3)]
    measured, counts = decode(packets + restarted)
    times = [item.t_us for item in measured]
    steps = [later - earlier for earlier, later in pairwise(times)]
    assert steps[:2] == pytest.approx([100_000, 100_000], abs=100)
    assert min(steps) > 0
    # One frame confirms each of the two steps.
    assert counts["refused.time_step"] == 2
    assert [item.boot for item in measured] == [0, 0, 0, 0, 0, 1, 1]


def test_messages_without_time_are_moved_onto_the_vehicle_clock() -> None:
    signals = (
        CanSignal(quantity="depth", message="DEPTH", signal="depth", time="time"),
        CanSignal(quantity="pitch", message="PITCH", signal="pitch"),
    )
    packets = [frame("PITCH", 5_000_000, pitch=0.1, time=0)]
    packets += [frame("DEPTH", 5_050_000, depth=1, time=100.0), frame("PITCH", 5_060_000, pitch=0.2, time=0)]
    measured, counts = decode(packets, CanMap(signals=signals))
    assert [(item.quantity, item.t_us) for item in measured] == [
        ("depth", 100_000_000),
        ("pitch", 100_010_000),
    ]
    assert counts["refused.no_clock"] == 1


def test_message_of_several_quantities_is_sent_when_all_are_there() -> None:
    encoder = CanEncoder(USER_MAP)
    rate = Measurement(quantity=Quantity.PITCH_RATE, value=0.1, t_us=100, source="")
    pitch = Measurement(quantity=Quantity.PITCH, value=0.2, t_us=100, source="")
    assert encoder.encode(rate) == []
    assert len(encoder.encode(pitch)) == 1
    assert encoder.encode(pitch) == []


def test_encoder_counts_what_it_cannot_send() -> None:
    encoder = CanEncoder(CanMap(signals=(CanSignal(quantity="depth", message="DEPTH", signal="depth"),)))
    assert encoder.encode(Measurement(quantity=Quantity.DEPTH, value=1e9, t_us=0, source="")) == []
    assert encoder.encode(Measurement(quantity=Quantity.DEPTH, value=math.nan, t_us=0, source="")) == []
    assert encoder.encode(Measurement(quantity=Quantity.PITCH, value=0.0, t_us=0, source="")) == []
    assert encoder.counts == {"refused.not_encodable": 2, "refused.not_mapped": 1}


def test_estimates_travel_in_the_default_dbc() -> None:
    encoder = CanEncoder(CanMap(kind="nmea2000"))
    values = {"a1": -0.63, "a1_std": 0.004, "u0": 2.5, "status": 4.0, "valid": 17.0, "unknown": 1.0}
    packets = encoder.encode_estimates(20_000_000, values)
    database = cantools.database.load_file(DEFAULT_DBC)
    seen = [
        (database.get_message_by_frame_id(p.can_id).name, database.decode_message(p.can_id, p.data))
        for p in packets
    ]
    assert [name for name, _ in seen] == ["ESTIMATE_STATE", "ESTIMATE_A1", "ESTIMATE_U0"]
    assert seen[0][1] == {"time": 20.0, "status": 4, "valid": 17}
    assert seen[1][1] == pytest.approx({"a1": -0.63, "a1_std": 0.004})
    assert seen[2][1]["u0"] == 2.5
    assert math.isnan(seen[2][1]["u0_std"])
    assert encoder.encode_estimates(0, {"status": 300.0}) == []
    assert encoder.counts["refused.not_encodable"] == 1


def test_a_warning_travels_in_the_default_dbc() -> None:
    encoder = CanEncoder(CanMap(kind="nmea2000"))
    (packet,) = encoder.encode_warning(20_000_000, {"mismatch": 5.0, "mism_ratio": 2.34})
    database = cantools.database.load_file(DEFAULT_DBC)
    assert database.get_message_by_frame_id(packet.can_id).name == "MISMATCH"
    seen = database.decode_message(packet.can_id, packet.data)
    assert seen == {"time": 20.0, "mismatch": "actuator", "mism_ratio": pytest.approx(2.34)}
    assert encoder.encode_warning(0, {"mismatch": 5.0, "mism_ratio": 1e6}) == []
    assert encoder.counts["refused.not_encodable"] == 1


@pytest.mark.parametrize(
    ("can_map", "words"),
    [
        (CanMap(dbc="no/such.dbc", signals=USER_MAP.signals), "no/such.dbc cannot be read"),
        (CanMap(dbc="x.txt", signals=USER_MAP.signals), "must end in one of .dbc"),
        (CanMap(signals=(CanSignal(quantity="depth", message="DEEP", signal="d"),)), "got DEEP"),
        (CanMap(signals=(CanSignal(quantity="depth", message="DEPTH", signal="d"),)), "depth, time (got d)"),
        (
            CanMap(signals=(CanSignal(quantity="depth", message="DEPTH", signal="depth", time="t"),)),
            "depth, time (got t)",
        ),
    ],
)
def test_map_that_does_not_fit_its_dbc_is_one_clear_line(can_map: CanMap, words: str) -> None:
    with pytest.raises(BridgeError, match=r"can\.") as caught:
        CanDecoder(can_map)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"BO_ broken", bytes(range(256)), b"\xff\xfe\x00"])
def test_damaged_dbc_is_one_clear_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "my.dbc"
    path.write_bytes(content)
    with pytest.raises(BridgeError, match=r"my\.dbc|must be one of") as caught:
        CanDecoder(CanMap(dbc=str(path), signals=USER_MAP.signals))
    assert "\n" not in str(caught.value)


IDS = st.one_of(
    st.sampled_from(
        [256, 257, 0x123, 0x18FEF100, 0x09F11942, 0x09F10D42, 0x15FD0A42, 0x09FE1242, 0x1003E82A]
    ),
    st.integers(0, 2**29 - 1),
)


@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.tuples(IDS, st.booleans(), st.binary(max_size=10), st.integers(-(10**7), 10**16)), max_size=40
    ),
    st.sampled_from([CanMap(), CanMap(kind="nmea2000"), CanMap(kind="dronecan"), USER_MAP]),
)
def test_no_frame_ever_raises(rows: list[tuple[int, bool, bytes, int]], can_map: CanMap) -> None:
    packets = [Packet(t_us=t, data=data, can_id=i, extended=extended) for i, extended, data, t in rows]
    measured, _ = decode(packets, can_map)
    assert all(math.isfinite(item.value) for item in measured)
    latest: dict[Quantity, int] = {}
    for item in measured:
        assert item.t_us > latest.get(item.quantity, item.t_us - 1) or can_map is USER_MAP
        latest[item.quantity] = item.t_us
