"""The simulated vehicle as an autopilot on a MAVLink link, encoded by pymavlink."""

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from tools.sitl.plant import stream
from tools.sitl.scenario import Scenario
from tools.sitl.schedule import Timetable
from tools.sitl.sensors import Instrument
from tools.sitl.track import Track
from tools.sitl.transport import Transport

FASTEST_HZ = 200.0  # what ArduPilot allows on one link
_WRAP_US = 2**32
_BOOT_TEXT = b"\r\n\r\nSimulated vehicle, board 9\r\nfree RAM: 65536\r\nsensors ok\r\n"
_PARAMETERS = (
    "SERVO1_FUNCTION",
    "SERVO1_TRIM",
    "SERVO1_REVERSED",
    "BARO_SPEC_GRAV",
    "SERIAL1_BAUD",
    "LOG_BITMASK",
)

_STREAMS = {
    mavlink.MAV_DATA_STREAM_RAW_SENSORS: ("SCALED_PRESSURE2",),
    mavlink.MAV_DATA_STREAM_RC_CHANNELS: ("SERVO_OUTPUT_RAW",),
    mavlink.MAV_DATA_STREAM_POSITION: ("LOCAL_POSITION_NED",),
    mavlink.MAV_DATA_STREAM_EXTRA1: ("ATTITUDE",),
    mavlink.MAV_DATA_STREAM_EXTRA2: ("VFR_HUD",),
}

Note = Callable[[float, str, float], None]


