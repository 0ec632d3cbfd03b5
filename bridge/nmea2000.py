"""NMEA 2000: parameter groups (PGN) in 29-bit identifiers, single frames and fast packets.

The few fields that the vertical plane needs are read directly; a DBC would know neither fast packets nor
"not available".
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from bridge.can_dialect import CanMessage
from bridge.can_map import CanSignal
from bridge.errors import BridgeError
from bridge.fast_packet import FastPackets, is_fast, to_frames
from bridge.link import Packet

# Of a computer that has claimed no address; a bus with 252 devices is not met.
OWN_ADDRESS = 251


@dataclass(frozen=True, slots=True)
class Field:
    """A little-endian integer; its three largest codes mean reserved, error and not available."""

    offset: int
    bits: int
    scale: float = 1.0
    signed: bool = True

    @property
    def not_available(self) -> int:
        return (1 << self.bits - self.signed) - 1

    def read(self, data: bytes) -> float | None:
        """The physical value, None when not available."""
        end = self.offset + self.bits // 8
        raw = int.from_bytes(data[self.offset : end], "little", signed=self.signed)
        return None if raw > self.not_available - 3 else raw * self.scale

    def write(self, data: bytearray, value: float | None) -> None:
        """Raises ValueError when the value does not fit."""
        raw = self.not_available if value is None else round(value / self.scale)
        lowest = -self.not_available - 1 if self.signed else 0
        if value is not None and not lowest <= raw <= self.not_available - 3:
            raise ValueError(f"{value} does not fit {self.bits} bits of {self.scale}")
        end = self.offset + self.bits // 8
        data[self.offset : end] = raw.to_bytes(self.bits // 8, "little", signed=self.signed)


@dataclass(frozen=True, slots=True)
class Group:
    """A parameter group: what travels under one PGN."""

    priority: int
    length: int
    fields: Mapping[str, Field]


_SID = Field(0, 8, signed=False)  # ties messages of one instant together

# Scales in rad, m/s and Pa a count.
GROUPS: Mapping[int, Group] = {
    127245: Group(
        2,
        8,
        {"instance": Field(0, 8, signed=False), "order": Field(2, 16, 1e-4), "position": Field(4, 16, 1e-4)},
    ),
    127257: Group(
        3,
        8,
        {"sid": _SID, "yaw": Field(1, 16, 1e-4), "pitch": Field(3, 16, 1e-4), "roll": Field(5, 16, 1e-4)},
    ),
    128259: Group(
        2,
        8,
        {
            "sid": _SID,
            "water_speed": Field(1, 16, 0.01, signed=False),
            "ground_speed": Field(3, 16, 0.01, signed=False),
        },
    ),
    130314: Group(
        5,
        8,
        {
            "sid": _SID,
            "instance": Field(1, 8, signed=False),
            "source": Field(2, 8, signed=False),  # 0 atmosphere, 1 water
            "pressure": Field(3, 32, 0.1),
        },
    ),
    130578: Group(
        2, 12, {"longitudinal_water": Field(0, 16, 1e-3), "longitudinal_ground": Field(5, 16, 1e-3)}
    ),
}


def pgn_of(can_id: int) -> int:
    """PGN of a 29-bit identifier (SAE J1939-21): below PDU format 240 the next byte is a destination."""
    pgn = (can_id >> 8) & 0x3FFFF
    return pgn & 0x3FF00 if (pgn >> 8) & 0xFF < 240 else pgn


class Nmea2000:
    """Decodes the groups of GROUPS; the others are counted by PGN, fast packets once they are whole."""

    def __init__(self, signals: tuple[CanSignal, ...], counts: Counter[str]) -> None:
        self._counts = counts
        self._fast_packets = FastPackets(counts)
        self._sequence = 0
        for signal in signals:
            _check(signal)

    def decode(self, packet: Packet) -> CanMessage | None:
        if packet.can_id is None or not packet.extended:
            self._counts["other"] += 1
            return None
        pgn = pgn_of(packet.can_id)
        data: bytes | None = packet.data
        if is_fast(pgn):
            data = self._fast_packets.feed(packet)
        if data is None:
            return None
        label = f"NMEA2000 {pgn}"
        self._count(label)
        group = GROUPS.get(pgn)
        if group is None:
            return None
        if len(data) < max(field.offset + field.bits // 8 for field in group.fields.values()):
            self._counts["refused.short"] += 1
            return None
        fields = {name: field.read(data) for name, field in group.fields.items()}
        return CanMessage(str(pgn), label, fields, packet.can_id & 0xFF)

    def encode(self, name: str, fields: Mapping[str, float], t_us: int) -> list[Packet]:
        pgn = int(name)
        group = GROUPS[pgn]
        data = bytearray(b"\xff" * group.length)
        for key, field in group.fields.items():
            field.write(data, fields.get(key))
        can_id = group.priority << 26 | pgn << 8 | OWN_ADDRESS
        payloads = [bytes(data)]
        if is_fast(pgn):
            payloads = to_frames(bytes(data), self._sequence)
            self._sequence = (self._sequence + 1) % 8
        return [Packet(t_us=t_us, data=payload, can_id=can_id, extended=True) for payload in payloads]

    def clock_period_us(self, name: str, time: str) -> int | None:  # noqa: ARG002
        return None

    def _count(self, label: str) -> None:
        # 2^18 PGNs exist: a hostile bus must not fill the memory with names.
        self._counts[label if label in self._counts or len(self._counts) < 300 else "other"] += 1


def _check(signal: CanSignal) -> None:
    if signal.message == "128267":
        raise BridgeError(
            "can.signals message 128267 is the water under the transducer, not the depth of the vehicle:"
            " use pressure, 130314"
        )
    group = GROUPS.get(int(signal.message)) if signal.message.isdecimal() else None
    if group is None:
        known = ", ".join(str(pgn) for pgn in GROUPS)
        raise BridgeError(f"can.signals message must be one of the PGNs {known} (got {signal.message})")
    for name in (signal.signal, *(selector.signal for selector in signal.only)):
        if name not in group.fields:
            known = ", ".join(group.fields)
            raise BridgeError(f"can.signals signal of {signal.message} must be one of {known} (got {name})")
    if signal.time is not None:
        raise BridgeError(f"can.signals time must be left out with NMEA 2000 (got {signal.time})")
