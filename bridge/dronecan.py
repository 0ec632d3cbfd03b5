"""DroneCAN broadcasts: transfers of one or several frames, and the three messages of the vertical plane."""

from binascii import crc_hqx
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import asin, cos, isnan, nan, sin
from struct import Struct

from bridge.can_dialect import CanMessage
from bridge.can_map import CanSignal
from bridge.errors import BridgeError
from bridge.link import Packet

SOLUTION = 1000  # uavcan.equipment.ahrs.Solution
STATUS = 1011  # uavcan.equipment.actuator.Status
PRESSURE = 1028  # uavcan.equipment.air_data.StaticPressure
FIELDS = {
    SOLUTION: ("time", "pitch", "pitch_rate"),
    STATUS: ("actuator_id", "position"),
    PRESSURE: ("static_pressure",),
}
# Data type signatures: what the CRC of a transfer of several frames begins with. 1028 fits one frame.
_SIGNATURE = {SOLUTION: 0x72A63A3C6F41FA9B, STATUS: 0x5E9BBA44FAF1EA04, PRESSURE: 0}
OWN_NODE = 125
MAX_LENGTH = 128  # ahrs.Solution with all three covariances has 84 bytes and a CRC
_CLOCK_US = 2**56  # uavcan.Timestamp, microseconds of the network
_HALVES_4 = Struct("<4e")
_HALVES_3 = Struct("<3e")
_STATUS = Struct("<B3eB")
_PRESSURE = Struct("<fe")


@dataclass(slots=True)
class _Open:
    transfer: int
    toggle: int = 0
    data: bytearray = field(default_factory=bytearray)


class DroneCan:
    """Decodes the messages of FIELDS; the others are counted together."""

    def __init__(self, signals: tuple[CanSignal, ...], counts: Counter[str]) -> None:
        self._counts = counts
        self._open: dict[tuple[int, int], _Open] = {}  # by data type and node: 3 x 127 at most
        self._sent: Counter[int] = Counter()
        for signal in signals:
            _check(signal)

    def decode(self, packet: Packet) -> CanMessage | None:
        can_id = packet.can_id or 0
        data_type = (can_id >> 8) & 0xFFFF
        node = can_id & 0x7F
        is_service = bool(can_id & 0x80)
        # Node 0 is anonymous: its identifier holds only two bits of the data type.
        if not packet.extended or is_service or node == 0 or data_type not in FIELDS:
            self._counts["other"] += 1
            return None
        data = self._join((data_type, node), packet.data)
        if data is None:
            return None
        label = f"DroneCAN {data_type}"
        self._counts[label] += 1
        fields = _read(data_type, data)
        if fields is None:
            self._counts["refused.short"] += 1
            return None
        return CanMessage(str(data_type), label, fields, node)

    def encode(self, name: str, fields: Mapping[str, float], t_us: int) -> list[Packet]:
        data_type = int(name)
        try:
            data = _write(data_type, fields)
        except OverflowError as error:
            raise ValueError(f"DroneCAN {name}: {error}") from error
        if len(data) > 7:
            data = _crc(data_type, data) + data
        transfer = self._sent[data_type] % 32
        self._sent[data_type] += 1
        chunks = [data[n : n + 7] for n in range(0, len(data), 7)]
        packets = []
        for n, chunk in enumerate(chunks):
            tail = (n == 0) << 7 | (n == len(chunks) - 1) << 6 | (n % 2) << 5 | transfer
            can_id = 16 << 24 | data_type << 8 | OWN_NODE
            packets.append(Packet(t_us=t_us, data=chunk + bytes([tail]), can_id=can_id, extended=True))
        return packets

    def clock_period_us(self, name: str, time: str) -> int | None:  # noqa: ARG002
        return _CLOCK_US

    def _join(self, key: tuple[int, int], frame: bytes) -> bytes | None:
        """Payload of the transfer that this frame completes. The last byte of a frame is its tail."""
        if not frame:
            self._counts["refused.short"] += 1
            return None
        tail = frame[-1]
        is_first, is_last, toggle, transfer = tail & 0x80, tail & 0x40, tail >> 5 & 1, tail & 0x1F
        message = self._open.pop(key, None)
        if is_first:
            if message is not None:
                self._counts["refused.transfer_lost"] += 1
            if is_last:
                return frame[:-1]
            message = _Open(transfer)
        if message is None:
            self._counts["refused.transfer_headless"] += 1
            return None
        message.data += frame[:-1]
        if (toggle, transfer) != (message.toggle, message.transfer) or len(message.data) > MAX_LENGTH:
            self._counts["refused.transfer_lost"] += 1
            return None
        if not is_last:
            message.toggle ^= 1
            self._open[key] = message
            return None
        data = bytes(message.data[2:])
        if message.data[:2] != _crc(key[0], data):
            self._counts["refused.crc"] += 1
            return None
        return data


