"""CAN recordings by their suffix: candump .log or .txt, .asc, .blf."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import can

from bridge.asc import read_asc
from bridge.blf import read_blf
from bridge.candump import read_candump
from bridge.errors import LogFormatError
from bridge.link import Packet

READERS: dict[str, Callable[[Path, Counter[str], list[str]], Iterator[Packet]]] = {
    ".log": read_candump,
    ".txt": read_candump,
    ".asc": read_asc,
    ".blf": read_blf,
}
_WRITERS: dict[str, type[can.CanutilsLogWriter] | type[can.ASCWriter] | type[can.BLFWriter]] = {
    ".log": can.CanutilsLogWriter,
    ".txt": can.CanutilsLogWriter,
    ".asc": can.ASCWriter,
    ".blf": can.BLFWriter,
}


class CanLog:
    """Packets of a recording, read as they are asked for.

    counts    refusals by cause, complete when the last packet has been read
    warnings  one sentence each, e.g. that absolute time is lost

    Opening raises LogFormatError for an unknown suffix or an empty file and OSError for a missing one;
    reading raises LogFormatError at its end when there was no frame at all.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.counts: Counter[str] = Counter()
        self.warnings: list[str] = []
        if path.suffix.lower() not in READERS:
            raise LogFormatError(f"a CAN recording must end in {', '.join(READERS)} (got {path})")
        if path.stat().st_size == 0:
            raise LogFormatError(f"{path} is empty")

    def __iter__(self) -> Iterator[Packet]:
        self.counts.clear()
        self.warnings.clear()
        has_frames = False
        for packet in READERS[self.path.suffix.lower()](self.path, self.counts, self.warnings):
            has_frames = True
            yield packet
        if has_frames:
            return
        if self.counts["refused.no_time"]:
            raise LogFormatError(
                f"{self.path} has no time stamps ({self.counts['refused.no_time']} frames):"
                " record with candump -L, or candump -ta"
            )
        refused = "".join(f", {cause} {count}" for cause, count in self.counts.items())
        raise LogFormatError(
            f"{self.path} holds no CAN frame{refused}: is it what its suffix says, "
            "a recording of candump (.log, .txt), .asc or .blf?"
        )


def write_can_log(path: Path, packets: Iterable[Packet]) -> None:
    """Writes a recording in the format of the suffix; .asc and .blf keep their start to 1 ms only."""
    if path.suffix.lower() not in _WRITERS:
        raise LogFormatError(f"a CAN recording must end in {', '.join(_WRITERS)} (got {path})")
    with _WRITERS[path.suffix.lower()](str(path)) as writer:
        for packet in packets:
            if packet.can_id is not None:
                writer.on_message_received(
                    can.Message(
                        timestamp=packet.t_us * 1e-6,
                        arbitration_id=packet.can_id,
                        is_extended_id=packet.extended,
                        data=packet.data,
                        is_fd=len(packet.data) > 8,
                    )
                )
