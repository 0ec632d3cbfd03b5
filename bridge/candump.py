"""Recordings of can-utils' candump: `-L` or `-l` (log lines) and `-ta`, `-tA` (screen lines)."""

import re
from collections import Counter
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

from bridge.link import Packet

# (1502984866.421964) can0 09F119CC#FF725AFAF7FF04FF R        CAN FD: "##", a digit of flags
_LOG_LINE = re.compile(
    r"\((\d{1,12}\.\d+)\)\s+\S+\s+([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(?:#[0-9A-Fa-f])?"
    r"((?:[0-9A-Fa-f]{2})*|[Rr]\d?)(?:\s+[RTB])?\s*"
)
# (1502984866.421964)  can0  RX - -  09F119CC   [8]  FF 72 5A FA F7 FF 04 FF   'ascii'
# <0x09f119cc> [8] ff 72 5a fa f7 ff 04 ff                    of old versions
_SCREEN_LINE = re.compile(
    r"\s*(?:\(([^)]+)\)\s+)?(?:\S+\s+(?:[RT]X\s+\S+\s+\S+\s+)?|<0x)([0-9A-Fa-f]{8}|[0-9A-Fa-f]{3})>?"
    r"\s+\[(\d+)\]((?:\s+[0-9A-Fa-f]{2})*|\s+remote request)(?:\s+'.*)?\s*"
)
# Longer than any line of candump; binary files have no lines.
_MAX_LINE = 1000


def read_candump(path: Path, counts: Counter[str], warnings: list[str]) -> Iterator[Packet]:
    """Packets of the lines that are frames. Comments are passed over; other lines are counted.

    counts  takes "refused.line", "refused.no_time", "refused.remote_frame", "refused.error_frame"
    """
    with path.open(encoding="ascii", errors="replace") as file:
        while line := file.readline(_MAX_LINE):
            if not line.strip() or line.startswith("#"):
                continue
            packet = _parse(line, counts)
            if packet is not None:
                yield packet
    if counts["refused.no_time"]:
        warnings.append(
            f"{path}: {counts['refused.no_time']} frames have no time stamps; record with candump -L"
        )


def _parse(line: str, counts: Counter[str]) -> Packet | None:
    match = _LOG_LINE.fullmatch(line)
    if match is not None:
        time, can_id, data = match.groups()
    else:
        match = _SCREEN_LINE.fullmatch(line)
        if match is None:
            counts["refused.line"] += 1
            return None
        time, can_id, length, data = match.groups()
        if time is None:
            counts["refused.no_time"] += 1
            return None
        if "remote" not in data and len(data.split()) != int(length):
            counts["refused.line"] += 1
            return None
    if "r" in data.lower():
        counts["refused.remote_frame"] += 1
        return None
    number = int(can_id, 16)
    if number > 0x1FFFFFFF:  # the flag of an error frame
        counts["refused.error_frame"] += 1
        return None
    t_us = _microseconds(time)
    if t_us is None:
        counts["refused.line"] += 1
        return None
    return Packet(t_us=t_us, data=bytes.fromhex(data), can_id=number, extended=len(can_id) == 8)


def _microseconds(time: str) -> int | None:
    try:
        if "-" in time:  # -tA: local date and time
            return round(datetime.strptime(time, "%Y-%m-%d %H:%M:%S.%f").timestamp() * 1e6)
        return round(float(time) * 1e6)
    except (ValueError, OverflowError, OSError):
        return None
