"""Measurements, estimates and requests to MAVLink 2 frames: the inverse of the decoder for the same map."""

from collections.abc import Iterable, Mapping
from math import copysign, cos, inf, nan, sin

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.depth_channel import STANDARD_SURFACE_HPA
from bridge.mavlink_frames import ID_OF
from bridge.mavlink_map import MavlinkMap
from bridge.measurement import Measurement, Quantity
from bridge.servo_mix import pulses_for

_UINT32 = 0xFFFFFFFF
_FLOAT_MAX = 3.4e38  # single precision
MAX_NAME = 10  # characters of NAMED_VALUE_FLOAT
MAX_TEXT = 50  # characters of STATUSTEXT


class MavlinkEncoder:
    """Encodes as one sender (system, component), counting its own sequence numbers."""

    def __init__(self, mapping: MavlinkMap, *, system: int, component: int) -> None:
        self.system = system
        self._map = mapping
        self._mav = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
        self._pitch = 0.0

    def measurements(self, batch: Iterable[Measurement]) -> bytes:
        """Frames as the mapped vehicle would send them, heading north; what is not in `batch` is NaN or 0.

        Values of one time stamp that share a message (pitch and pitch rate) go into one frame.
        """
        at: dict[int, dict[Quantity, float]] = {}
        for item in batch:
            at.setdefault(item.t_us, {})[item.quantity] = item.value
        return b"".join(self._instant(t_us, values) for t_us, values in at.items())

    def _instant(self, t_us: int, values: Mapping[Quantity, float]) -> bytes:
        boot_ms = (t_us // 1000) & _UINT32
        depth, speed = values.get(Quantity.DEPTH, nan), values.get(Quantity.SPEED, nan)
        has_depth, has_speed = Quantity.DEPTH in values, Quantity.SPEED in values
        source = self._map.depth_source if self._map.depth_source != "auto" else "SCALED_PRESSURE2"
        frames = []
        if Quantity.PITCH in values or Quantity.PITCH_RATE in values:
            self._pitch = values.get(Quantity.PITCH, self._pitch)
            sign = self._map.pitch_sign
            pitch, rate = values.get(Quantity.PITCH, nan), values.get(Quantity.PITCH_RATE, nan)
            frames.append(
                dialect.MAVLink_attitude_message(boot_ms, 0.0, sign * pitch, 0.0, 0.0, sign * rate, 0.0)
            )
        if has_depth and source.startswith("SCALED_PRESSURE"):
            frames.append(_PRESSURES[source](boot_ms, self._pressure_hpa(depth), 0.0, 0))
        if has_depth and source == "AHRS2":
            frames.append(dialect.MAVLink_ahrs2_message(0.0, self._pitch, 0.0, -depth, 0, 0))
        if (has_depth and source == "VFR_HUD") or (has_speed and self._map.speed_source == "VFR_HUD"):
            frames.append(dialect.MAVLink_vfr_hud_message(nan, speed, 0, 0, -depth, nan))
        position = "LOCAL_POSITION_NED"
        if (has_depth and source == position) or (has_speed and self._map.speed_source == position):
            north, down = speed * cos(self._pitch), -speed * sin(self._pitch)
            frames.append(
                dialect.MAVLink_local_position_ned_message(boot_ms, nan, nan, depth, north, 0.0, down)
            )
        packed = b"".join(self._pack(frame) for frame in frames)
        if Quantity.RUDDER in values:
            packed += self._servo(t_us, values[Quantity.RUDDER])
        return packed

    def _pressure_hpa(self, depth: float) -> float:
        surface = self._map.surface_pressure_hpa
        surface = STANDARD_SURFACE_HPA if surface is None else surface
        return surface + 0.01 * depth * self._map.water_density * self._map.gravity

    def _servo(self, t_us: int, rudder: float) -> bytes:
        pulses = pulses_for(rudder, self._map.rudder)
        packed = b""
        for port in sorted({(channel - 1) // 16 for channel in pulses}, reverse=True):
            raw = [pulses.get(channel, 0) for channel in range(16 * port + 1, 16 * port + 17)]
            stamp = t_us & _UINT32
            packed += self._pack(dialect.MAVLink_servo_output_raw_message(stamp, port, *raw[:8], *raw[8:]))
        return packed

    def heartbeat(self) -> bytes:
        """HEARTBEAT of a companion computer."""
        return self._heartbeat(dialect.MAV_TYPE_ONBOARD_CONTROLLER, dialect.MAV_AUTOPILOT_INVALID)

    def vehicle_heartbeat(self) -> bytes:
        """HEARTBEAT of a submarine's autopilot, for a log that is replayed as the vehicle."""
        return self._heartbeat(dialect.MAV_TYPE_SUBMARINE, dialect.MAV_AUTOPILOT_GENERIC)

    def _heartbeat(self, kind: int, autopilot: int) -> bytes:
        return self._pack(
            dialect.MAVLink_heartbeat_message(kind, autopilot, 0, 0, dialect.MAV_STATE_ACTIVE, 3)
        )

    def named_values(self, t_us: int, values: Mapping[str, float]) -> bytes:
        """One NAMED_VALUE_FLOAT each; ValueError on a name that the message cannot hold."""
        packed = b""
        for name, value in values.items():
            raw = name.encode("ascii", errors="replace")
            if not 1 <= len(raw) <= MAX_NAME:
                raise ValueError(f"name must have 1..{MAX_NAME} characters (got {name!r})")
            boot_ms = (t_us // 1000) & _UINT32
            single = value if abs(value) <= _FLOAT_MAX else copysign(inf, value)
            packed += self._pack(dialect.MAVLink_named_value_float_message(boot_ms, raw, single))
        return packed

    def warning(self, text: str) -> bytes:
        """STATUSTEXT; ValueError on a text that one message cannot hold."""
        raw = text.encode("ascii", errors="replace")
        if not 1 <= len(raw) <= MAX_TEXT:
            raise ValueError(f"text must have 1..{MAX_TEXT} characters (got {text!r})")
        return self._pack(dialect.MAVLink_statustext_message(dialect.MAV_SEVERITY_WARNING, raw, 0, 0))

    def request_rate(self, target: tuple[int, int], message: str, rate_hz: float) -> bytes:
        """SET_MESSAGE_INTERVAL: asks `target` (system, component) for `message` at `rate_hz`."""
        command = dialect.MAV_CMD_SET_MESSAGE_INTERVAL
        parameters = (float(ID_OF[message]), 1e6 / rate_hz, 0.0, 0.0, 0.0, 0.0, 0.0)
        return self._pack(dialect.MAVLink_command_long_message(*target, command, 0, *parameters))

    def _pack(self, message: dialect.MAVLink_message) -> bytes:
        packed = bytes(message.pack(self._mav))
        self._mav.seq = (self._mav.seq + 1) % 256
        return packed


_PRESSURES = {
    "SCALED_PRESSURE": dialect.MAVLink_scaled_pressure_message,
    "SCALED_PRESSURE2": dialect.MAVLink_scaled_pressure2_message,
    "SCALED_PRESSURE3": dialect.MAVLink_scaled_pressure3_message,
}
