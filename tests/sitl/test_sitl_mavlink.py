"""The simulated autopilot's MAVLink, judged by pymavlink."""

from collections import Counter
from dataclasses import replace
from math import isnan, nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from tools.sitl.mavlink_vehicle import MavlinkVehicle
from tools.sitl.recording import record
from tools.sitl.scenario import Mavlink, Rates, Scenario, load
from tools.sitl.sensors import Channel, Sensors
from tools.sitl.track import Track


class Wire:
    """A link in memory."""

    def __init__(self) -> None:
        self.out = bytearray()
        self.inbox = b""

    def send(self, data: bytes) -> None:
        self.out += data

    def receive(self, timeout_s: float) -> bytes:
        assert timeout_s >= 0.0
        data, self.inbox = self.inbox, b""
        return data

    def close(self) -> None:
        pass

    def messages(self, name: str | None = None) -> list:
        parser = mavlink.MAVLink(None)
        parser.robust_parsing = True
        found = parser.parse_buffer(bytes(self.out)) or []
        return [message for message in found if name in (None, message.get_type())]


class Run:
    """A vehicle and the ground's side of its link."""

    def __init__(self, scenario: Scenario, seed: int = 1) -> None:
        self.wire = Wire()
        self.track = Track(scenario, seed)
        self.vehicle = MavlinkVehicle(scenario, seed, self.track, self.wire)
        self.ground = mavlink.MAVLink(None, 1, 191)

    def until(self, t_s: float) -> "Run":
        while self.vehicle.next_s < t_s - 1e-6:
            due = self.vehicle.next_s
            self.track.advance(due)
            self.vehicle.emit(due)
        return self

    def ask(self, message) -> list:
        before = len(self.wire.out)
        self.wire.inbox = message.pack(self.ground)
        self.vehicle.listen(0.0)
        answer = Wire()
        answer.out = self.wire.out[before:]
        return answer.messages()

    def ask_interval(self, name: str, interval_us: float, system: int = 1) -> list:
        number = getattr(mavlink, f"MAVLINK_MSG_ID_{name}") if isinstance(name, str) else name
        command = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
        return self.ask(
            self.ground.command_long_encode(system, 1, command, 0, number, interval_us, 0, 0, 0, 0, 0)
        )

    def count(self, seconds: float) -> Counter:
        before = Counter(self.vehicle.sent)
        self.until(self.track.now.t_s + seconds)
        return Counter(self.vehicle.sent) - before


def test_every_frame_parses_and_none_is_lost():
    run = Run(load("rough_sea"), 7).until(30.0)
    found = run.wire.messages()
    assert Counter(m.get_type() for m in found if m.get_type() != "BAD_DATA") == run.vehicle.sent
    rest = b"".join(bytes(m.data) for m in found if m.get_type() == "BAD_DATA")
    assert rest == b"\r\n\r\nSimulated vehicle, board 9\r\nfree RAM: 65536\r\nsensors ok\r\n"
    numbers = [m.get_seq() for m in found if m.get_type() != "BAD_DATA"]
    assert numbers == [k % 256 for k in range(len(numbers))]


def test_default_rates_hold():
    assert Run(load("default")).until(10.0).vehicle.sent == {
        "HEARTBEAT": 10,
        "ATTITUDE": 100,
        "SCALED_PRESSURE2": 100,
        "SERVO_OUTPUT_RAW": 100,
        "VFR_HUD": 40,
    }


def test_heartbeat_is_an_autopilots():
    heartbeat = Run(load("default")).until(0.5).wire.messages("HEARTBEAT")[0]
    assert (heartbeat.get_srcSystem(), heartbeat.get_srcComponent()) == (1, 1)
    assert heartbeat.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    assert heartbeat.type == mavlink.MAV_TYPE_SUBMARINE


def test_values_mean_what_the_mapping_says():
    """Depth within float32, pitch and rudder exactly as the same seed records them."""
    scenario = replace(load("linear_noise_free"), duration_s=30.0)
    scenario = replace(scenario, excitation=replace(scenario.excitation, quantum=0.001))
    table = record(scenario, 1)
    run = Run(scenario).until(30.0)
    depth = [
        (m.press_abs * 100 - 101325.0) / (1025.0 * 9.80665) for m in run.wire.messages("SCALED_PRESSURE2")
    ]
    pitch = [m.pitch for m in run.wire.messages("ATTITUDE")]
    rudder = [(m.servo1_raw - 1500) * 1e-3 for m in run.wire.messages("SERVO_OUTPUT_RAW")]
    assert depth == pytest.approx(table["depth_m"][:300], abs=0.002)
    assert pitch == pytest.approx(table["pitch_rad"][:300], abs=1e-7)
    assert rudder == pytest.approx(table["rudder_rad"][:300], abs=1e-9)
    times = [m.time_boot_ms for m in run.wire.messages("ATTITUDE")]
    assert times == list(range(0, 30000, 100))


