"""Stretches that whoever flew the vehicle leaves out: turns, say, in which roll and yaw carry the pitch."""

import re
from collections.abc import Iterable
from dataclasses import replace
from math import inf

from host.errors import RecordingError
from host.recordings.recording import Recording

Span = tuple[float, float]
SPAN = re.compile(r"(\d+(?:\.\d*)?)-(\d+(?:\.\d*)?)")
LEAST_KEPT = 5.0  # s: a free run over less, from a start of its own, teaches nothing


def spans_in(text: str) -> list[Span]:
    """The stretches, s, of "60-80,120-140"; none of "". Raises RecordingError with one line else."""
    if not text:
        return []
    found = [SPAN.fullmatch(part.strip()) for part in text.split(",")]
    spans = [(float(one[1]), float(one[2])) for one in found if one is not None]
    if None in found or any(start >= end for start, end in spans):
        raise RecordingError(
            f"--leave-out {text}: give START-END[,START-END...] in seconds, as 60-80,120-140"
        )
    return sorted(spans)


def without(
    recordings: list[Recording], spans: list[Span], why: str = "left out as asked"
) -> list[Recording]:
    """What is left of the stretches of one file; each piece begins from a state of its own, as after a gap.

    A note says why, and which.

    Raises RecordingError where there are several files, or nothing is left.
    """
    if not spans:
        return recordings
    name = recordings[0].name
    if any(recording.name != name for recording in recordings):
        raise RecordingError("--leave-out takes one recording: its seconds are those of one file")
    pieces = recordings
    for start, end in spans:
        pieces = [part for one in pieces for part in (one.between(-inf, start), one.between(end, inf))]
    pieces = [piece for piece in pieces if piece.time.size > 1 and piece.duration >= LEAST_KEPT]
    if not pieces:
        raise RecordingError(f"{name}: --leave-out leaves nothing of it")
    note = f"{why}: {told(spans)}"
    return [replace(piece, notes=(*piece.notes, note)) for piece in pieces]


def told(spans: Iterable[Span]) -> str:
    """The stretches, in words."""
    return ", ".join(f"{start:.5g} to {end:.5g} s" for start, end in spans)
