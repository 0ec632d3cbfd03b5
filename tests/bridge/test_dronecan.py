import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from bridge.can_decoder import CanDecoder
from bridge.can_encoder import CanEncoder
from bridge.can_map import CanMap, CanSelector, CanSignal
from bridge.errors import BridgeError
from bridge.link import Packet
from bridge.measurement import Measurement, Quantity

GOLDEN = json.loads((Path(__file__).parent.parent / "data" / "can" / "dronecan_golden.json").read_text())
DRONECAN = CanMap(kind="dronecan", rudder_instance=3)


def golden(data_type: str, t_us: int = 1_000_000) -> list[Packet]:
    """Frames as the vendor's library makes them."""
    entry = GOLDEN[data_type]
    return [
        Packet(t_us=t_us + n, data=bytes.fromhex(data), can_id=entry["can_id"], extended=True)
        for n, data in enumerate(entry["frames"])
    ]


def values(packets: Sequence[Packet], can_map: CanMap = DRONECAN) -> dict[str, float]:
    return {item.quantity: item.value for item in CanDecoder(can_map).feed(packets)}


def test_frames_of_the_vendors_library() -> None:
    # Half floats: the vehicle's pitch is known to 0.013 degrees.
    assert values(golden("1000")) == {"pitch": pytest.approx(-0.3, abs=5e-4), "pitch_rate": 0.125}
    assert values(golden("1011")) == {"rudder": -0.25}
    depth = (201_325.0 - 101_325.0) / (1025.0 * 9.80665)
    assert values(golden("1028")) == {"depth": pytest.approx(depth, abs=1e-3)}


def test_time_of_the_solution_can_be_the_clock() -> None:
    signals = (CanSignal(quantity="pitch", message="1000", signal="pitch", time="time"),)
    measured = CanDecoder(CanMap(kind="dronecan", signals=signals)).feed(golden("1000"))
    assert [item.t_us for item in measured] == [123_456_789]


def test_our_frames_equal_the_vendors_but_for_node_and_transfer() -> None:
    encoder = CanEncoder(DRONECAN)
    pressure = encoder.encode(
        Measurement(quantity=Quantity.DEPTH, value=100_000 / (1025.0 * 9.80665), t_us=0, source="")
    )
    assert [packet.data[:-1] for packet in pressure] == [packet.data[:-1] for packet in golden("1028")]
    rudder = encoder.encode(Measurement(quantity=Quantity.RUDDER, value=-0.25, t_us=0, source=""))
    assert values(rudder) == {"rudder": -0.25}
    assert [packet.data[-1] & 0xE0 for packet in rudder] == [
        packet.data[-1] & 0xE0 for packet in golden("1011")
    ]


def test_other_actuators_and_unknown_positions_are_no_rudder() -> None:
    assert values(golden("1011"), CanMap(kind="dronecan", rudder_instance=0)) == {}
    signals = (
        CanSignal(
            quantity="rudder",
            message="1011",
            signal="position",
            only=(CanSelector(signal="actuator_id", value=3),),
        ),
    )
    unknown = CanEncoder(CanMap(kind="dronecan", signals=signals)).encode(
        Measurement(quantity=Quantity.RUDDER, value=float("nan"), t_us=0, source="")
    )
    decoder = CanDecoder(DRONECAN)
    assert decoder.feed(unknown) == []
    assert decoder.counts["refused.not_available"] == 1


@pytest.mark.parametrize("lost", range(6))
def test_lost_frame_costs_one_transfer(lost: int) -> None:
    packets = golden("1000")
    del packets[lost]
    decoder = CanDecoder(DRONECAN)
    assert decoder.feed(packets) == []
    assert len(decoder.feed(golden("1000", 2_000_000))) == 2
    assert sum(decoder.counts[f"refused.transfer_{cause}"] for cause in ("lost", "headless")) >= 1


def test_flipped_bit_is_caught_by_the_crc() -> None:
    packets = golden("1011")
    damaged = bytearray(packets[0].data)
    damaged[4] ^= 0x10
    decoder = CanDecoder(DRONECAN)
    first = Packet(t_us=1, data=bytes(damaged), can_id=packets[0].can_id, extended=True)
    assert decoder.feed([first, packets[1]]) == []
    assert decoder.counts["refused.crc"] == 1


def test_services_anonymous_nodes_and_short_payloads_are_refused() -> None:
    packets = golden("1028")
    can_id = GOLDEN["1028"]["can_id"]
    decoder = CanDecoder(DRONECAN)
    others = [
        Packet(t_us=1, data=packets[0].data, can_id=can_id | 0x80, extended=True),
        Packet(t_us=2, data=packets[0].data, can_id=can_id & ~0x7F, extended=True),
        Packet(t_us=3, data=packets[0].data, can_id=can_id, extended=False),
        Packet(t_us=4, data=b"\x00\xc0", can_id=can_id, extended=True),
        Packet(t_us=5, data=b"", can_id=can_id, extended=True),
    ]
    assert decoder.feed(others) == []
    assert decoder.counts == {"other": 3, "DroneCAN 1028": 1, "refused.short": 2}


@pytest.mark.parametrize(
    ("signal", "words"),
    [
        (CanSignal(quantity="pitch", message="1010", signal="pitch"), "one of the data types"),
        (CanSignal(quantity="pitch", message="1000", signal="roll"), "time, pitch, pitch_rate"),
    ],
)
def test_map_that_names_what_is_not_there(signal: CanSignal, words: str) -> None:
    with pytest.raises(BridgeError, match=words):
        CanDecoder(CanMap(kind="dronecan", signals=(signal,)))
