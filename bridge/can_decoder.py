"""CAN frames to measurements, by the vehicle's map."""

from collections import Counter
from collections.abc import Iterable
from math import isfinite
from pathlib import Path

from bridge.can_dbc import DbcDialect
from bridge.can_dialect import CanDialect, CanMessage
from bridge.can_map import CanMap, CanSignal
from bridge.dronecan import DroneCan
from bridge.link import Packet
from bridge.measurement import Measurement
from bridge.measurement_gate import MeasurementGate
from bridge.nmea2000 import Nmea2000
from bridge.vehicle_clock import VehicleClock

# A sender that was silent for this long has left; its signal goes to whoever speaks next.
SILENCE_US = 2_000_000
LOWEST_PRESSURE = 30e3  # Pa; a sensor that has failed says 0


def dialect_of(can_map: CanMap, counts: Counter[str]) -> CanDialect:
    """The dialect of the map's kind; raises BridgeError when the map names what the dialect does not have."""
    if can_map.kind == "nmea2000":
        return Nmea2000(can_map.table(), counts)
    if can_map.kind == "dronecan":
        return DroneCan(can_map.table(), counts)
    return DbcDialect(None if can_map.dbc is None else Path(can_map.dbc), can_map.table(), counts)


class CanDecoder:
    """Decodes frame by frame and never raises on any of them.

    counts  messages by name, refusals as "refused.<cause>"
    """

    def __init__(self, can_map: CanMap, counts: Counter[str] | None = None) -> None:
        self.counts: Counter[str] = Counter() if counts is None else counts
        self._map = can_map
        self._dialect = dialect_of(can_map, self.counts)
        self._clock = VehicleClock()
        self._gate = MeasurementGate(self.counts)
        self._signals: dict[str, list[tuple[int, CanSignal]]] = {}
        for index, signal in enumerate(can_map.table()):
            self._signals.setdefault(signal.message, []).append((index, signal))
        self._has_clock = any(signal.time is not None for signal in can_map.table())
        self._stamp_us: int | None = None
        self._sender: dict[int, tuple[int, int]] = {}  # signal index: address, last heard

    def feed(self, packets: Iterable[Packet]) -> list[Measurement]:
        """Measurements of these frames, in their order."""
        found: list[Measurement] = []
        for packet in packets:
            if packet.can_id is None:
                self.counts["refused.not_can"] += 1
                continue
            message = self._dialect.decode(packet)
            if message is not None:
                self._measure(message, packet.t_us, found)
        return found

    def _measure(self, message: CanMessage, receive_us: int, found: list[Measurement]) -> None:
        times: dict[str | None, int | None] = {}  # the clock is asked once a message
        for index, signal in self._signals.get(message.name, ()):
            raw = self._raw(index, signal, message, receive_us)
            if raw is None:
                continue
            if signal.time not in times:
                times[signal.time] = self._time(signal.time, message, receive_us)
            t_us = times[signal.time]
            if t_us is not None:
                quantity, value = self._map.to_quantity(signal, raw)
                self._gate.admit(found, quantity, value, t_us, message.label, self._clock.boot)

    def _raw(self, index: int, signal: CanSignal, message: CanMessage, receive_us: int) -> float | None:
        fields = message.fields
        if signal.signal not in fields or any(fields.get(only.signal) != only.value for only in signal.only):
            return None  # another instance, or another multiplexer
        raw = fields[signal.signal]
        if raw is None:
            self.counts["refused.not_available"] += 1
        elif signal.quantity == "pressure" and not signal.scale * raw + signal.offset >= LOWEST_PRESSURE:
            self.counts["refused.range"] += 1
        elif not self._is_sender(index, message.address, receive_us):
            self.counts["refused.other_sender"] += 1
        else:
            return raw
        return None

    def _is_sender(self, index: int, address: int | None, receive_us: int) -> bool:
        if address is None:
            return True
        if self._map.source_address is not None:
            return address == self._map.source_address
        chosen, heard_us = self._sender.get(index, (address, receive_us))
        # abs: the clock of a recording may step back.
        if chosen != address and abs(receive_us - heard_us) < SILENCE_US:
            return False
        self._sender[index] = (address, receive_us)
        return True

    def _time(self, name: str | None, message: CanMessage, receive_us: int) -> int | None:
        """Time of a message on the one clock of the bus; None, and counted, when it cannot be relied on."""
        if name is None and self._has_clock:
            t_us = self._clock.from_receive(receive_us)
            if t_us is None:
                self.counts["refused.no_clock"] += 1
            return t_us
        stamp_us = receive_us
        if name is not None:
            stamp_s = message.fields.get(name)
            if stamp_s is None or not isfinite(stamp_s):
                self.counts["refused.no_time"] += 1
                return None
            stamp_us = round(stamp_s * 1e6)
            period_us = self._dialect.clock_period_us(message.name, name)
            if period_us is not None and self._stamp_us is not None:
                stamp_us += period_us * round((self._stamp_us - stamp_us) / period_us)
            self._stamp_us = stamp_us
        t_us = self._clock.from_boot(stamp_us, receive_us)
        if t_us is None:
            self.counts["refused.time_step"] += 1
        return t_us