def test_optional_depth_carriers_agree():
    scenario = replace(
        load("linear_noise_free"), mavlink=Mavlink(rates=Rates(vfr_hud=5.0, local_position=5.0))
    )
    run = Run(scenario).until(10.0)
    hud, ned = run.wire.messages("VFR_HUD"), run.wire.messages("LOCAL_POSITION_NED")
    assert len(hud) == len(ned) == 50
    assert [-m.alt for m in hud] == pytest.approx([m.z for m in ned], abs=1e-5)
    assert hud[-1].airspeed == pytest.approx(2.5)


def test_servo_clock_wraps_at_32_bits_and_the_millisecond_clock_does_not():
    scenario = replace(load("default"), mavlink=Mavlink(boot_clock_s=4290.0))
    run = Run(scenario).until(10.0)
    servo = [m.time_usec for m in run.wire.messages("SERVO_OUTPUT_RAW")]
    assert min(servo) < 100_000 < 4_294_000_000 < max(servo)
    assert np.all(np.diff(np.array(servo, dtype=np.uint32)) == 100_000)  # in 32-bit arithmetic
    assert [m.time_boot_ms for m in run.wire.messages("ATTITUDE")][-1] == 4_299_900


def test_interval_is_granted_and_obeyed():
    run = Run(load("default")).until(5.0)
    (ack,) = run.ask_interval("ATTITUDE", 20_000)
    assert (ack.get_type(), ack.command, ack.result) == ("COMMAND_ACK", 511, mavlink.MAV_RESULT_ACCEPTED)
    assert (ack.target_system, ack.target_component) == (1, 191)
    assert run.count(10.0)["ATTITUDE"] == pytest.approx(500, abs=2)
    times = [m.time_boot_ms for m in run.wire.messages("ATTITUDE")]
    assert times == sorted(set(times))
    assert run.ask_interval("ATTITUDE", -1)[0].result == mavlink.MAV_RESULT_ACCEPTED
    assert run.count(2.0)["ATTITUDE"] == 0
    run.ask_interval("ATTITUDE", 0)
    assert run.count(10.0)["ATTITUDE"] == pytest.approx(100, abs=1)


@pytest.mark.parametrize(
    ("name", "interval_us", "result"),
    [
        ("ATTITUDE", 2_500, mavlink.MAV_RESULT_DENIED),
        ("ATTITUDE", 5_000, mavlink.MAV_RESULT_ACCEPTED),
        ("ATTITUDE", nan, mavlink.MAV_RESULT_DENIED),
        ("SCALED_PRESSURE3", 100_000, mavlink.MAV_RESULT_FAILED),
        (60_000, 100_000, mavlink.MAV_RESULT_FAILED),
    ],
)
def test_interval_is_answered_honestly(name, interval_us, result):
    run = Run(load("default")).until(2.0)
    assert run.ask_interval(name, interval_us)[0].result == result
    if result != mavlink.MAV_RESULT_ACCEPTED:
        assert run.count(10.0)["ATTITUDE"] == pytest.approx(100, abs=1)


def test_commands_to_others_are_not_answered():
    assert Run(load("default")).until(1.0).ask_interval("ATTITUDE", 20_000, system=9) == []


