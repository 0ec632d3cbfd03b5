"""Frames made with the vendor's library alone, so that our encoder cannot hide our decoder's errors."""

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.measurement import Measurement, Quantity


class Vehicle:
    """An autopilot that sends what a test tells it to."""

    def __init__(self, system: int = 1, component: int = 1, *, mavlink1: bool = False) -> None:
        self._mav = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
        self._mavlink1 = mavlink1

    def pack(self, message: dialect.MAVLink_message) -> bytes:
        raw = bytes(message.pack(self._mav, force_mavlink1=self._mavlink1))
        self._mav.seq = (self._mav.seq + 1) % 256
        return raw

    def heartbeat(self, kind: int = dialect.MAV_TYPE_SUBMARINE, autopilot: int = 3) -> bytes:
        return self.pack(dialect.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 0, 3))

    def attitude(self, boot_ms: int, pitch: float = 0.1, rate: float = 0.01, yaw: float = 0.0) -> bytes:
        return self.pack(dialect.MAVLink_attitude_message(boot_ms, 0.0, pitch, yaw, 0.0, rate, 0.0))

    def pressure(self, boot_ms: int, hpa: float, instance: int = 2) -> bytes:
        kinds = {
            1: dialect.MAVLink_scaled_pressure_message,
            2: dialect.MAVLink_scaled_pressure2_message,
            3: dialect.MAVLink_scaled_pressure3_message,
        }
        return self.pack(kinds[instance](boot_ms, hpa, 0.0, 1500))

    def servo(self, time_usec: int, pulses: dict[int, int], port: int = 0) -> bytes:
        raw = [pulses.get(channel, 0) for channel in range(16 * port + 1, 16 * port + 17)]
        return self.pack(dialect.MAVLink_servo_output_raw_message(time_usec, port, *raw[:8], *raw[8:]))

    def vfr_hud(self, up: float, speed: float = 0.0) -> bytes:
        return self.pack(dialect.MAVLink_vfr_hud_message(0.0, speed, 0, 0, up, 0.0))

    def ahrs2(self, up: float) -> bytes:
        return self.pack(dialect.MAVLink_ahrs2_message(0.0, 0.0, 0.0, up, 0, 0))

    def position(self, boot_ms: int, down: float, velocity: tuple[float, float, float] = (0, 0, 0)) -> bytes:
        return self.pack(dialect.MAVLink_local_position_ned_message(boot_ms, 0.0, 0.0, down, *velocity))

    def ack(self, result: int) -> bytes:
        return self.pack(dialect.MAVLink_command_ack_message(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, result))


def of(measurements: list[Measurement], quantity: Quantity) -> list[Measurement]:
    return [item for item in measurements if item.quantity is quantity]
