"""The decoder on frames made by the vendor's library, and on everything that is no frame of the vehicle."""

from itertools import pairwise
from math import inf, nan, pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect
from vehicle_frames import Vehicle, of

from bridge.mavlink_decoder import MavlinkDecoder, forward_speed
from bridge.mavlink_map import MavlinkMap, ServoTerm
from bridge.measurement import Measurement, Quantity

PLANE = (ServoTerm(channel=3, rad_per_us=1e-3),)


def decoder(**settings: object) -> MavlinkDecoder:
    known = {
        "system_id": 1,
        "depth_source": "SCALED_PRESSURE2",
        "surface_pressure_hpa": 1013.25,
        "rudder": PLANE,
        **settings,
    }
    return MavlinkDecoder(MavlinkMap(**known))  # type: ignore[arg-type]


def dive(vehicle: Vehicle, n: int = 30) -> bytes:
    """Three seconds at 10 Hz of everything."""
    raw = b""
    for k in range(n):
        ms = 5000 + 100 * k
        raw += vehicle.attitude(ms, pitch=0.01 * k, rate=0.1)
        raw += vehicle.pressure(ms, 1100.0 + k)
        raw += vehicle.servo(1000 * ms, {3: 1500 + k})
        raw += vehicle.position(ms, 1.0)
    return raw


def test_each_message_becomes_its_quantity_in_si() -> None:
    d = decoder(speed_source="LOCAL_POSITION_NED")
    v = Vehicle()
    out = d.feed(
        v.attitude(5000, pitch=0.1, rate=0.02, yaw=pi / 2)
        + v.pressure(5010, 1113.25)
        + v.servo(5_020_000, {3: 1600})
        + v.position(5030, 1.0, (0.0, 2.0, 0.0)),
        0,
    )
    assert [(item.quantity, item.source, item.t_us) for item in out] == [
        (Quantity.PITCH, "ATTITUDE", 5_000_000),
        (Quantity.PITCH_RATE, "ATTITUDE", 5_000_000),
        (Quantity.DEPTH, "SCALED_PRESSURE2", 5_010_000),
        (Quantity.RUDDER, "SERVO_OUTPUT_RAW", 5_020_000),
        (Quantity.SPEED, "LOCAL_POSITION_NED", 5_030_000),
    ]
    values = [item.value for item in out]
    assert values == pytest.approx([0.1, 0.02, 1e4 / (1025 * 9.80665), 0.1, 2.0 * 0.995], rel=1e-3)


def test_backwards_mounted_autopilot_is_a_sign() -> None:
    out = decoder(pitch_sign=-1).feed(Vehicle().attitude(1000, pitch=0.1, rate=0.2), 0)
    assert [item.value for item in out] == pytest.approx([-0.1, -0.2])


def test_pitch_rate_can_be_left_out() -> None:
    out = decoder(pitch_rate=False).feed(Vehicle().attitude(1000), 0)
    assert [item.quantity for item in out] == [Quantity.PITCH]


def test_position_is_down_and_heights_are_up() -> None:
    v = Vehicle()
    assert of(decoder(depth_source="LOCAL_POSITION_NED").feed(v.position(1000, 3.0), 0), Quantity.DEPTH)[
        0
    ].value == pytest.approx(3.0)
    for source, raw in (("VFR_HUD", v.vfr_hud(-3.0)), ("AHRS2", v.ahrs2(-3.0))):
        d = decoder(depth_source=source)
        d.feed(v.attitude(1000), 1_020_000)
        (depth,) = of(d.feed(raw, 1_070_000), Quantity.DEPTH)
        assert depth.value == pytest.approx(3.0)
        assert depth.t_us == 1_050_000


def test_message_without_stamp_waits_for_the_clock() -> None:
    d = decoder(depth_source="VFR_HUD")
    assert d.feed(Vehicle().vfr_hud(-3.0), 0) == []
    assert d.counts["refused.no_clock"] == 1


def test_forward_speed_is_along_the_body() -> None:
    # Nose down 30 deg, moving along the nose at 2 m/s to the south.
    assert forward_speed((-2 * 0.8660254, 0.0, 1.0), -pi / 6, pi) == pytest.approx(2.0)


def test_velocity_without_attitude_is_refused() -> None:
    d = decoder(speed_source="LOCAL_POSITION_NED")
    d.feed(Vehicle().position(1000, 1.0, (1.0, 0.0, 0.0)), 0)
    assert d.counts["refused.no_attitude"] == 1


