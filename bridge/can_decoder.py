"""CAN frames to measurements, by the vehicle's map."""

from collections import Counter
from collections.abc import Iterable
from math import isfinite
from pathlib import Path

from bridge.can_clock import VehicleClock
from bridge.can_dbc import DbcDialect
from bridge.can_dialect import CanDialect, CanMessage
from bridge.can_map import CanMap, CanSignal
from bridge.dronecan import DroneCan
from bridge.link import Packet
from bridge.measurement import Measurement
from bridge.nmea2000 import Nmea2000

# A sender that was silent for this long has left; its signal goes to whoever speaks next.
SILENCE_US = 2_000_000


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
        self._clock = VehicleClock(self.counts)
        self._signals: dict[str, list[tuple[int, CanSignal]]] = {}
        for index, signal in enumerate(can_map.table()):
            self._signals.setdefault(signal.message, []).append((index, signal))
        self._has_clock = any(signal.time is not None for signal in can_map.table())
        self._sender: dict[int, tuple[int, int]] = {}  # signal index: address, last heard

    def feed(self, packets: Iterable[Packet]) -> list[Measurement]:
        """Measurements of these frames, in their order."""
        found = []
        for packet in packets:
            if packet.can_id is None:
                self.counts["refused.not_can"] += 1
                continue
            message = self._dialect.decode(packet)
            if message is None:
                continue
            for index, signal in self._signals.get(message.name, ()):
                measurement = self._measure(index, signal, message, packet.t_us)
                if measurement is not None:
                    found.append(measurement)
        return found

    def _measure(
        self, index: int, signal: CanSignal, message: CanMessage, receive_us: int
    ) -> Measurement | None:
        fields = message.fields
        if signal.signal not in fields or any(fields.get(only.signal) != only.value for only in signal.only):
            return None  # another instance, or another multiplexer
        raw = fields[signal.signal]
        if raw is None:
            self.counts["refused.not_available"] += 1
            return None
        if not isfinite(raw):
            self.counts["refused.not_finite"] += 1
            return None
        if not self._is_sender(index, message.address, receive_us):
            self.counts["refused.other_sender"] += 1
            return None
        t_us = self._time(signal, message, receive_us)
        if t_us is None or not self._clock.accept(index, t_us):
            return None
        quantity, value = self._map.to_quantity(signal, raw)
        return Measurement(
            quantity=quantity, value=value, t_us=t_us, source=message.label, boot=self._clock.boot
        )

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

    def _time(self, signal: CanSignal, message: CanMessage, receive_us: int) -> int | None:
        if signal.time is None:
            return self._clock.received(receive_us) if self._has_clock else receive_us
        stamp_s = message.fields.get(signal.time)
        if stamp_s is None or not isfinite(stamp_s):
            self.counts["refused.no_time"] += 1
            return None
        period_us = self._dialect.clock_period_us(message.name, signal.time)
        return self._clock.stamped(round(stamp_s * 1e6), period_us, receive_us)
