"""Reads a whole log of any known kind; one table from suffix to reader."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from bridge.can_map import CanMap
from bridge.dataflash import read_dataflash
from bridge.errors import LogFormatError
from bridge.mavlink_map import MavlinkMap
from bridge.measurement import Measurement
from bridge.tlog import read_tlog

_Contents = tuple[list[Measurement], Counter[str], list[str]]


@dataclass(frozen=True, slots=True, kw_only=True)
class LogReading:
    """What a log holds.

    measurements  in order of time; a change of `boot` is a restart of the vehicle
    counts        everything seen and refused, by cause
    notes         what was decided on the user's behalf, one sentence each
    """

    measurements: list[Measurement]
    counts: Counter[str]
    notes: list[str]


def _tlog(path: Path, mavlink: MavlinkMap, can: CanMap) -> _Contents:  # noqa: ARG001
    return read_tlog(path, mavlink)


def _dataflash(path: Path, mavlink: MavlinkMap, can: CanMap) -> _Contents:  # noqa: ARG001
    return read_dataflash(path, mavlink)


def _can(path: Path, mavlink: MavlinkMap, can: CanMap) -> _Contents:  # noqa: ARG001
    from bridge.can_source import read_can_log  # python-can and cantools load only for CAN

    return read_can_log(path, can)


READERS: dict[str, Callable[[Path, MavlinkMap, CanMap], _Contents]] = {
    ".tlog": _tlog,
    ".bin": _dataflash,
    ".log": _can,
    ".txt": _can,
    ".asc": _can,
    ".blf": _can,
}


def read_log(path: str | Path, mavlink: MavlinkMap, can: CanMap) -> LogReading:
    """All measurements of a log, by its suffix (any case).

    LogFormatError, in one line, when the file is missing, empty, of an unknown kind, not what its suffix
    says, or damaged beyond use.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise LogFormatError(
            f"{path.name}: unknown kind of log {path.suffix!r}; known are {', '.join(READERS)}; "
            "`mils identify` and `mils replay` also take .csv and .jsonl"
        )
    try:
        if path.stat().st_size == 0:
            raise LogFormatError(f"{path.name}: the file is empty")
        measurements, counts, notes = reader(path, mavlink, can)
    except OSError as error:
        raise LogFormatError(f"{path}: cannot be read: {error.strerror or error}") from error
    measurements.sort(key=lambda item: item.t_us)
    return LogReading(measurements=measurements, counts=counts, notes=notes)
