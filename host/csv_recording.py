"""Text recordings: one row per instant, columns named and scaled by the vehicle file."""

import csv
from collections import Counter
from pathlib import Path

import numpy as np

from host.csv_map import UNITS, CsvColumn, CsvMap
from host.errors import RecordingError
from host.recording import NEEDED, Array, Recording, file_sha256, split_at_gaps

CHANNELS = ("depth", "pitch", "rudder", "speed", "pitch_rate")


def read_csv_recording(path: Path, columns: CsvMap, needs: tuple[str, ...] = NEEDED) -> list[Recording]:
    """Reads a text recording; several stretches when it has gaps.

    Rows whose time is missing, repeated or runs backwards are dropped and counted; any other cell that is
    empty or not a finite number is "not measured". Raises RecordingError with one line when the file is
    empty, is no text, lacks a column, or holds no usable stretch.
    """
    header, rows = _read_rows(path)
    counts: Counter[str] = Counter(rows=len(rows))
    values: dict[str, Array] = {}
    for quantity in ("time", *CHANNELS):
        column: CsvColumn = getattr(columns, quantity)
        if column.column in header:
            raw = _numbers(rows, header.index(column.column))
            factor = column.sign * UNITS[quantity][column.unit] * column.scale
            values[quantity] = raw * factor + column.offset
            counts[f"missing.{quantity}"] = int(np.isnan(raw).sum())
        elif quantity in CHANNELS and quantity not in needs:
            values[quantity] = np.full(len(rows), np.nan)
        else:
            raise RecordingError(
                f"{path}: column {column.column!r} for {quantity} is not in the file "
                f"(it has: {', '.join(header)}); name yours in the vehicle file under [csv.{quantity}]"
            )
    keep = _advancing(values["time"], counts)
    values = {quantity: column[keep] for quantity, column in values.items()}
    if keep.sum() < 10:
        raise RecordingError(
            f"{path}: only {int(keep.sum())} rows have a time that advances; at least 10 are needed"
        )
    step = float(np.median(np.diff(values["time"])))
    whole = Recording(
        name=path.name,
        sha256=file_sha256(path),
        time=values["time"] - values["time"][0],
        depth=values["depth"],
        pitch=values["pitch"],
        rudder=values["rudder"],
        speed=values["speed"],
        pitch_rate=values["pitch_rate"],
        step=step,
        counts=counts,
    )
    pieces = split_at_gaps(whole, max(1.0, 2.5 * step), needs)
    if not pieces:
        raise RecordingError(
            f"{path}: no stretch of 10 rows has {', '.join(needs)} together ({_summary(counts)})"
        )
    return pieces


def _read_rows(path: Path) -> tuple[list[str], list[list[str]]]:
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = list(csv.reader(line for line in file if not line.startswith("#")))
    except (UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(
            f"{path}: is not a text table ({error.__class__.__name__}); give a .csv with a header row"
        ) from error
    if not lines:
        raise RecordingError(f"{path}: is empty; a recording has a header row and one row per instant")
    header = [name.strip() for name in lines[0]]
    return header, [row for row in lines[1:] if row]


def _numbers(rows: list[list[str]], index: int) -> Array:
    def number(row: list[str]) -> float:
        try:
            return float(row[index])
        except (ValueError, IndexError):
            return np.nan

    column = np.array([number(row) for row in rows], dtype=float)
    column[~np.isfinite(column)] = np.nan
    return column


def _advancing(time: Array, counts: Counter[str]) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    finite = np.isfinite(time)
    latest = np.maximum.accumulate(np.where(finite, time, -np.inf))
    before = np.concatenate([[-np.inf], latest[:-1]])
    advancing = finite & (time > before)
    counts["refused.time_missing"] = int((~finite).sum())
    counts["refused.time_not_advancing"] = int((finite & ~advancing).sum())
    return advancing


def _summary(counts: Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.items() if count)
