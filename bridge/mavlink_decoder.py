"""MAVLink bytes to measurements, without I/O and without ever raising."""

from collections import Counter
from collections.abc import Callable, Sequence
from math import cos, sin

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.depth_channel import PREFERENCE, DepthChannel
from bridge.mavlink_frames import Frame, Framer, field_reader
from bridge.mavlink_map import MavlinkMap
from bridge.measurement import Measurement, Quantity
from bridge.measurement_gate import MeasurementGate
from bridge.servo_mix import ServoMix
from bridge.vehicle_clock import VehicleClock

_HEARTBEAT = field_reader("HEARTBEAT", "type", "autopilot")
_ATTITUDE = field_reader("ATTITUDE", "time_boot_ms", "pitch", "yaw", "pitchspeed")
_PRESSURE = {
    name: field_reader(name, "time_boot_ms", "press_abs") for name in PREFERENCE if "PRESSURE" in name
}
_POSITION = field_reader("LOCAL_POSITION_NED", "time_boot_ms", "z", "vx", "vy", "vz")
_VFR_HUD = field_reader("VFR_HUD", "alt", "groundspeed")
_AHRS2 = field_reader("AHRS2", "altitude", "roll")
_SERVO = field_reader(
    "SERVO_OUTPUT_RAW", "time_usec", "port", *(f"servo{channel}_raw" for channel in range(1, 17))
)
_ACK = field_reader("COMMAND_ACK", "command", "result")
_ATTITUDE_AGE_US = 1_000_000  # an older attitude does not turn a velocity into the body's axes
_NOT_VEHICLES = {dialect.MAV_TYPE_GCS, dialect.MAV_TYPE_ONBOARD_CONTROLLER, dialect.MAV_TYPE_GIMBAL}


