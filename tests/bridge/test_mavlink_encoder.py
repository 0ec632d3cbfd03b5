"""Encoding is the inverse of decoding, and the vendor's library reads what we send."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.mavlink_decoder import MavlinkDecoder
from bridge.mavlink_encoder import MavlinkEncoder
from bridge.mavlink_map import MavlinkMap, ServoTerm
from bridge.measurement import Measurement, Quantity


def read_by_pymavlink(raw: bytes) -> list[dialect.MAVLink_message]:
    return dialect.MAVLink(None).parse_buffer(raw) or []


def encoder(**settings: object) -> MavlinkEncoder:
    return MavlinkEncoder(MavlinkMap(**settings), system=1, component=191)  # type: ignore[arg-type]


TWO_PLANES = (
    ServoTerm(channel=3, rad_per_us=1e-3, trim_us=1520.0),
    ServoTerm(channel=19, rad_per_us=-1e-3),
)


@given(
    depth_source=st.sampled_from(
        ["SCALED_PRESSURE", "SCALED_PRESSURE2", "SCALED_PRESSURE3", "LOCAL_POSITION_NED", "VFR_HUD", "AHRS2"]
    ),
    speed_source=st.sampled_from(["LOCAL_POSITION_NED", "VFR_HUD"]),
    pitch_sign=st.sampled_from([1, -1]),
    depth=st.floats(0.0, 300.0),
    pitch=st.floats(-1.2, 1.2),
    rudder=st.floats(-0.35, 0.35),
    speed=st.floats(0.0, 5.0),
    rate=st.floats(-2.0, 2.0),
    start_ms=st.integers(1, 2**31),
)
@settings(max_examples=100, deadline=None)
def test_what_is_encoded_is_decoded(
    depth_source: str,
    speed_source: str,
    pitch_sign: int,
    depth: float,
    pitch: float,
    rudder: float,
    speed: float,
    rate: float,
    start_ms: int,
) -> None:
    mapping = MavlinkMap(
        system_id=1,
        depth_source=depth_source,  # type: ignore[arg-type]
        speed_source=speed_source,  # type: ignore[arg-type]
        surface_pressure_hpa=1013.25,
        pitch_sign=pitch_sign,
        rudder=TWO_PLANES,
    )
    values = {
        Quantity.PITCH: pitch,
        Quantity.PITCH_RATE: rate,
        Quantity.DEPTH: depth,
        Quantity.SPEED: speed,
        Quantity.RUDDER: rudder,
    }
    sent = [
        Measurement(quantity=quantity, value=value, t_us=1000 * start_ms, source="")
        for quantity, value in values.items()
    ]
    decoder = MavlinkDecoder(mapping)
    raw = MavlinkEncoder(mapping, system=1, component=1).measurements(sent)
    got = {item.quantity: item for item in decoder.feed(raw, 1000 * start_ms)}
    assert set(got) == set(values)
    for quantity, value in values.items():
        # Two outputs in whole microseconds at 1 mrad each; pressure is a float of 1e-4 hPa and up.
        resolution = 1.01e-3 if quantity is Quantity.RUDDER else 6e-4
        assert got[quantity].value == pytest.approx(value, rel=1e-5, abs=resolution)
        assert got[quantity].t_us == 1000 * start_ms


def test_what_was_not_measured_is_not_a_number() -> None:
    pitch = Measurement(quantity=Quantity.PITCH, value=0.1, t_us=1000, source="")
    (message,) = read_by_pymavlink(encoder().measurements([pitch]))
    assert message.pitchspeed != message.pitchspeed


def test_heartbeat_is_that_of_a_companion() -> None:
    (message,) = read_by_pymavlink(encoder().heartbeat())
    assert (message.type, message.autopilot) == (18, 8)
    assert (message.get_srcSystem(), message.get_srcComponent()) == (1, 191)


def test_replayed_vehicle_is_locked_onto() -> None:
    decoder = MavlinkDecoder(MavlinkMap())
    decoder.feed(MavlinkEncoder(MavlinkMap(), system=3, component=1).vehicle_heartbeat(), 0)
    assert decoder.vehicle == (3, 1)


def test_value_beyond_single_precision_is_sent_as_infinite() -> None:
    messages = read_by_pymavlink(encoder().named_values(0, {"std": 1e300, "low": -1e300}))
    assert [message.value for message in messages] == [float("inf"), float("-inf")]


def test_named_values_are_read_by_pymavlink_and_count_up() -> None:
    messages = read_by_pymavlink(encoder().named_values(5_000_000, {"Mq": -1.25, "0123456789": 2.0}))
    assert [(m.name, m.value, m.time_boot_ms) for m in messages] == [
        ("Mq", -1.25, 5000),
        ("0123456789", 2.0, 5000),
    ]
    assert [m.get_seq() for m in messages] == [0, 1]


@pytest.mark.parametrize("name", ["", "01234567890"])
def test_name_that_the_message_cannot_hold_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=r"name must have 1\.\.10 characters"):
        encoder().named_values(0, {name: 1.0})


def test_a_warning_is_a_statustext() -> None:
    (message,) = read_by_pymavlink(encoder().warning("mils mismatch: actuator, pitch error x3.1"))
    assert message.get_type() == "STATUSTEXT"
    assert message.text == "mils mismatch: actuator, pitch error x3.1"
    assert message.severity == dialect.MAV_SEVERITY_WARNING
    with pytest.raises(ValueError, match=r"1\.\.50 characters"):
        encoder().warning(51 * "x")


def test_rate_request_is_a_set_message_interval() -> None:
    (message,) = read_by_pymavlink(encoder().request_rate((1, 1), "ATTITUDE", 20.0))
    assert (message.target_system, message.target_component) == (1, 1)
    assert (message.command, message.param1, message.param2) == (511, 30.0, 50_000.0)


def test_sequence_wraps() -> None:
    sender = encoder()
    messages = read_by_pymavlink(b"".join(sender.heartbeat() for _ in range(300)))
    assert [m.get_seq() for m in messages] == [k % 256 for k in range(300)]
