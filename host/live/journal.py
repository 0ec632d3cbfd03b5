"""The append-only recording of a live run: one JSON object a line, nothing ever overwritten."""

import json
import math
import os
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import Any

from bridge.measurement import Measurement, Quantity
from host.errors import HostError, RecordingError
from host.version import program_version

SCHEMA = 1
SUFFIX = ".jsonl"


class Journal:
    """Writes a journal. Each call is one append to the file, so that a killed process loses nothing.

    When the disk is full or gone, `warn` is called once, lines are lost and counted in `lost`, and writing is
    tried again with every line: a recorder must not stop the vehicle's program.
    """

    def __init__(
        self,
        place: Path,
        *,
        vehicle: str,
        configuration: Mapping[str, Any],
        wall_s: Callable[[], float],
        warn: Callable[[str], None],
    ) -> None:
        """Creates a new file at `place`, when that ends in .jsonl, else in the folder `place`.

        A name that is taken gets a counter.

        wall_s  seconds since 1970; dates the header and the events
        Raises HostError when the file or its header cannot be written.
        """
        self.lost = 0
        self._wall_s = wall_s
        self._warn = warn
        self._is_failing = False
        self._is_torn = False
        started = datetime.fromtimestamp(wall_s(), UTC)
        stem = f"{_file_name(vehicle)}-{started:%Y%m%d-%H%M%S}"
        self.path, self._file = _create(place, stem)
        header = {
            "journal": SCHEMA,
            "vehicle": vehicle,
            "version": program_version(),
            "started": started.isoformat(timespec="milliseconds"),
            "configuration": configuration,
        }
        self._append([header])
        if self.lost:
            self.close()
            raise HostError(f"{self.path}: journal cannot be written (is the disk full?)")

    def measurements(self, measurements: Iterable[Measurement]) -> None:
        self._append([_record(measurement) for measurement in measurements])

    def estimate(self, t_us: int, values: Mapping[str, object]) -> None:
        """What was published; a value that is not finite is written as null."""
        self._append([{"estimate": values, "t_us": t_us}])

    def event(self, event: str, detail: str = "", facts: Mapping[str, object] | None = None) -> None:
        """What happened, in a sentence; `facts` stand beside it in the record."""
        self._append(
            [{"event": event, "detail": detail, "wall_s": round(self._wall_s(), 3), **(facts or {})}]
        )

    def sync(self) -> None:
        """Has the system write everything to the medium; survives a loss of power from then on."""
        try:
            os.fsync(self._file)
        except OSError as error:
            self._report(error)

    def close(self) -> None:
        """May be called twice."""
        if self._file >= 0:
            self.sync()
            os.close(self._file)
            self._file = -1

    def _append(self, records: list[dict[str, Any]]) -> None:
        lines = "".join(json.dumps(_finite(record), separators=(",", ":")) + "\n" for record in records)
        if not lines:
            return
        # A line torn by a full disk is ended first; the reader counts it as damaged.
        rest = (b"\n" if self._is_torn else b"") + lines.encode()
        try:
            while rest:
                written = os.write(self._file, rest)
                self._is_torn = written < len(rest)
                rest = rest[written:]
            self._is_failing = False
        except OSError as error:
            self.lost += rest.lstrip(b"\n").count(b"\n")
            self._report(error)

    def _report(self, error: OSError) -> None:
        if not self._is_failing:
            self._warn(f"{self.path}: cannot be written ({error.strerror}); what comes now is not recorded")
        self._is_failing = True


@dataclass(frozen=True, slots=True, kw_only=True)
class JournalReading:
    """What a journal holds.

    header     "vehicle", "version", "started", "configuration" as `host.toml_config.build` takes it
    estimates  as published: "t_us" and "estimate"
    events     "event", "detail" and "wall_s"; a "mismatch" also "t_us", "slot", "change", "ratio" ... and
               "boot", that of the vehicle it belongs to
    counts     lines by kind; "damaged" lines could not be read
    notes      sentences for people about what was lost
    """

    header: dict[str, Any]
    measurements: tuple[Measurement, ...]
    estimates: tuple[dict[str, Any], ...]
    events: tuple[dict[str, Any], ...]
    counts: Counter[str] = field(default_factory=Counter)
    notes: tuple[str, ...] = ()