def test_other_commands_are_unsupported():
    run = Run(load("default")).until(1.0)
    (ack,) = run.ask(run.ground.command_long_encode(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    assert ack.result == mavlink.MAV_RESULT_UNSUPPORTED


def test_ground_station_overwrites_rates():
    run = Run(load("default")).until(1.0)
    run.ask(run.ground.request_data_stream_encode(1, 1, mavlink.MAV_DATA_STREAM_EXTRA1, 2, 1))
    assert run.count(10.0)["ATTITUDE"] == pytest.approx(20, abs=1)
    run.ask(run.ground.request_data_stream_encode(1, 1, mavlink.MAV_DATA_STREAM_ALL, 0, 0))
    assert run.count(5.0).keys() == {"HEARTBEAT"}


def test_timesync_is_answered_with_the_boot_clock():
    run = Run(load("default")).until(3.0)
    (answer,) = run.ask(run.ground.timesync_encode(0, 12345))
    assert answer.ts1 == 12345
    assert answer.tc1 == pytest.approx(run.track.now.t_s * 1e9, abs=1)


def test_published_estimates_are_heard():
    run = Run(load("default")).until(1.0)
    run.ask(run.ground.named_value_float_encode(1000, b"mils_a2", -3.4))
    assert run.vehicle.values == {"mils_a2": pytest.approx(-3.4)}
    assert run.vehicle.heard == {"NAMED_VALUE_FLOAT": 1}


def test_garbage_from_the_link_is_survived():
    run = Run(load("default")).until(1.0)
    run.wire.inbox = bytes(range(256)) * 4
    run.vehicle.listen(0.0)
    assert run.ask_interval("ATTITUDE", 20_000) or run.ask_interval("ATTITUDE", 20_000)


def test_slow_barometer_repeats_its_sample_under_advancing_stamps():
    scenario = replace(load("default"), mavlink=Mavlink(rates=Rates(pressure=50.0)))
    pressures = [m.press_abs for m in Run(scenario).until(10.0).wire.messages("SCALED_PRESSURE2")]
    assert len(pressures) == 500
    assert len(set(pressures)) == pytest.approx(100, abs=2)
    assert pressures[0:5] == [pressures[0]] * 5 != pressures[5:10]
    fresh = replace(scenario, mavlink=replace(scenario.mavlink, pressure_is_sampled=False))
    assert len({m.press_abs for m in Run(fresh).until(10.0).wire.messages("SCALED_PRESSURE2")}) > 490


def test_lost_samples_are_not_sent_and_nan_is():
    sensors = Sensors(depth=Channel(loss=0.5), pitch=Channel(nan=0.5))
    run = Run(replace(load("default"), sensors=sensors)).until(60.0)
    assert run.vehicle.sent["SCALED_PRESSURE2"] == pytest.approx(300, abs=60)
    pitch = [m.pitch for m in run.wire.messages("ATTITUDE")]
    assert len(pitch) == 600
    assert sum(map(isnan, pitch)) == pytest.approx(300, abs=60)


def test_jittered_messages_stay_in_order_at_any_rate():
    sensors = Sensors(pitch=Channel(jitter_s=0.04))
    run = Run(replace(load("default"), sensors=sensors)).until(5.0)
    run.ask_interval("ATTITUDE", 5_000)
    times = [m.time_boot_ms for m in run.until(10.0).wire.messages("ATTITUDE")]
    assert np.all(np.diff(times) >= 0)
    assert np.std(np.diff(times[:50])) > 10


def test_reboot_is_silent_then_starts_the_clock_again_with_default_rates():
    scenario = replace(load("default"), mavlink=Mavlink(reboot_at_s=5.0, reboot_lasts_s=2.0, boot_text=True))
    run = Run(scenario).until(2.0)
    run.ask_interval("ATTITUDE", 20_000)
    run.until(5.5)
    assert run.ask_interval("ATTITUDE", 20_000) == []  # deaf while it boots
    run.until(12.0)
    times = [m.time_boot_ms for m in run.wire.messages("ATTITUDE")]
    (back,) = np.flatnonzero(np.diff(times) < 0)
    assert times[back] >= 4980
    assert times[back + 1] == 0
    assert times[-1] == 4900
    assert set(np.diff(times[back + 1 :])) == {100}
    assert bytes(run.wire.out).count(b"Simulated vehicle") == 2


def test_chatter_comes_at_its_rates():
    scenario = replace(load("default"), mavlink=Mavlink(statustext_hz=0.5, parameters_hz=20.0))
    sent = Run(scenario).until(10.0).vehicle.sent
    assert (sent["STATUSTEXT"], sent["PARAM_VALUE"]) == (5, 200)


def test_frames_are_determined_by_the_seed():
    scenario = load("rough_sea")
    first, again, other = (bytes(Run(scenario, seed).until(20.0).wire.out) for seed in (1, 1, 2))
    assert first == again != other


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_bytes_from_the_link_never_raise(data):
    """Pure noise, and requests damaged anywhere."""
    run = Run(load("linear_noise_free"))
    request = run.ground.command_long_encode(1, 1, 511, 0, 30, 20_000, 0, 0, 0, 0, 0).pack(run.ground)
    damaged = bytearray(request * 3)
    for at in data.draw(st.lists(st.integers(0, len(damaged) - 1), max_size=4)):
        damaged[at] = data.draw(st.integers(0, 255))
    for piece in (data.draw(st.binary(max_size=300)), bytes(damaged), data.draw(st.binary(max_size=300))):
        run.wire.inbox = piece
        run.vehicle.listen(0.0)


@given(st.floats(width=32), st.floats(width=32), st.integers(0, 65535))
@settings(max_examples=60, deadline=None)
def test_any_request_gets_one_answer(number, interval_us, command):
    run = Run(load("linear_noise_free"))
    answers = run.ask(run.ground.command_long_encode(1, 1, command, 0, number, interval_us, 0, 0, 0, 0, 0))
    assert [answer.get_type() for answer in answers] == ["COMMAND_ACK"]
    answers = run.ask(run.ground.command_long_encode(1, 1, 511, 0, number, interval_us, 0, 0, 0, 0, 0))
    assert [answer.get_type() for answer in answers] == ["COMMAND_ACK"]
    run.until(0.2)
