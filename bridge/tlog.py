"""Ground-station logs (.tlog): records of an 8-byte big-endian stamp (us since 1970) and a MAVLink frame."""

from collections import Counter
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

from bridge.errors import LogFormatError
from bridge.mavlink_decoder import MavlinkDecoder
from bridge.mavlink_frames import MARKERS, Fault, Frame, Scanner, frame_at
from bridge.mavlink_map import MavlinkMap
from bridge.measurement import Measurement

_STAMP = 8  # bytes before each frame
_LONGEST_STEP_US = 3600 * 1_000_000
_LEAST_SHARE = 0.01  # of the file that must be intact frames; less is another kind of file


def read_tlog(path: Path, mapping: MavlinkMap) -> tuple[list[Measurement], Counter[str], list[str]]:
    """All measurements of a .tlog, counts by message name and refusal, and notes.

    Damaged records, text between records and a cut tail cost only themselves; what stands before the first
    heartbeat is used as well. LogFormatError when the file holds no MAVLink to speak of.
    """
    data = path.read_bytes()
    decoder = MavlinkDecoder(mapping)
    out: list[Measurement] = []
    intact = 0
    waiting: list[tuple[int, Frame]] = []
    for t_us, frame in walk_tlog(data, decoder.counts):
        intact += _STAMP + frame.length
        waiting.append((t_us, frame))
        if decoder.knows_vehicle(frame):
            out += chain.from_iterable(decoder.take(each, at_us) for at_us, each in waiting)
            waiting.clear()
    for t_us, frame in waiting:
        decoder.take(frame, t_us)  # counts them
    if intact < _LEAST_SHARE * len(data) or not intact:
        raise LogFormatError(
            f"{path.name}: no MAVLink in it ({intact} of {len(data)} bytes are intact records); "
            "a .tlog is what a ground station records"
        )
    if decoder.vehicle is None:
        decoder.notes.append("no autopilot's heartbeat in this log: set system_id and component_id")
    return out, decoder.counts, decoder.notes


def walk_tlog(data: bytes, counts: Counter[str]) -> Iterator[tuple[int, Frame]]:
    """(receive time, frame) of every intact record, wherever it stands.

    The time is the sum of the plausible steps between stamps (at most an hour either way): at an absurd
    stamp, or when the computer's clock was set during the dive, it stands still for one record and that is
    counted.
    """
    scanner = Scanner(counts)
    at = 0
    t_us: int | None = None
    last_stamp = 0
    while at < len(data):
        frame, start = _next_record(data, at, scanner)
        if start > at + _STAMP:
            counts["refused.bytes"] += start - at - (_STAMP if frame else 0)
        if frame is None:
            return
        stamp = int.from_bytes(data[max(0, start - _STAMP) : start], "big")
        if t_us is None:
            t_us = stamp
        elif abs(stamp - last_stamp) <= _LONGEST_STEP_US:
            t_us += stamp - last_stamp
        else:
            counts["refused.timestamp"] += 1
        last_stamp = stamp
        yield t_us, frame
        at = start + frame.length


def _next_record(data: bytes, at: int, scanner: Scanner) -> tuple[Frame | None, int]:
    """The first intact frame from `at` on, and where it begins; normally 8 bytes on, after the stamp."""
    start = at + _STAMP
    if start < len(data) and data[start] in MARKERS:
        found = frame_at(data, start)
        if isinstance(found, Frame):
            return found, start
        if found is Fault.CRC:
            scanner.blame(found, data, start)
    return scanner.next_frame(data, at, final=True)