class MavlinkVehicle:
    """Sends each message when it is due and answers what is asked.

    sent    messages sent by name
    heard   messages received by name
    values  the NAMED_VALUE_FLOATs received, by name
    """

    def __init__(
        self, scenario: Scenario, seed: int, track: Track, transport: Transport, note: Note = lambda *_: None
    ) -> None:
        self.settings = scenario.mavlink
        self.track = track
        self.transport = transport
        self.note = note
        self.sent: Counter[str] = Counter()
        self.heard: Counter[str] = Counter()
        self.values: dict[str, float] = {}
        self.rng = stream(seed, "messages")
        self.depth_rate_hz = scenario.sensors.depth.rate_hz
        self.instruments = {
            name: Instrument(getattr(scenario.sensors, name), stream(seed, name))
            for name in ("depth", "pitch", "rudder", "speed", "pitch_rate")
        }
        self.messages: dict[str, Callable[[float], Any]] = {
            "HEARTBEAT": self._heartbeat,
            "ATTITUDE": self._attitude,
            "SCALED_PRESSURE2": self._pressure,
            "SERVO_OUTPUT_RAW": self._servo,
            "VFR_HUD": self._vfr_hud,
            "LOCAL_POSITION_NED": self._local_position,
            "STATUSTEXT": self._statustext,
            "PARAM_VALUE": self._parameter,
        }
        rates = self.settings.rates
        self.default_rates = {
            "HEARTBEAT": 1.0,
            "ATTITUDE": rates.attitude,
            "SCALED_PRESSURE2": rates.pressure,
            "SERVO_OUTPUT_RAW": rates.servo,
            "VFR_HUD": rates.vfr_hud,
            "LOCAL_POSITION_NED": rates.local_position,
            "STATUSTEXT": self.settings.statustext_hz,
            "PARAM_VALUE": self.settings.parameters_hz,
        }
        self.reboot_s = self.settings.reboot_at_s if self.settings.reboot_at_s > 0.0 else math.inf
        self._boot(0.0, self.settings.boot_clock_s)

    def _boot(self, t_s: float, clock_s: float) -> None:
        self.boot_s = t_s
        self.clock_start_s = clock_s
        self.mav = mavlink.MAVLink(None, self.settings.system, self.settings.component)
        self.mav.robust_parsing = True
        self.sampled = -1
        self.depth = math.nan
        jitter_s = {
            name: self.instruments[channel].channel.jitter_s
            for name, channel in (
                ("ATTITUDE", "pitch"),
                ("SCALED_PRESSURE2", "depth"),
                ("SERVO_OUTPUT_RAW", "rudder"),
            )
        }
        self.timetables = {
            name: Timetable(rate, jitter_s.get(name, 0.0), self.rng)
            for name, rate in self.default_rates.items()
        }
        if self.settings.boot_text:
            self.transport.send(_BOOT_TEXT)

    @property
    def next_s(self) -> float:
        """Simulated time of the next thing to do."""
        return min(self.boot_s + min(table.due_s for table in self.timetables.values()), self.reboot_s)

    def emit(self, t_s: float) -> None:
        """Sends all that is due at or before `t_s`, to which the track has been advanced."""
        if t_s >= self.reboot_s:
            self.reboot_s = math.inf
            self._boot(t_s + self.settings.reboot_lasts_s, 0.0)
            return
        for name, table in self.timetables.items():
            while self.boot_s + table.due_s <= t_s + 1e-9:
                message = self.messages[name](self.boot_s + table.due_s)
                table.advance()
                if message is not None:
                    self._send(message)

    def listen(self, timeout_s: float) -> None:
        """Waits for requests at most `timeout_s` and answers them."""
        data = self.transport.receive(timeout_s)
        if not data or self.track.now.t_s < self.boot_s:
            return
        for message in self.mav.parse_buffer(data) or []:
            self.heard[message.get_type()] += 1
            self._answer(message)

    def _send(self, message: Any) -> None:
        self.sent[message.get_type()] += 1
        self.transport.send(message.pack(self.mav))
        self.mav.seq = (self.mav.seq + 1) % 256

    def _answer(self, message: Any) -> None:
        kind = message.get_type()
        if kind == "COMMAND_LONG" and message.target_system in (0, self.settings.system):
            sender = (message.get_srcSystem(), message.get_srcComponent())
            self._send(self.mav.command_ack_encode(message.command, self._obey(message), 0, 0, *sender))
        elif kind == "REQUEST_DATA_STREAM" and message.target_system in (0, self.settings.system):
            for stream_id, names in _STREAMS.items():
                if message.req_stream_id in (mavlink.MAV_DATA_STREAM_ALL, stream_id):
                    for name in names:
                        rate = message.req_message_rate if message.start_stop else 0
                        self._set_rate(name, min(float(rate), FASTEST_HZ))
        elif kind == "TIMESYNC" and message.tc1 == 0:
            now_ns = round(self._clock_s(self.track.now.t_s) * 1e9)
            self._send(self.mav.timesync_encode(now_ns, message.ts1))
        elif kind == "NAMED_VALUE_FLOAT":
            self.values[message.name] = message.value

    def _obey(self, message: Any) -> int:
        """Result of a command; only the interval of a known message can be set, and not below 5 ms."""
        if message.command != mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            return int(mavlink.MAV_RESULT_UNSUPPORTED)
        wanted = mavlink.mavlink_map.get(message.param1)
        interval_us = message.param2
        if wanted is None or wanted.msgname not in self.timetables:
            return int(mavlink.MAV_RESULT_FAILED)
        if not math.isfinite(interval_us) or 0.0 < interval_us < 1e6 / FASTEST_HZ:
            return int(mavlink.MAV_RESULT_DENIED)
        rate = self.default_rates[wanted.msgname] if interval_us == 0.0 else 1e6 / interval_us
        self._set_rate(wanted.msgname, max(rate, 0.0))
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def _set_rate(self, name: str, rate_hz: float) -> None:
        self.timetables[name].set_rate(rate_hz, self.track.now.t_s - self.boot_s)

    def _clock_s(self, t_s: float) -> float:
        return t_s - self.boot_s + self.clock_start_s

    def _clock_ms(self, t_s: float) -> int:
        return round(self._clock_s(t_s) * 1e3) % 2**32

    def _read(self, name: str, t_s: float) -> float:
        instrument = self.instruments[name]
        return instrument.read(self.track.value(name, t_s - instrument.channel.latency_s))

    def _heartbeat(self, t_s: float) -> Any:  # noqa: ARG002
        return self.mav.heartbeat_encode(
            mavlink.MAV_TYPE_SUBMARINE,
            mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
            mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_SAFETY_ARMED,
            19,
            mavlink.MAV_STATE_ACTIVE,
        )

    def _attitude(self, t_s: float) -> Any:
        pitch, rate = self._read("pitch", t_s), self._read("pitch_rate", t_s)
        if self.instruments["pitch"].loses(t_s):
            return None
        self.note(t_s, "pitch", pitch)
        self.note(t_s, "pitch_rate", rate)
        return self.mav.attitude_encode(self._clock_ms(t_s), 0.0, pitch, 0.0, 0.0, rate, 0.0)

    def _sampled_depth(self, t_s: float) -> float:
        """The barometer's last sample: a barometer keeps its own time, whatever the rate of the messages."""
        if not self.settings.pressure_is_sampled:
            return self._read("depth", t_s)
        sample = math.floor((t_s - self.boot_s) * self.depth_rate_hz + 1e-6)
        if sample != self.sampled:
            self.sampled = sample
            self.depth = self._read("depth", self.boot_s + sample / self.depth_rate_hz)
        return self.depth

    def _pressure(self, t_s: float) -> Any:
        depth = self._sampled_depth(t_s)
        if self.instruments["depth"].loses(t_s):
            return None
        self.note(t_s, "depth", depth)
        settings = self.settings
        pascal = settings.surface_pressure_pa + settings.density * settings.gravity * depth
        return self.mav.scaled_pressure2_encode(self._clock_ms(t_s), pascal / 100.0, 0.0, 1500)

    def _servo(self, t_s: float) -> Any:
        rudder = self._read("rudder", t_s)
        if self.instruments["rudder"].loses(t_s):
            return None
        self.note(t_s, "rudder", rudder)
        settings = self.settings
        pulses = [0] * 16
        if math.isfinite(rudder):
            pulse = round(settings.servo_trim_us + settings.servo_us_per_rad * rudder)
            pulses[settings.servo_channel - 1] = min(max(pulse, 800), 2200)
        time_us = round(self._clock_s(t_s) * 1e6) % _WRAP_US
        return self.mav.servo_output_raw_encode(time_us, 0, *pulses)

    def _vfr_hud(self, t_s: float) -> Any:
        speed = self._read("speed", t_s)
        if self.instruments["speed"].loses(t_s):
            return None
        self.note(t_s, "speed", speed)
        return self.mav.vfr_hud_encode(speed, speed, 0, 50, -self._sampled_depth(t_s), 0.0)

    def _local_position(self, t_s: float) -> Any:
        speed, pitch = self.track.value("speed", t_s), self.track.value("pitch", t_s)
        return self.mav.local_position_ned_encode(
            self._clock_ms(t_s),
            0.0,
            0.0,
            self._sampled_depth(t_s),
            speed * math.cos(pitch),
            0.0,
            self.track.value("heave", t_s) * math.cos(pitch) - speed * math.sin(pitch),
        )

    def _statustext(self, t_s: float) -> Any:
        text = f"simulated {t_s:.0f} s".encode()
        return self.mav.statustext_encode(mavlink.MAV_SEVERITY_INFO, text)

    def _parameter(self, t_s: float) -> Any:  # noqa: ARG002
        index = self.sent["PARAM_VALUE"] % len(_PARAMETERS)
        kind = mavlink.MAV_PARAM_TYPE_REAL32
        return self.mav.param_value_encode(_PARAMETERS[index].encode(), 1.0, kind, len(_PARAMETERS), index)