@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_non_finite_payload_is_refused_and_counted(bad: float) -> None:
    d = decoder(speed_source="VFR_HUD")
    v = Vehicle()
    out = d.feed(
        v.attitude(1000, pitch=bad, rate=bad) + v.pressure(1000, bad) + v.vfr_hud(0.0, bad), 1_000_000
    )
    assert out == []
    assert d.counts["refused.non_finite"] == 4


def test_absurd_pitch_is_refused() -> None:
    d = decoder(pitch_rate=False)
    assert d.feed(Vehicle().attitude(1000, pitch=57.0), 0) == []
    assert d.counts["refused.range"] == 1


def test_locks_to_the_first_autopilot_and_no_one_else() -> None:
    d = decoder(system_id=None)
    gcs, companion, vehicle = Vehicle(255, 190), Vehicle(1, 191), Vehicle(7, 1)
    d.feed(gcs.heartbeat(dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID), 0)
    d.feed(companion.heartbeat(dialect.MAV_TYPE_ONBOARD_CONTROLLER, dialect.MAV_AUTOPILOT_INVALID), 0)
    assert d.vehicle is None
    assert d.feed(vehicle.attitude(1000), 0) == []
    assert d.counts["refused.no_vehicle_yet"] == 3
    d.feed(vehicle.heartbeat(dialect.MAV_TYPE_GROUND_ROVER), 0)
    assert d.vehicle == (7, 1)
    d.feed(Vehicle(8, 1).heartbeat(), 0)
    assert d.vehicle == (7, 1)
    assert len(d.feed(vehicle.attitude(1100), 0)) == 2


def test_two_interleaved_vehicles_give_one_vehicles_measurements() -> None:
    own, other = Vehicle(1), Vehicle(2)
    alone = decoder().feed(dive(own), 0)
    d = decoder()
    own = Vehicle(1)
    mixed: list[Measurement] = []
    for k in range(30):
        ms = 5000 + 100 * k
        mixed += d.feed(other.attitude(900_000 + ms, pitch=-1.0) + other.pressure(ms, 2000.0), 0)
        mixed += d.feed(own.attitude(ms, pitch=0.01 * k, rate=0.1) + own.pressure(ms, 1100.0 + k), 0)
    assert mixed == [x for x in alone if x.quantity is not Quantity.RUDDER]
    assert d.counts["refused.other_sender"] == 60


def test_a_second_autopilot_on_the_link_is_told_once() -> None:
    d = decoder(system_id=None)
    first, second, station = Vehicle(1), Vehicle(2), Vehicle(255, 190)
    for _ in range(2):
        d.feed(first.heartbeat() + second.heartbeat() + station.heartbeat(dialect.MAV_TYPE_GCS, 8), 0)
    assert [note for note in d.notes if "autopilot on this link too" in note] == [
        "system 2 is an autopilot on this link too and is ignored: [mavlink] system_id says which one to use"
    ]
    chosen = decoder(system_id=1)
    chosen.feed(first.heartbeat() + second.heartbeat(), 0)
    assert chosen.notes == []


def test_frame_that_came_twice_counts_once() -> None:
    v = Vehicle()
    d = decoder(depth_source="VFR_HUD")
    d.feed(v.attitude(1000), 1_000_000)
    raw = v.vfr_hud(-3.0)
    assert len(d.feed(raw, 1_010_000)) == 1
    assert d.feed(raw, 1_020_000) == []
    assert d.counts["refused.duplicate"] == 1
    assert d.counts["lost"] == 0


def test_same_stamp_again_is_a_duplicate_and_an_older_one_is_backwards() -> None:
    d = decoder(pitch_rate=False)
    v = Vehicle()
    d.feed(v.attitude(1000) + v.attitude(1100) + v.attitude(1100, 0.2) + v.attitude(1050), 0)
    assert d.counts["refused.duplicate"] == 1
    assert d.counts["refused.backwards"] == 1


def test_missing_frames_are_counted_across_the_wrap_of_the_sequence() -> None:
    d = decoder()
    vehicle = Vehicle()
    raw = [vehicle.attitude(1000 + 10 * k) for k in range(300)]
    d.feed(b"".join(raw[:250] + raw[260:]), 0)
    assert d.counts["lost"] == 10


def test_wrap_of_servo_microseconds_is_unwrapped() -> None:
    d = decoder()
    v = Vehicle()
    wrap_ms = 2**32 // 1000
    times = []
    for k in range(20):
        ms = wrap_ms - 1000 + 100 * k
        d.feed(v.attitude(ms), 0)
        times += [item.t_us for item in d.feed(v.servo((1000 * ms) % 2**32, {3: 1500}), 0)]
    assert len(times) == 20
    assert [b - a for a, b in pairwise(times)] == [100_000] * 19