def _crc(data_type: int, data: bytes) -> bytes:
    """CRC-16/CCITT-FALSE over the signature and the payload, low byte first."""
    return crc_hqx(_SIGNATURE[data_type].to_bytes(8, "little") + data, 0xFFFF).to_bytes(2, "little")


def _read(data_type: int, data: bytes) -> dict[str, float | None] | None:
    """Fields of a payload; None when it is too short."""
    if data_type == PRESSURE:
        return None if len(data) < 4 else {"static_pressure": _PRESSURE.unpack(data.ljust(6, b"\0"))[0]}
    if data_type == STATUS:
        if len(data) < _STATUS.size:
            return None
        actuator, position, *_ = _STATUS.unpack_from(data)
        # NaN: unknown
        return {"actuator_id": actuator, "position": None if isnan(position) else position}
    # Solution: time (7 bytes), quaternion, length of a covariance (low half of byte 15), covariance, rates.
    rates_at = 16 + 2 * (data[15] & 0x0F) if len(data) > 15 else 16
    if len(data) < rates_at + _HALVES_3.size:
        return None
    time_us = int.from_bytes(data[:7], "little")
    x, y, z, w = _HALVES_4.unpack_from(data, 7)
    square = x * x + y * y + z * z + w * w
    # Half floats keep the norm to 1e-3; a sine outside +-1 by as much is upright, not an error.
    is_unit = 0.98 < square < 1.02
    return {
        "time": time_us * 1e-6 if time_us else None,
        "pitch": asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x) / square))) if is_unit else nan,
        "pitch_rate": _HALVES_3.unpack_from(data, rates_at)[1],
    }


def _write(data_type: int, fields: Mapping[str, float]) -> bytes:
    if data_type == PRESSURE:
        return _PRESSURE.pack(fields.get("static_pressure", nan), 0.0)
    if data_type == STATUS:
        return _STATUS.pack(int(fields.get("actuator_id", 0)), fields.get("position", nan), nan, nan, 127)
    half = 0.5 * fields.get("pitch", nan)
    time_us = round(fields.get("time", 0.0) * 1e6)
    quaternion = _HALVES_4.pack(0.0, sin(half), 0.0, cos(half))
    rates = _HALVES_3.pack(0.0, fields.get("pitch_rate", nan), 0.0)
    # No covariances; the acceleration is not known.
    return time_us.to_bytes(7, "little") + quaternion + b"\0" + rates + b"\0" + _HALVES_3.pack(nan, nan, nan)


def _check(signal: CanSignal) -> None:
    data_type = int(signal.message) if signal.message.isdecimal() else None
    if data_type not in FIELDS:
        known = ", ".join(str(number) for number in FIELDS)
        raise BridgeError(f"can.signals message must be one of the data types {known} (got {signal.message})")
    wanted = [signal.signal, *(selector.signal for selector in signal.only)]
    for name in wanted if signal.time is None else [*wanted, signal.time]:
        if name not in FIELDS[data_type]:
            known = ", ".join(FIELDS[data_type])
            raise BridgeError(f"can.signals signal of {signal.message} must be one of {known} (got {name})")
