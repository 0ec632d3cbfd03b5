"""Recordings in Vector's text format .asc.

Times in the lines count from a date in the header (or from the line before, "timestamps relative").
"""

import re
from collections import Counter
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

from bridge.link import Packet

_DATE = re.compile(r"(?:date|begin\s+triggerblock)\s+\w+\s+(\w+)\s+(\d+)\s+(.+)", re.IGNORECASE)
_BASE = re.compile(r"base\s+(hex|dec)(?:\s+timestamps\s+(absolute|relative))?", re.IGNORECASE)
# 0.105000 1  9F119CCx       Rx   d 8 FF 72 5A FA F7 FF 04 FF  Length = 0 BitCount = 64 ID = 1x
_FRAME = re.compile(
    r"(\d{1,9}\.\d{1,9})\s+\d+\s+([0-9A-Fa-f]+)(x?)\s+[RT]x\s+([dr])(?:\s+([0-9A-Fa-f]+)(.*))?", re.IGNORECASE
)
# 0.105000 CANFD   1 Rx   9F119CCx   name  1 0 8  8 FF 72 5A FA F7 FF 04 FF ...
_FD_FRAME = re.compile(
    r"(\d{1,9}\.\d{1,9})\s+CANFD\s+\d+\s+[RT]x\s+([0-9A-Fa-f]+)(x?)\s+(?:[^\d\s]\S*\s+)?"
    r"[01]\s+[01]\s+[0-9A-Fa-f]+\s+(\d+)(.*)",
    re.IGNORECASE,
)
_EVENT = re.compile(r"(\d{1,9}\.\d{1,9})\s")
_FRAME_LIKE = re.compile(r"\d+\.\d+\s+(?:\d+\s+[0-9A-Fa-f]+x?\s+[RT]x|CANFD)\b", re.IGNORECASE)
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_GERMAN = {"mär": "mar", "mrz": "mar", "mai": "may", "okt": "oct", "dez": "dec"}
_CLOCKS = ("%I:%M:%S.%f %p %Y", "%I:%M:%S %p %Y", "%H:%M:%S.%f %Y", "%H:%M:%S %Y")
_MAX_LINE = 1000  # a CAN FD line has 300 characters


def read_asc(path: Path, counts: Counter[str], warnings: list[str]) -> Iterator[Packet]:
    """Packets on absolute time where the header has a date; damaged lines are counted.

    counts  takes "refused.line", "refused.remote_frame" and "refused.error_frame"
    """
    base = 16
    is_relative = False
    start_us: int | None = None
    elapsed_us = 0
    with path.open(encoding="utf-8", errors="replace") as file:
        while line := file.readline(_MAX_LINE):
            line = line.strip()
            if date := _DATE.match(line):
                start_us = _microseconds(*date.groups())
                if start_us is None:
                    warnings.append(f"{path}: date not understood, times count from the start: {line}")
            elif settings := _BASE.match(line):
                base = 10 if settings[1].lower() == "dec" else 16
                is_relative = (settings[2] or "").lower() == "relative"
            elif event := _EVENT.match(line):
                # Every event advances relative time, frame or not.
                time_us = round(float(event[1]) * 1e6)
                elapsed_us = elapsed_us + time_us if is_relative else time_us
                packet = _parse(line, base, (start_us or 0) + elapsed_us, counts)
                if packet is not None:
                    yield packet
            elif "\ufffd" in line or "\0" in line:
                counts["refused.line"] += 1
    if start_us is None:
        warnings.append(f"{path}: no date in the header, times count from the start of the recording")


def _parse(line: str, base: int, t_us: int, counts: Counter[str]) -> Packet | None:
    match = _FRAME.match(line)
    if match is not None:
        _, number, extended, kind, length, rest = match.groups()
        if kind in "rR":
            counts["refused.remote_frame"] += 1
            return None
        length_base = base
    else:
        match = _FD_FRAME.match(line)
        if match is None:
            if "errorframe" in line.lower():
                counts["refused.error_frame"] += 1
            elif _FRAME_LIKE.match(line):
                counts["refused.line"] += 1
            return None  # statistics, chip states and other events
        _, number, extended, length, rest = match.groups()
        length_base = 10
    try:
        size = int(length, length_base)
        data = bytes(int(byte, base) for byte in rest.split()[:size])
        can_id = int(number, base)
    except (TypeError, ValueError):
        counts["refused.line"] += 1
        return None
    if len(data) != size or can_id > (0x1FFFFFFF if extended else 0x7FF):
        counts["refused.line"] += 1
        return None
    return Packet(t_us=t_us, data=data, can_id=can_id, extended=bool(extended))


def _microseconds(month: str, day: str, rest: str) -> int | None:
    """Unix time of a date in local time, as "Sep", "30", "15:06:13.191 2019" or with "03:06:13 pm"."""
    name = month.lower()[:3]
    name = _GERMAN.get(name, name)
    if name not in _MONTHS:
        return None
    for clock in _CLOCKS:
        try:
            moment = datetime.strptime(rest.strip().lower(), clock)
            moment = moment.replace(month=_MONTHS.index(name) + 1, day=int(day))
            return round(moment.timestamp() * 1e6)
        except (ValueError, OverflowError, OSError):
            continue
    return None