def test_restart_raises_boot_and_time_goes_on() -> None:
    d = decoder()
    v = Vehicle()
    before = d.feed(dive(v), 10_000_000)
    after = d.feed(dive(v), 30_000_000)
    assert {item.boot for item in before} == {0}
    assert {item.boot for item in after} == {1}
    assert min(item.t_us for item in after) > max(item.t_us for item in before)
    assert d.counts["refused.time_step"] == 1


def test_absurd_stamp_makes_no_measurement_at_an_absurd_time() -> None:
    d = decoder()
    v = Vehicle()
    out = d.feed(dive(v), 0) + d.feed(v.attitude(2**32 - 5) + v.attitude(10**6) + v.attitude(2**31), 0)
    out += d.feed(v.attitude(8000), 0)
    assert max(item.t_us for item in out) == 8_000_000
    assert min(item.t_us for item in out) == 5_000_000
    assert d.boot == 0


def test_heartbeat_and_ack_are_no_measurements() -> None:
    d = decoder()
    v = Vehicle()
    assert d.feed(v.heartbeat() + v.ack(0) + v.ack(3), 0) == []
    assert (d.counts["ack.accepted"], d.counts["ack.denied"]) == (1, 1)


@given(chunks=st.lists(st.binary(max_size=400), max_size=12))
@settings(max_examples=100, deadline=None)
def test_random_bytes_never_raise_and_never_measure(chunks: list[bytes]) -> None:
    d = decoder()
    for k, chunk in enumerate(chunks):
        assert d.feed(chunk, k) == []
    assert len(d._framer._buffer) < 300


@given(
    payload=st.binary(min_size=0, max_size=255),
    number=st.sampled_from([0, 30, 32, 29, 36, 74, 77, 137, 143, 178]),
)
@settings(max_examples=300, deadline=None)
def test_any_payload_in_an_intact_frame_never_raises(payload: bytes, number: int) -> None:
    """Right checksum, hostile contents: also shorter and longer than the definition."""
    message = dialect.mavlink_map[number]
    header = bytes([len(payload), 0, 0, 9, 1, 1, number, 0, 0])
    crc = dialect.x25crc(header + payload + bytes([message.crc_extra])).crc
    d = decoder(depth_source="auto", speed_source="LOCAL_POSITION_NED")
    v = Vehicle()
    d.feed(v.attitude(5000), 0)
    for item in d.feed(b"\xfd" + header + payload + crc.to_bytes(2, "little"), 0):
        assert abs(item.t_us - 5_000_000) <= 10_000_000
        assert item.value == item.value
    # Two later ones, for the first may have to confirm a leap of more than 10 s.
    assert len(d.feed(v.attitude(15_500) + v.attitude(15_600), 0)) >= 2


@given(
    edges=st.lists(st.integers(0, 6000), max_size=12),
    prefix=st.sampled_from([b"", b"boot\r\n", b"\xfd", b"\x00\xfe\x09"]),
)
@settings(max_examples=30, deadline=None)
def test_split_and_garbage_change_no_measurement(edges: list[int], prefix: bytes) -> None:
    raw = prefix + dive(Vehicle())
    cuts = [0, *sorted(edges), len(raw)]
    whole = decoder().feed(dive(Vehicle()), 0)
    d = decoder()
    assert [x for a, b in pairwise(cuts) for x in d.feed(raw[a:b], 0)] == whole


def test_stray_marker_every_ten_frames_loses_no_measurement() -> None:
    whole = decoder().feed(dive(Vehicle(), 100), 0)
    v = Vehicle()
    raw = b"".join(b"\xfd" * (k % 3 == 0) + dive_at(v, k) for k in range(100))
    assert decoder().feed(raw + bytes(300), 0) == whole


def dive_at(vehicle: Vehicle, k: int) -> bytes:
    ms = 5000 + 100 * k
    return (
        vehicle.attitude(ms, pitch=0.01 * k, rate=0.1)
        + vehicle.pressure(ms, 1100.0 + k)
        + vehicle.servo(1000 * ms, {3: 1500 + k})
        + vehicle.position(ms, 1.0)
    )


def test_cut_tail_costs_only_the_cut_message() -> None:
    raw = dive(Vehicle())
    whole = decoder().feed(raw, 0)
    assert decoder().feed(raw[:-5], 0) == whole  # the last message carries no measurement here
    assert decoder().feed(raw[:-40], 0) == whole[:-1]
