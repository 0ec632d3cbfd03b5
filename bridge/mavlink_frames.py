"""Cuts a byte stream into intact MAVLink 1 and 2 frames.

pymavlink's own parser believes the length that follows any 0xFD or 0xFE, so one stray byte swallows the
frames after it. Here a frame is believed only after its checksum; a failure moves on by ONE byte, so that no
intact frame is ever lost. The message definitions and the checksum are the generated dialect's.
"""

import re
from collections import Counter
from collections.abc import Callable
from enum import Enum
from operator import itemgetter
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as dialect

_V1, _V2 = dialect.PROTOCOL_MARKER_V1, dialect.PROTOCOL_MARKER_V2
MARKERS = (_V1, _V2)
_MARKER = re.compile(rb"[\xfd\xfe]")
_SIGNED = dialect.MAVLINK_IFLAG_SIGNED
MAX_FRAME = 10 + 255 + 2 + 13  # header, payload, checksum, signature of MAVLink 2


class Kind(NamedTuple):
    """A message definition: what is needed to judge and to unpack a frame."""

    name: str
    crc_extra: bytes
    size: int  # of the full payload; shorter ones are filled with zeros, longer ones come from newer dialects
    unpack: Callable[[bytes], tuple[Any, ...]]
    fields: list[str]  # in the order of the wire


KINDS: dict[int, Kind] = {
    number: Kind(
        message.msgname,
        bytes([message.crc_extra]),
        message.unpacker.size,
        message.unpacker.unpack,
        list(message.ordered_fieldnames),
    )
    for number, message in dialect.mavlink_map.items()
}
ID_OF: dict[str, int] = {kind.name: number for number, kind in KINDS.items()}


class Frame(NamedTuple):
    """One intact frame."""

    kind: Kind
    system: int
    component: int
    sequence: int
    payload: bytes
    length: int  # of the whole frame on the wire
    signed: bool


class Fault(Enum):
    """Why there is no frame at a place; the values are the names under which it is counted."""

    UNFINISHED = "refused.unfinished"
    HEADER = "refused.header"
    UNKNOWN_ID = "refused.unknown_id"
    CRC = "refused.crc"


def frame_at(data: bytes | bytearray, at: int) -> Frame | Fault:
    """The frame that begins at `at`; the byte there must be a marker."""
    left = len(data) - at
    if data[at] == _V2:
        if left < 10:
            return Fault.UNFINISHED
        flags = data[at + 2]
        if flags & ~_SIGNED:
            return Fault.HEADER
        size, head, tail = data[at + 1], 10, 15 if flags else 2
        sequence, system, component = data[at + 4], data[at + 5], data[at + 6]
        kind = KINDS.get(data[at + 7] | data[at + 8] << 8 | data[at + 9] << 16)
        if kind is None:
            return Fault.UNKNOWN_ID
    else:
        if left < 6:
            return Fault.UNFINISHED
        flags, head, tail = 0, 6, 2
        size, sequence, system, component = data[at + 1], data[at + 2], data[at + 3], data[at + 4]
        kind = KINDS.get(data[at + 5])
        if kind is None:
            return Fault.UNKNOWN_ID
        if size > kind.size:
            return Fault.HEADER
    length = head + size + tail
    if left < length:
        return Fault.UNFINISHED
    body = at + head + size
    if dialect.x25crc(data[at + 1 : body] + kind.crc_extra).crc != data[body] | data[body + 1] << 8:
        return Fault.CRC
    return Frame(kind, system, component, sequence, bytes(data[at + head : body]), length, bool(flags))


def field_reader(name: str, *fields: str) -> Callable[[bytes], tuple[Any, ...]]:
    """A function from a payload of message `name` to the named `fields` (two or more)."""
    kind = KINDS[ID_OF[name]]
    pick = itemgetter(*(kind.fields.index(field) for field in fields))
    size, unpack = kind.size, kind.unpack
    return lambda payload: pick(unpack(payload[:size].ljust(size, b"\0")))


class Scanner:
    """Finds the intact frames of a buffer and counts the faults between them."""

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._blamed_until = 0  # a damaged frame is one fault, whatever its inside looks like

    def next_frame(self, data: bytes | bytearray, at: int, *, final: bool) -> tuple[Frame | None, int]:
        """The first intact frame from `at` on, and where it begins.

        Without a frame, the place from which to look again once there are more bytes; with `final` there will
        be none, so that a frame cut off does not hide the intact ones behind its beginning.
        """
        while (marker := _MARKER.search(data, at)) is not None:
            at = marker.start()
            found = frame_at(data, at)
            if isinstance(found, Frame):
                return found, at
            if found is Fault.UNFINISHED and not final:
                return None, at
            self.blame(found, data, at)
            at += 1
        return None, len(data)

    def moved(self, by: int) -> None:
        """Tells that the buffer now begins `by` bytes later."""
        self._blamed_until = max(0, self._blamed_until - by)

    def blame(self, fault: Fault, data: bytes | bytearray, at: int) -> None:
        """Counts a fault, unless it lies inside a damaged frame that was counted already."""
        if at < self._blamed_until:
            return
        self._counts[fault.value] += 1
        if fault is Fault.CRC:
            head = 12 if data[at] == _V2 else 8
            self._blamed_until = at + head + data[at + 1]


class Framer:
    """`feed(bytes) -> list[Frame]`; keeps at most one unfinished frame."""

    def __init__(self, counts: Counter[str]) -> None:
        self._buffer = bytearray()
        self._scanner = Scanner(counts)
        self._counts = counts

    def feed(self, data: bytes) -> list[Frame]:
        buffer = self._buffer
        buffer += data
        frames: list[Frame] = []
        at = 0
        while True:
            frame, start = self._scanner.next_frame(buffer, at, final=False)
            if start > at:
                self._counts["refused.bytes"] += start - at
            if frame is None:
                break
            frames.append(frame)
            at = start + frame.length
        at = start
        del buffer[:at]
        self._scanner.moved(at)
        return frames
