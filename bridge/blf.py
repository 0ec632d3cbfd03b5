"""Recordings in Vector's binary format .blf: containers of zlib data with objects of one frame each.

python-can's reader ends at the first damage and can turn in circles on a length of 0; this one goes on at
the next object.
"""

import zlib
from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from struct import Struct, error

from bridge.errors import LogFormatError
from bridge.link import Packet

_FILE = Struct("<4sL8B2Q2L8H8H")  # signature, header size, ..., start, stop (SYSTEMTIME)
_OBJECT = Struct("<4sHHLL")  # "LOBJ", header size, header version, object size, type
_STAMP_V1 = Struct("<L4xQ")  # flags, time
_CONTAINER = Struct("<H6xL4x")  # compression, uncompressed size
_CAN = Struct("<HBBL")  # channel, flags, dlc, id; 8 bytes of data
_CAN_FD = Struct("<HBBLLBBB5x")  # channel, flags, dlc, id, -, -, -, valid bytes; 64 bytes of data
_CAN_FD_64 = Struct("<BBBBLLLLLLLHBBL")  # channel, dlc, valid bytes, -, id, -, flags, ...
_MESSAGE, _ERROR, _CONTAINER_TYPE, _ERROR_EXT, _MESSAGE2, _FD, _FD_64 = 1, 2, 10, 73, 86, 100, 101
_MAX_CONTAINER = 16 << 20  # 128 KiB is usual; no header may claim more than this
_MAX_OBJECT = 1 << 20  # a frame has 160 bytes at most, a comment more
_EXTENDED = 0x80000000


def read_blf(path: Path, counts: Counter[str], warnings: list[str]) -> Iterator[Packet]:
    """Packets on absolute time (UTC) where the header has the start; a writer that was killed leaves none.

    counts  takes "refused.container", "refused.object", "refused.remote_frame" and "refused.error_frame"
    Raises LogFormatError when the file does not begin as a .blf file.
    """
    data = path.read_bytes()
    if len(data) < _FILE.size or not data.startswith(b"LOGG"):
        raise LogFormatError(f"{path} is not a .blf file: it must begin with LOGG (got {data[:4]!r})")
    header = _FILE.unpack_from(data)
    start_us = _microseconds(header[14:22])
    if start_us is None:
        start_us = 0
        warnings.append(
            f"{path}: the start time is missing (its writer was killed), times count from the start"
        )
    tail = b""
    for content in _containers(data, counts):
        content = tail + content
        position = 0
        while True:
            found = content.find(b"LOBJ", position)
            if found < 0:
                tail = content[max(position, len(content) - 3) :]
                break
            if found > position + 7:  # up to 7 bytes are padding
                counts["refused.object"] += 1
            head = content[found : found + _OBJECT.size]
            size = _OBJECT.unpack(head)[3] if len(head) == _OBJECT.size else _OBJECT.size
            if found + size > len(content) and size <= _MAX_OBJECT:
                tail = content[found:]  # goes on in the next container
                break
            packet = _frame(content[found : found + size], start_us, counts)
            if packet is not None:
                yield packet
            position = found + max(size, 4) if size <= _MAX_OBJECT else found + 4
    if tail:
        counts["refused.object"] += 1


def _containers(data: bytes, counts: Counter[str]) -> Iterator[bytes]:
    """Uncompressed contents, from one container signature to the next."""
    position = _FILE.size
    while (found := data.find(b"LOBJ", position)) >= 0:
        position = found + 4
        try:
            _, header_size, _, size, kind = _OBJECT.unpack_from(data, found)
            if kind != _CONTAINER_TYPE:
                continue
            compression, length = _CONTAINER.unpack_from(data, found + header_size)
        except error:
            break
        body = data[found + header_size + _CONTAINER.size : found + size]
        try:
            content = body
            if compression == 2:
                content = zlib.decompressobj().decompress(body, min(length, _MAX_CONTAINER))
        except zlib.error:
            counts["refused.container"] += 1
            continue
        if len(content) != length:
            counts["refused.container"] += 1  # cut; what is there is still read
        position = found + max(size, 4)
        yield content


def _frame(item: bytes, start_us: int, counts: Counter[str]) -> Packet | None:
    try:
        _, header_size, version, _, kind = _OBJECT.unpack_from(item)
        if kind not in (_MESSAGE, _MESSAGE2, _FD, _FD_64):
            if kind in (_ERROR, _ERROR_EXT):
                counts["refused.error_frame"] += 1
            return None
        flags, time = _STAMP_V1.unpack_from(item, _OBJECT.size)
        can_id, remote, length, at = _layout(item, kind, header_size)
    except error:
        counts["refused.object"] += 1
        return None
    data = item[at : at + length]
    if version not in (1, 2) or len(data) != length or can_id & 0x7FFFFFFF > 0x1FFFFFFF:
        counts["refused.object"] += 1
        return None
    if remote:
        counts["refused.remote_frame"] += 1
        return None
    t_us = start_us + (time * 10 if flags == 1 else round(time / 1000))  # units of 10 us or 1 ns
    return Packet(t_us=t_us, data=data, can_id=can_id & 0x1FFFFFFF, extended=bool(can_id & _EXTENDED))


def _layout(item: bytes, kind: int, at: int) -> tuple[int, bool, int, int]:
    """Identifier, whether a remote frame, payload length and its place."""
    if kind == _FD:
        _, flags, _, can_id, _, _, _, valid = _CAN_FD.unpack_from(item, at)
        return can_id, bool(flags & 0x80), valid, at + _CAN_FD.size
    if kind == _FD_64:
        fields = _CAN_FD_64.unpack_from(item, at)
        return fields[4], bool(fields[6] & 0x10), fields[2], at + _CAN_FD_64.size
    _, flags, dlc, can_id = _CAN.unpack_from(item, at)
    return can_id, bool(flags & 0x80), min(dlc, 8), at + _CAN.size


def _microseconds(systemtime: tuple[int, ...]) -> int | None:
    year, month, _, day, hour, minute, second, millisecond = systemtime
    try:
        moment = datetime(year, month, day, hour, minute, second, millisecond * 1000, UTC)
    except ValueError:
        return None
    return round(moment.timestamp() * 1e6)
