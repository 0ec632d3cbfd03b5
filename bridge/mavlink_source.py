"""A link that speaks MAVLink: measurements in, estimates, heartbeats and rate requests out."""

from collections import Counter
from collections.abc import Callable, Mapping

from bridge.link import Link, Packet
from bridge.links.udp import monotonic_us
from bridge.mavlink_decoder import MavlinkDecoder
from bridge.mavlink_encoder import MavlinkEncoder
from bridge.mavlink_map import MavlinkMap
from bridge.measurement import Measurement

_HEARTBEAT_US = 1_000_000
_SUPERVISE_US = 10_000_000  # also the shortest time between two requests
_ENOUGH = 0.6  # of the requested rate; a ground station's own request or a download lowers it
# Many links carry only heartbeats before somebody asks; while depth_source auto listens, it hears these.
_DEPTH_CANDIDATES = ("SCALED_PRESSURE2", "SCALED_PRESSURE", "VFR_HUD")


class MavlinkSource:
    """Measurements of one vehicle over any byte link.

    Sends a heartbeat as a companion computer once a second, asks for the message rates of the map once the
    vehicle is known, and every 10 s counts what came and asks again for what came too rarely: a parameter
    download, a ground station or a restart of the vehicle takes a rate away without telling. A denied request
    is counted ("ack.denied") and, once the depth source is known, noted once.
    """

    def __init__(
        self,
        link: Link,
        mapping: MavlinkMap,
        *,
        counts: Counter[str] | None = None,
        clock_us: Callable[[], int] = monotonic_us,
    ) -> None:
        self._link = link
        self._map = mapping
        self._clock_us = clock_us
        self._decoder = MavlinkDecoder(mapping, counts)
        self._encoder: MavlinkEncoder | None = None
        self._heartbeat_us: int | None = None
        self._supervised_us: int | None = None
        self._heard_before: Counter[str] = Counter()
        self._denials_expected = 0
        self._denial_noted = False
        self.counts = self._decoder.counts

    @property
    def notes(self) -> list[str]:
        """What was decided on the user's behalf, one sentence each."""
        return self._decoder.notes

    def read(self, timeout_s: float) -> list[Measurement]:
        self._keep_alive()
        out: list[Measurement] = []
        for packet in self._link.read(min(timeout_s, self._until_heartbeat_s())):
            out += self._decoder.feed(packet.data, packet.t_us)
        self._keep_alive()
        return out

    def publish(self, t_us: int, values: Mapping[str, float]) -> None:
        """One NAMED_VALUE_FLOAT each; the autopilot passes them on and logs them."""
        self._send(self._sender().named_values(t_us, values))

    def warn(self, t_us: int, notice: str, values: Mapping[str, float]) -> None:
        """STATUSTEXT, which a ground station shows and the autopilot logs, and NAMED_VALUE_FLOATs."""
        self._send(self._sender().warning(notice) + self._sender().named_values(t_us, values))

    def close(self) -> None:
        self._link.close()

    def _keep_alive(self) -> None:
        now = self._clock_us()
        if self._heartbeat_us is None or now - self._heartbeat_us >= _HEARTBEAT_US:
            self._heartbeat_us = now
            self._send(self._sender().heartbeat())
        vehicle = self._decoder.vehicle
        if vehicle is not None and (
            self._supervised_us is None or now - self._supervised_us >= _SUPERVISE_US
        ):
            elapsed_us = None if self._supervised_us is None else now - self._supervised_us
            self._supervised_us = now
            self._supervise(vehicle, elapsed_us)
        self._note_denials()

    def _note_denials(self) -> None:
        denied = self.counts["ack.denied"]
        if self._decoder.depth_source is None:
            self._denials_expected = denied  # no vehicle has all the messages that depth may come from
        elif denied > self._denials_expected and not self._denial_noted:
            self._denial_noted = True
            self.notes.append(
                "the vehicle denied a message rate: lower attitude_rate_hz, depth_rate_hz, servo_rate_hz or "
                "speed_rate_hz in [mavlink], or set it to 0 to leave the vehicle's own"
            )

    def _supervise(self, vehicle: tuple[int, int], elapsed_us: int | None) -> None:
        for message, rate_hz in self._wanted_rates().items():
            came = self._decoder.heard[message] - self._heard_before[message]
            self._heard_before[message] = self._decoder.heard[message]
            if elapsed_us is not None and came >= _ENOUGH * rate_hz * elapsed_us * 1e-6:
                continue
            self._send(self._sender().request_rate(vehicle, message, rate_hz))
            self.counts["rate.requested" if elapsed_us is None else "rate.requested_again"] += 1

    def _wanted_rates(self) -> dict[str, float]:
        """Message to Hz; where two quantities share one message, the higher rate."""
        mapping = self._map
        wanted: dict[str, float] = {}

        def want(message: str, rate_hz: float) -> None:
            if rate_hz > 0.0:
                wanted[message] = max(rate_hz, wanted.get(message, 0.0))

        want("ATTITUDE", mapping.attitude_rate_hz)
        source = self._decoder.depth_source
        for message in _DEPTH_CANDIDATES if source is None else (source,):
            want(message, mapping.depth_rate_hz)
        if mapping.rudder:
            want("SERVO_OUTPUT_RAW", mapping.servo_rate_hz)
        if mapping.speed_source != "none":
            want(mapping.speed_source, mapping.speed_rate_hz)
        return wanted

    def _sender(self) -> MavlinkEncoder:
        """Speaks with the vehicle's system id, which may be known only later."""
        vehicle = self._decoder.vehicle
        system = self._map.own_system_id
        if system is None:
            system = vehicle[0] if vehicle is not None else 1
        if self._encoder is None or self._encoder.system != system:
            self._encoder = MavlinkEncoder(self._map, system=system, component=self._map.own_component_id)
        return self._encoder

    def _send(self, data: bytes) -> None:
        self._link.write(Packet(t_us=self._clock_us(), data=data))

    def _until_heartbeat_s(self) -> float:
        assert self._heartbeat_us is not None
        return max(0.0, (self._heartbeat_us + _HEARTBEAT_US - self._clock_us()) * 1e-6)