class MavlinkDecoder:
    """`feed(bytes, receive time) -> list[Measurement]` for one vehicle; the rest is counted and ignored.

    counts   each intact frame by message name, whoever sent it; refusals as "refused.<cause>"; "lost" by gaps
             of the vehicle's sequence numbers; "ack.accepted", "ack.denied" of rate requests; "note.<what>"
    heard    intact frames of the vehicle by message name
    notes    what was decided on the user's behalf, one sentence each
    vehicle  (system, component) locked onto, or None as long as no autopilot was heard
    """

    def __init__(self, mapping: MavlinkMap, counts: Counter[str] | None = None) -> None:
        self.counts: Counter[str] = Counter() if counts is None else counts
        self.heard: Counter[str] = Counter()
        self.notes: list[str] = []
        self.vehicle: tuple[int, int] | None = None
        if mapping.system_id is not None and mapping.component_id is not None:
            self.vehicle = mapping.system_id, mapping.component_id
        self._map = mapping
        self._framer = Framer(self.counts)
        self._clock = VehicleClock()
        self._depth = DepthChannel(mapping, self.counts, self.notes)
        self._servo = ServoMix(mapping.rudder, self.counts)
        self._gate = MeasurementGate(self.counts)
        self._attitude: tuple[int, float, float] | None = None  # time, pitch, yaw
        self._others: set[int] = set()  # systems with an autopilot that is not the vehicle
        self._latest: Frame | None = None
        self._handlers: dict[str, Callable[[bytes, int, list[Measurement]], None]] = {
            "ATTITUDE": self._on_attitude,
            "LOCAL_POSITION_NED": self._on_position,
            "VFR_HUD": self._on_vfr_hud,
            "AHRS2": self._on_ahrs2,
            "SERVO_OUTPUT_RAW": self._on_servo,
            "COMMAND_ACK": self._on_ack,
        }
        for name in _PRESSURE:
            self._handlers[name] = self._pressure_handler(name)

    @property
    def boot(self) -> int:
        return self._clock.boot

    @property
    def depth_source(self) -> str | None:
        """The message that depth comes from; None while `auto` has not decided."""
        return self._depth.source

    def feed(self, data: bytes, t_us: int) -> list[Measurement]:
        """Measurements in `data`, received at `t_us` (any clock that runs on)."""
        out: list[Measurement] = []
        for frame in self._framer.feed(data):
            self._take(frame, t_us, out)
        return out

    def take(self, frame: Frame, t_us: int) -> list[Measurement]:
        """The same for a frame that is known to be intact."""
        out: list[Measurement] = []
        self._take(frame, t_us, out)
        return out

    def _take(self, frame: Frame, t_us: int, out: list[Measurement]) -> None:
        name = frame.kind.name
        self.counts[name] += 1
        if frame.signed:
            self.counts["note.signed"] += 1
        if self.vehicle is None and not self.knows_vehicle(frame):
            self.counts["refused.no_vehicle_yet"] += 1
            return
        if (frame.system, frame.component) != self.vehicle:
            self.counts["refused.other_sender"] += 1
            if frame.kind.name == "HEARTBEAT":
                self._note_other_vehicle(frame)
            return
        if not self._is_new(frame):
            self.counts["refused.duplicate"] += 1
            return
        self.heard[name] += 1
        handler = self._handlers.get(name)
        if handler is not None:
            handler(frame.payload, t_us, out)

    def knows_vehicle(self, frame: Frame) -> bool:
        """Whether the vehicle is known, at the latest by this frame."""
        wanted = self._map
        if (
            self.vehicle is None
            and _is_autopilot(frame)
            and wanted.system_id in (None, frame.system)
            and wanted.component_id in (None, frame.component)
        ):
            self.vehicle = frame.system, frame.component
            self.notes.append(f"locked to system {frame.system}, component {frame.component}")
        return self.vehicle is not None

    def _note_other_vehicle(self, frame: Frame) -> None:
        if frame.system not in self._others and self._map.system_id is None and _is_autopilot(frame):
            self._others.add(frame.system)
            self.notes.append(
                f"system {frame.system} is an autopilot on this link too and is ignored: "
                "[mavlink] system_id says which one to use"
            )

    def _is_new(self, frame: Frame) -> bool:
        """False for a frame that came twice; counts the ones missing since the last."""
        latest = self._latest
        if latest is not None:
            step = (frame.sequence - latest.sequence) & 0xFF
            if step == 0 and frame == latest:
                return False
            if not 0 < step < 128:
                return True  # late, or a sender that does not count
            if step > 1:
                self.counts["lost"] += step - 1
        self._latest = frame
        return True

    def _stamp(self, boot_ms: int, receive_us: int) -> int | None:
        t_us = self._clock.from_boot(1000 * boot_ms, receive_us)
        if t_us is None:
            self.counts["refused.time_step"] += 1
        return t_us

    def _on_attitude(self, payload: bytes, receive_us: int, out: list[Measurement]) -> None:
        boot_ms, pitch, yaw, rate = _ATTITUDE(payload)
        if (t_us := self._stamp(boot_ms, receive_us)) is None:
            return
        sign = self._map.pitch_sign
        self._attitude = t_us, sign * pitch, yaw
        self._gate.admit(out, Quantity.PITCH, sign * pitch, t_us, "ATTITUDE", self.boot)
        if self._map.pitch_rate:
            self._gate.admit(out, Quantity.PITCH_RATE, sign * rate, t_us, "ATTITUDE", self.boot)

    def _pressure_handler(self, name: str) -> Callable[[bytes, int, list[Measurement]], None]:
        read = _PRESSURE[name]

        def on_pressure(payload: bytes, receive_us: int, out: list[Measurement]) -> None:
            boot_ms, hpa = read(payload)
            t_us = self._stamp(boot_ms, receive_us)
            if t_us is not None and self._depth.source in (None, name):
                depth = self._depth.from_pressure(name, hpa, t_us, self.boot)
                self._admit_depth(out, depth, t_us, name)

        return on_pressure

    def _on_position(self, payload: bytes, receive_us: int, out: list[Measurement]) -> None:
        boot_ms, down, *velocity = _POSITION(payload)
        if (t_us := self._stamp(boot_ms, receive_us)) is None:
            return
        name = "LOCAL_POSITION_NED"
        if self._depth.source in (None, name):
            self._admit_depth(out, self._depth.from_height(name, -down, t_us, self.boot), t_us, name)
        if self._map.speed_source == name:
            if self._attitude is None or abs(t_us - self._attitude[0]) > _ATTITUDE_AGE_US:
                self.counts["refused.no_attitude"] += 1
                return
            speed = forward_speed(velocity, *self._attitude[1:])
            self._gate.admit(out, Quantity.SPEED, speed, t_us, name, self.boot)

    def _on_vfr_hud(self, payload: bytes, receive_us: int, out: list[Measurement]) -> None:
        up, speed = _VFR_HUD(payload)
        self._on_height("VFR_HUD", up, receive_us, out)
        if self._map.speed_source == "VFR_HUD" and (t_us := self._unstamped(receive_us)) is not None:
            self._gate.admit(out, Quantity.SPEED, speed, t_us, "VFR_HUD", self.boot)

    def _on_ahrs2(self, payload: bytes, receive_us: int, out: list[Measurement]) -> None:
        self._on_height("AHRS2", _AHRS2(payload)[0], receive_us, out)

    def _on_height(self, name: str, up: float, receive_us: int, out: list[Measurement]) -> None:
        if self._depth.source in (None, name) and (t_us := self._unstamped(receive_us)) is not None:
            self._admit_depth(out, self._depth.from_height(name, up, t_us, self.boot), t_us, name)

    def _unstamped(self, receive_us: int) -> int | None:
        t_us = self._clock.from_receive(receive_us)
        if t_us is None:
            self.counts["refused.no_clock"] += 1
        return t_us

    def _admit_depth(self, out: list[Measurement], depth: float | None, t_us: int, name: str) -> None:
        if depth is not None:
            self._gate.admit(out, Quantity.DEPTH, depth, t_us, name, self.boot)

    def _on_servo(self, payload: bytes, receive_us: int, out: list[Measurement]) -> None:  # noqa: ARG002
        if not self._map.rudder:
            return
        time_usec, port, *pulses = _SERVO(payload)
        first = 1 + 16 * port
        rudder = self._servo.rudder(dict(enumerate(pulses, first)))
        if rudder is None:
            return
        if (t_us := self._clock.from_wrapped_us(time_usec)) is None:
            self.counts["refused.no_clock"] += 1
            return
        self._gate.admit(out, Quantity.RUDDER, rudder, t_us, "SERVO_OUTPUT_RAW", self.boot)

    def _on_ack(self, payload: bytes, receive_us: int, out: list[Measurement]) -> None:  # noqa: ARG002
        command, result = _ACK(payload)
        if command == dialect.MAV_CMD_SET_MESSAGE_INTERVAL:
            accepted = result in (dialect.MAV_RESULT_ACCEPTED, dialect.MAV_RESULT_IN_PROGRESS)
            self.counts["ack.accepted" if accepted else "ack.denied"] += 1


def _is_autopilot(frame: Frame) -> bool:
    if frame.kind.name != "HEARTBEAT":
        return False
    vehicle_type, autopilot = _HEARTBEAT(frame.payload)
    return autopilot != dialect.MAV_AUTOPILOT_INVALID and vehicle_type not in _NOT_VEHICLES


def forward_speed(ned: Sequence[float], pitch: float, yaw: float) -> float:
    """Velocity (north, east, down) along the body: (vn cos psi + ve sin psi) cos theta - vd sin theta."""
    north, east, down = ned
    return (north * cos(yaw) + east * sin(yaw)) * cos(pitch) - down * sin(pitch)