def read_journal(path: Path) -> JournalReading:
    """Reads a journal, also one whose writer was killed. Raises RecordingError when it is no journal."""
    counts: Counter[str] = Counter()
    measurements: list[Measurement] = []
    others: dict[str, list[dict[str, Any]]] = {"estimate": [], "event": []}
    try:
        with path.open("rb") as file:
            header = _read_header(path, file.readline())
            line, kind = b"\n", ""
            for line in file:
                record = _parse(line)
                kind = next((kind for kind in ("measurement", *others) if kind in record), "damaged")
                if kind == "measurement":
                    measurement = _measurement(record)
                    if measurement is None:
                        kind = "damaged"
                    else:
                        measurements.append(measurement)
                elif kind in others:
                    if record.get("event") == "mismatch" and measurements:
                        record.setdefault("boot", measurements[-1].boot)  # its t_us is on that boot's clock
                    others[kind].append(record)
                counts[kind] += 1
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read ({error.strerror})") from error
    return JournalReading(
        header=header,
        measurements=tuple(measurements),
        estimates=tuple(others["estimate"]),
        events=tuple(others["event"]),
        counts=counts,
        notes=_notes(counts["damaged"], is_cut=kind == "damaged" and not line.endswith(b"\n")),
    )


def _create(place: Path, stem: str) -> tuple[Path, int]:
    is_file = place.suffix == SUFFIX and not place.is_dir()
    folder, first = (place.parent, place.stem) if is_file else (place, stem)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for number in count(1):
            path = folder / f"{first}{'' if number == 1 else f'-{number}'}{SUFFIX}"
            try:
                return path, os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
            except FileExistsError:
                continue
    except OSError as error:
        raise HostError(
            f"{place}: journal cannot be created ({error.strerror}); "
            f"name a folder, or a new file ending in {SUFFIX}"
        ) from error
    raise AssertionError("count() does not end")


def _file_name(text: str) -> str:
    return "".join(c if c.isalnum() or c in "._-" else "_" for c in text).strip(".") or "vehicle"


def _finite(value: Any) -> Any:
    """JSON has no NaN and no infinity."""
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _parse(line: bytes) -> dict[str, Any]:
    try:
        record = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return record if isinstance(record, dict) else {}


def _read_header(path: Path, line: bytes) -> dict[str, Any]:
    header = _parse(line)
    if "journal" not in header:
        cause = "its first line is no journal header" if line else "it is empty"
        raise RecordingError(f"{path}: is not a journal of this program ({cause})")
    if header["journal"] != SCHEMA:
        raise RecordingError(f"{path}: journal schema must be {SCHEMA} (got {header['journal']!r})")
    return header


def _record(measurement: Measurement) -> dict[str, Any]:
    return {
        "measurement": measurement.quantity,
        "value": measurement.value,
        "t_us": measurement.t_us,
        "source": measurement.source,
        "boot": measurement.boot,
    }


def _measurement(record: dict[str, Any]) -> Measurement | None:
    """None when the line, though JSON, is not what the writer writes."""
    try:
        quantity = Quantity(record["measurement"])
        value, t_us, boot = float(record["value"]), record["t_us"], record["boot"]
    except (KeyError, ValueError, TypeError, OverflowError):
        return None
    if not math.isfinite(value) or not isinstance(t_us, int) or not isinstance(boot, int):
        return None
    source = str(record.get("source", ""))
    return Measurement(quantity=quantity, value=value, t_us=t_us, source=source, boot=boot)


def _notes(damaged: int, is_cut: bool) -> tuple[str, ...]:
    notes = []
    if is_cut:
        notes.append("the last line is cut: the program was stopped while writing it")
    if damaged > is_cut:
        notes.append(f"{damaged - is_cut} damaged lines were left out")
    return tuple(notes)
