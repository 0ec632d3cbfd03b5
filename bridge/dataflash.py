"""The vehicle's own logs (.BIN): attitude, barometers, outputs and filter, read by the MAVLink map."""

from collections import Counter
from math import hypot, radians
from pathlib import Path
from typing import Any

from bridge.dataflash_records import HEAD, walk_dataflash
from bridge.depth_channel import DepthChannel
from bridge.errors import LogFormatError
from bridge.mavlink_decoder import forward_speed
from bridge.mavlink_map import MavlinkMap
from bridge.measurement import Measurement, Quantity
from bridge.measurement_gate import MeasurementGate
from bridge.servo_mix import ServoMix
from bridge.vehicle_clock import VehicleClock

# The record that holds what a MAVLink depth source says; barometers by instance.
_BAROMETERS = ("SCALED_PRESSURE", "SCALED_PRESSURE2", "SCALED_PRESSURE3")
_HEIGHTS = {
    "XKF1": ("LOCAL_POSITION_NED", "PD", -1.0),
    "CTUN": ("VFR_HUD", "Alt", 1.0),
    "AHR2": ("AHRS2", "Alt", 1.0),
}
_OUTPUTS = {"RCOU", "RCO2", "RCO3"}
_OLD_BAROMETERS = {"BARO": 0, "BAR2": 1, "BAR3": 2}  # before 4.1 each instance had its own name
_WANTED = {"ATT", "RATE", "CSRV", *_OLD_BAROMETERS, *_HEIGHTS, *_OUTPUTS}
_OLDEST_SAMPLE_US = 1_000_000
_NO_RECEIVE_CLOCK = 0  # a log of the vehicle itself: only the stamps can confirm each other


def read_dataflash(path: Path, mapping: MavlinkMap) -> tuple[list[Measurement], Counter[str], list[str]]:
    """All measurements of a dataflash log, counts by record name and refusal, and notes.

    Depth sources mean the records that hold the same: SCALED_PRESSURE, 2, 3 are BARO instances 0, 1, 2;
    LOCAL_POSITION_NED is XKF1 of core 0, VFR_HUD is CTUN, AHRS2 is AHR2. LogFormatError when the file is no
    dataflash log.
    """
    data = path.read_bytes()
    if not data.startswith(HEAD):
        raise LogFormatError(f"{path.name}: no dataflash log (a .BIN of ArduPilot begins with A3 95 hex)")
    reader = _Reader(mapping)
    for name, fields in walk_dataflash(data, _WANTED, reader.counts):
        try:
            reader.take(name, fields)
        except (KeyError, TypeError):  # a column that this version of the firmware does not write
            reader.counts["refused.column"] += 1
    if not any(reader.counts[name] for name in _WANTED):
        raise LogFormatError(f"{path.name}: a dataflash log without attitude, pressure or outputs")
    return reader.out, reader.counts, reader.notes


class _Reader:
    def __init__(self, mapping: MavlinkMap) -> None:
        self.counts: Counter[str] = Counter()
        self.notes: list[str] = []
        self.out: list[Measurement] = []
        self._map = mapping
        self._clock = VehicleClock()
        self._depth = DepthChannel(mapping, self.counts, self.notes)
        self._servo = ServoMix(mapping.rudder, self.counts)
        self._gate = MeasurementGate(self.counts)
        self._attitude: tuple[float, float] | None = None

    def take(self, name: str, fields: dict[str, Any]) -> None:
        stamp = fields["TimeUS"]
        # ArduSub 4.7-dev writes RATE with the stamp 0.
        t_us = self._clock.from_boot(stamp, _NO_RECEIVE_CLOCK) if stamp else None
        if t_us is None:
            self.counts["refused.time_step"] += 1
        elif name == "ATT":
            self._on_attitude(fields, t_us)
        elif name == "RATE":
            if self._map.pitch_rate:
                rate = self._map.pitch_sign * radians(fields["P"])
                self._admit(Quantity.PITCH_RATE, rate, t_us, name)
        elif name in _OLD_BAROMETERS:
            self._on_barometer(fields, t_us, fields.get("I", _OLD_BAROMETERS[name]))
        elif name in _OUTPUTS:
            self._on_outputs(fields, t_us, name)
        elif name == "CSRV":
            self._on_reported_servo(fields, t_us)
        elif fields.get("C", 0) == 0:
            self._on_filter(fields, t_us, name)

    def _admit(self, quantity: Quantity, value: float, t_us: int, source: str) -> None:
        self._gate.admit(self.out, quantity, value, t_us, source, self._clock.boot)

    def _on_attitude(self, fields: dict[str, Any], t_us: int) -> None:
        pitch = self._map.pitch_sign * radians(fields["Pitch"])
        self._attitude = pitch, radians(fields["Yaw"])
        self._admit(Quantity.PITCH, pitch, t_us, "ATT")

    def _on_barometer(self, fields: dict[str, Any], t_us: int, instance: int) -> None:
        if not 0 <= instance < len(_BAROMETERS):
            return
        source = _BAROMETERS[instance]
        if self._depth.source not in (None, source):
            return
        if fields.get("H", fields.get("Health", 1)) == 0:
            self.counts["refused.unhealthy"] += 1
            return
        age_us = fields["TimeUS"] - 1000 * fields["SMS"] if "SMS" in fields else 0
        sampled_us = t_us - age_us if 0 <= age_us < _OLDEST_SAMPLE_US else t_us
        depth = self._depth.from_pressure(source, 0.01 * fields["Press"], sampled_us, self._clock.boot)
        if depth is not None:
            self._admit(Quantity.DEPTH, depth, sampled_us, f"BARO[{instance}]")

    def _on_outputs(self, fields: dict[str, Any], t_us: int, name: str) -> None:
        if not self._map.rudder or self._map.csrv_id is not None:
            return
        pulses = {int(column[1:]): float(pulse) for column, pulse in fields.items() if column != "TimeUS"}
        if (rudder := self._servo.rudder(pulses)) is not None:
            self._admit(Quantity.RUDDER, rudder, t_us, name)

    def _on_reported_servo(self, fields: dict[str, Any], t_us: int) -> None:
        if fields["Id"] == self._map.csrv_id:
            self._admit(Quantity.RUDDER, self._map.csrv_sign * fields["Pos"], t_us, "CSRV")

    def _on_filter(self, fields: dict[str, Any], t_us: int, name: str) -> None:
        source, column, up = _HEIGHTS[name]
        if self._depth.source in (None, source):
            depth = self._depth.from_height(source, up * fields[column], t_us, self._clock.boot)
            if depth is not None:
                self._admit(Quantity.DEPTH, depth, t_us, name)
        if name == "XKF1" and self._map.speed_source != "none":
            self._on_velocity((fields["VN"], fields["VE"], fields["VD"]), t_us)

    def _on_velocity(self, ned: tuple[float, float, float], t_us: int) -> None:
        if self._map.speed_source == "VFR_HUD":
            self._admit(Quantity.SPEED, hypot(ned[0], ned[1]), t_us, "XKF1")
        elif self._attitude is None:
            self.counts["refused.no_attitude"] += 1
        else:
            self._admit(Quantity.SPEED, forward_speed(ned, *self._attitude), t_us, "XKF1")
