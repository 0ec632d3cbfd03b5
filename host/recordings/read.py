"""Any recording to its stretches on the time grid: text, telemetry, dataflash, CAN logs, the journal."""

from pathlib import Path
from typing import NoReturn

from bridge.logs import LogReading, read_log
from host.errors import RecordingError
from host.live.journal import JournalReading, read_journal
from host.recordings.aligned import Messages, aligned, aligned_table, is_of_messages
from host.recordings.csv_recording import read_table, stretches_of
from host.recordings.recording import NEEDED, Recording, file_sha256
from host.vehicle import Vehicle


def read_recordings(
    path: Path, vehicle: Vehicle, needs: tuple[str, ...] = NEEDED, on_grid: bool = True
) -> list[Recording]:
    """Stretches of one file, cut at reboots and long gaps; `counts` of each say what was refused and why.

    needs  channels without which a stretch is of no use; the others may be missing altogether.
    on_grid  whether messages are brought to the instants of a grid, as methods that are fed at every step
             need them, or stand at their own times (host.recordings.own_times)

    Raises RecordingError or LogFormatError with one line when nothing usable is in it.
    """
    if path.is_dir():
        raise RecordingError(f"{path}: is a folder; name the recording inside it")
    if not path.exists():
        raise RecordingError(f"{path}: no such file")
    if path.stat().st_size == 0:
        raise RecordingError(f"{path}: is empty; nothing was recorded")
    suffix = path.suffix.lower()
    if suffix == ".csv":
        return _of_table(path, vehicle, needs, on_grid)
    is_journal = suffix == ".jsonl"
    reading = read_journal(path) if is_journal else read_log(path, vehicle.mavlink, vehicle.can)
    messages = Messages(
        name=path.name,
        sha256=file_sha256(path),
        measurements=reading.measurements,
        counts=reading.counts,
        notes=tuple(reading.notes),
        alarms=_alarms(reading),
    )
    return aligned(messages, vehicle.alignment, needs, on_grid) or _refused(path, reading, needs)


def _of_table(path: Path, vehicle: Vehicle, needs: tuple[str, ...], on_grid: bool) -> list[Recording]:
    table = read_table(path, vehicle.csv, needs)
    pieces = aligned_table(table, vehicle.alignment, needs, on_grid) if is_of_messages(table) else []
    return pieces or stretches_of(table, path, needs)


def _alarms(reading: LogReading | JournalReading) -> tuple[tuple[int, int], ...]:
    """When `mils run` found a mismatch, with the boot it was in."""
    events = reading.events if isinstance(reading, JournalReading) else ()
    marked = [(e.get("boot"), e.get("t_us")) for e in events if e.get("event") == "mismatch"]
    return tuple((boot, at) for boot, at in marked if isinstance(boot, int) and isinstance(at, int))


def _refused(path: Path, reading: LogReading | JournalReading, needs: tuple[str, ...]) -> NoReturn:
    seen = {measurement.quantity.value for measurement in reading.measurements}
    lacking = [name for name in needs if name not in seen]
    reason = f"no {' and no '.join(lacking)} in it" if lacking else "never all at once for 10 steps"
    raise RecordingError(
        f"{path}: {', '.join(needs)} are needed together: {reason}; "
        "check the vehicle file's channels (`--vehicle`)"
    )
