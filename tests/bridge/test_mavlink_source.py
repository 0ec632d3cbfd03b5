"""The source over a link in memory: heartbeat, rate requests, supervision, publishing."""

from pymavlink.dialects.v20 import ardupilotmega as dialect
from vehicle_frames import Vehicle

from bridge.link import Packet
from bridge.mavlink_map import MavlinkMap, ServoTerm
from bridge.mavlink_source import MavlinkSource
from bridge.source import Source


class MemoryLink:
    """Gives what a test puts in and keeps what is sent; reading takes the time it is given."""

    def __init__(self) -> None:
        self.now_us = 0
        self.incoming: list[bytes] = []
        self.sent: list[dialect.MAVLink_message] = []
        self._parser = dialect.MAVLink(None)

    def read(self, timeout_s: float) -> list[Packet]:
        if not self.incoming:
            self.now_us += round(timeout_s * 1e6)
        packets = [Packet(t_us=self.now_us, data=data) for data in self.incoming]
        self.incoming.clear()
        return packets

    def write(self, packet: Packet) -> None:
        self.sent += self._parser.parse_buffer(packet.data) or []

    def close(self) -> None:
        self.incoming.clear()

    def of(self, kind: str) -> list[dialect.MAVLink_message]:
        return [message for message in self.sent if message.get_type() == kind]


def start(**settings: object) -> tuple[MavlinkSource, MemoryLink, Vehicle]:
    link = MemoryLink()
    mapping = MavlinkMap(**{"depth_source": "SCALED_PRESSURE2", **settings})  # type: ignore[arg-type]
    source: Source = MavlinkSource(link, mapping, clock_us=lambda: link.now_us)
    assert isinstance(source, MavlinkSource)
    return source, link, Vehicle(system=7)


def run(
    source: MavlinkSource, link: MemoryLink, vehicle: Vehicle, seconds: float, attitude_hz: float
) -> None:
    """The vehicle sends ATTITUDE at a rate and everything else fast enough."""
    step_us = 10_000
    for k in range(round(seconds * 1e6 / step_us)):
        ms = link.now_us // 1000
        if k % round(100 / attitude_hz) == 0:
            link.incoming.append(vehicle.attitude(ms))
        link.incoming.append(vehicle.pressure(ms, 1100.0 + 0.01 * k))
        link.now_us += step_us
        source.read(0.0)


def test_heartbeat_goes_out_once_a_second_even_while_nothing_comes() -> None:
    source, link, _ = start()
    while link.now_us < 10_000_000:
        source.read(5.0)
    assert len(link.of("HEARTBEAT")) == 11
    assert (link.sent[0].type, link.sent[0].autopilot, link.sent[0].get_srcComponent()) == (18, 8, 191)


def test_rates_are_requested_once_the_vehicle_is_known_with_its_system_id() -> None:
    source, link, vehicle = start(rudder=(ServoTerm(channel=1, rad_per_us=1e-3),), speed_source="VFR_HUD")
    source.read(0.1)
    assert not link.of("COMMAND_LONG")
    link.incoming.append(vehicle.heartbeat())
    source.read(0.1)
    requests = {message.param1: message for message in link.of("COMMAND_LONG")}
    assert set(requests) == {30.0, 137.0, 36.0, 74.0}
    assert {message.get_srcSystem() for message in requests.values()} == {7}
    assert {message.target_system for message in requests.values()} == {7}


def test_auto_depth_asks_for_what_it_would_choose_from() -> None:
    source, link, vehicle = start(depth_source="auto", attitude_rate_hz=0.0)
    link.incoming.append(vehicle.heartbeat())
    source.read(0.1)
    assert {message.param1 for message in link.of("COMMAND_LONG")} == {29.0, 137.0, 74.0}


def test_rate_zero_requests_nothing() -> None:
    source, link, vehicle = start(attitude_rate_hz=0.0, depth_rate_hz=0.0)
    link.incoming.append(vehicle.heartbeat())
    source.read(0.1)
    assert not link.of("COMMAND_LONG")


def test_message_that_comes_too_rarely_is_asked_for_again_every_10_s_at_most() -> None:
    source, link, vehicle = start(attitude_rate_hz=20.0, depth_rate_hz=10.0)
    link.incoming.append(vehicle.heartbeat())
    run(source, link, vehicle, 35.0, attitude_hz=10)  # half of what was asked
    again = [message.param1 for message in link.of("COMMAND_LONG")][2:]
    assert again == [30.0, 30.0, 30.0]
    assert source.counts["rate.requested_again"] == 3


def test_message_that_comes_as_asked_is_left_alone() -> None:
    source, link, vehicle = start(attitude_rate_hz=20.0, depth_rate_hz=10.0)
    link.incoming.append(vehicle.heartbeat())
    run(source, link, vehicle, 25.0, attitude_hz=20)
    assert len(link.of("COMMAND_LONG")) == 2
    assert source.counts["rate.requested_again"] == 0


def test_denied_request_is_counted_and_noted_once() -> None:
    source, link, vehicle = start()
    link.incoming += [vehicle.heartbeat(), vehicle.ack(dialect.MAV_RESULT_DENIED)]
    source.read(0.1)
    link.incoming.append(vehicle.ack(dialect.MAV_RESULT_DENIED))
    source.read(0.1)
    assert source.counts["ack.denied"] == 2
    assert len([note for note in source.notes if "denied" in note]) == 1
    assert "attitude_rate_hz" in source.notes[-1]


def test_denials_while_depth_sources_are_tried_are_not_noted() -> None:
    source, link, vehicle = start(depth_source="auto")
    link.incoming += [vehicle.heartbeat(), vehicle.ack(dialect.MAV_RESULT_DENIED)]
    source.read(0.1)
    link.incoming += [vehicle.pressure(ms, 1100.0) for ms in range(1000, 5000, 500)]
    source.read(0.1)
    source.read(0.1)
    assert source.counts["ack.denied"] == 1
    assert not [note for note in source.notes if "denied" in note]
    link.incoming.append(vehicle.ack(dialect.MAV_RESULT_DENIED))
    source.read(0.1)
    assert len([note for note in source.notes if "denied" in note]) == 1


def test_estimates_go_out_by_name() -> None:
    source, link, _ = start()
    source.publish(2_000_000, {"a1": -0.63, "u0": 2.5})
    assert [(m.name, round(m.value, 3)) for m in link.of("NAMED_VALUE_FLOAT")] == [("a1", -0.63), ("u0", 2.5)]


def test_own_system_id_of_the_map_is_used() -> None:
    source, link, vehicle = start(own_system_id=42, own_component_id=193)
    link.incoming.append(vehicle.heartbeat())
    source.read(0.1)
    assert {(m.get_srcSystem(), m.get_srcComponent()) for m in link.sent} == {(42, 193)}
