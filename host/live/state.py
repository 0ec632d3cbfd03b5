"""The estimator's memory across restarts of the program: kept whole, or refused and said so."""

import hashlib
import json
import os
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from host.errors import HostError

SCHEMA = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class StateReading:
    """body is None when there is nothing to restore; note says why, or what was restored."""

    body: dict[str, Any] | None
    note: str


def fingerprint(configuration: Mapping[str, Any]) -> str:
    """Equal for equal configurations, whatever the order of their keys."""
    return hashlib.sha256(json.dumps(configuration, sort_keys=True).encode()).hexdigest()[:16]


def save_state(path: Path, body: Mapping[str, Any], *, vehicle: str, configuration: str) -> None:
    """Replaces the file in one step: a loss of power leaves the old state or the new one.

    configuration  `fingerprint` of the keys on which the meaning of the state depends
    Raises HostError when it cannot be written.
    """
    record = {
        "schema": SCHEMA,
        "vehicle": vehicle,
        "configuration": configuration,
        "crc32": _checksum(body),
        "body": body,
    }
    new = path.with_name(path.name + ".new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with new.open("w") as file:
            json.dump(record, file)
            file.flush()
            os.fsync(file.fileno())
        new.replace(path)
        _sync_folder(path.parent)
    except OSError as error:
        raise HostError(f"{path}: state cannot be saved ({error.strerror})") from error


def load_state(path: Path, *, vehicle: str, configuration: str) -> StateReading:
    """The saved state, if it belongs to this vehicle and configuration. Raises nothing.

    A file that is refused is kept under another name, so that the next save does not destroy it.
    """
    try:
        record = json.loads(path.read_bytes())
    except FileNotFoundError:
        return StateReading(body=None, note=f"{path}: no saved state, starting fresh")
    except OSError as error:
        return StateReading(body=None, note=f"{path}: cannot be read ({error.strerror}), starting fresh")
    except (ValueError, RecursionError):
        return _refused(path, "is damaged")
    wanted = {"schema": SCHEMA, "vehicle": vehicle, "configuration": configuration}
    if not isinstance(record, dict) or not isinstance(record.get("body"), dict):
        return _refused(path, "is damaged")
    for key, value in wanted.items():
        if record.get(key) != value:
            return _refused(path, f"was saved with another {key} ({record.get(key)!r}, now {value!r})")
    if record.get("crc32") != _checksum(record["body"]):
        return _refused(path, "is damaged (its checksum does not match)")
    return StateReading(body=record["body"], note=f"{path}: state restored")


def set_aside(path: Path) -> Path | None:
    """Renames a state that cannot be used; None when that fails."""
    for number in count(1):
        kept = path.with_name(f"{path.stem}.refused{number}{path.suffix}")
        if not kept.exists():
            try:
                return path.rename(kept)
            except OSError:
                return None
    raise AssertionError("count() does not end")


def _checksum(body: Mapping[str, Any]) -> int:
    # Python writes a float so that it reads back as the same one: a body that was read gives the same text.
    return zlib.crc32(json.dumps(body, sort_keys=True).encode())


def _refused(path: Path, cause: str) -> StateReading:
    kept = set_aside(path)
    where = f"kept as {kept.name}" if kept else "left in place"
    return StateReading(body=None, note=f"{path}: {cause}, {where}; starting fresh")


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
