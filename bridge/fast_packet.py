"""NMEA 2000 fast packets: up to 223 bytes in up to 32 frames of one identifier.

Byte 0 of each frame: sequence counter (3 bits), frame counter (5 bits). Byte 1 of frame 0: total length.
"""

from collections import Counter
from dataclasses import dataclass

from bridge.link import Packet

MAX_LENGTH = 223
# Every device sends a few groups at a time; beyond this the oldest unfinished one is given up.
MAX_OPEN = 64
# The sequence counter has 8 values, so a tail must not be joined to a head of long ago.
MAX_AGE_US = 1_000_000

# Groups that standard devices send as fast packets. Reference: the public PGN list of the canboat project.
_FAST = frozenset(
    (
        *(126208, 126464, 126720, *range(126983, 126989), 126996, 126998),
        *(127233, 127237, 127489, 127490, 127491, *range(127494, 127499), 127503, 127504, 127506, 127507),
        *(*range(127509, 127515), 128275, 128520, 128538),
        *(129029, 129038, 129039, 129040, 129041, 129044, 129045, 129284, 129285, 129301, 129302),
        *(129538, 129540, 129541, 129542, 129545, 129547, 129549, 129551, 129556),
        *range(129792, 129811),
        *(*range(130052, 130055), 130060, 130061, *range(130064, 130075)),
        *(*range(130320, 130325), 130330, *range(130561, 130568), *range(130569, 130575)),
        *(130577, 130578, 130580, 130581, 130583, 130584, 130586),
    )
)


def is_fast(pgn: int) -> bool:
    """Whether a group travels as fast packets; the last 256 are those of the makers."""
    return pgn in _FAST or 130816 <= pgn <= 131071


@dataclass(slots=True)
class _Open:
    started_us: int
    length: int
    next_frame: int
    data: bytearray


class FastPackets:
    """Joins frames by sender, group, destination and sequence counter.

    counts  takes "refused.fast_packet_lost" for each message given up because frames are missing, and
            "refused.fast_packet_headless" for each frame whose beginning was not seen
    """

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._open: dict[tuple[int, int], _Open] = {}

    def __len__(self) -> int:
        return len(self._open)

    def feed(self, packet: Packet) -> bytes | None:
        """The whole message when this frame completes one."""
        data = packet.data
        if len(data) < 2:
            self._counts["refused.short"] += 1
            return None
        key = ((packet.can_id or 0) & 0x03FFFFFF, data[0] >> 5)
        frame = data[0] & 0x1F
        message = self._open.pop(key, None)
        if frame == 0:
            if message is not None:
                self._counts["refused.fast_packet_lost"] += 1
            if not 0 < data[1] <= MAX_LENGTH:
                self._counts["refused.fast_packet_length"] += 1
                return None
            message = _Open(packet.t_us, data[1], 0, bytearray(data[2:]))
        elif message is None:
            self._counts["refused.fast_packet_headless"] += 1
            return None
        elif frame != message.next_frame or not 0 <= packet.t_us - message.started_us <= MAX_AGE_US:
            self._counts["refused.fast_packet_lost"] += 1
            return None
        else:
            message.data += data[1:]
        if len(message.data) >= message.length:
            return bytes(message.data[: message.length])
        message.next_frame += 1
        self._open[key] = message
        if len(self._open) > MAX_OPEN:
            del self._open[next(iter(self._open))]
            self._counts["refused.fast_packet_lost"] += 1
        return None


def to_frames(data: bytes, sequence: int) -> list[bytes]:
    """Payloads of the frames that carry `data`, at most 223 bytes; the last is filled up with 0xFF."""
    rest = bytes([len(data)]) + data
    frames = [bytes([sequence << 5 | n // 7]) + rest[n : n + 7] for n in range(0, len(rest), 7)]
    return [frame.ljust(8, b"\xff") for frame in frames]
