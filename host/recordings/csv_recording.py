"""Text recordings: one row per instant, columns named and scaled by the vehicle file."""

import csv
from collections import Counter
from pathlib import Path

import numpy as np

from bridge.measurement import Quantity
from bridge.measurement_gate import LARGEST
from host.errors import RecordingError
from host.recordings.clock_time import clock_seconds
from host.recordings.csv_map import UNITS, CsvColumn, CsvMap
from host.recordings.plane_in_table import plane_readings
from host.recordings.recording import NEEDED, Array, Recording, file_sha256, split_at_gaps
from host.recordings.resampled import readings_alone
from host.recordings.rounded_time import evenly_told

CHANNELS = ("depth", "pitch", "rudder", "speed", "pitch_rate")
_MANY = 0.1  # share of a column
_SELDOM = 0.05  # of the rows: as many may follow too soon
_LONGEST_STEP = 30.0  # s


def read_csv_recording(path: Path, columns: CsvMap, needs: tuple[str, ...] = NEEDED) -> list[Recording]:
    """The stretches of a text recording, row by row; several when it has gaps.

    Raises RecordingError with one line as `read_table` does, or when it holds no usable stretch.
    """
    return stretches_of(read_table(path, columns, needs), path, needs)


def stretches_of(table: Recording, path: Path, needs: tuple[str, ...]) -> list[Recording]:
    """A table cut at its gaps; what only fills a row between two readings is "not measured".

    Raises RecordingError with one line when nothing usable is in it.
    """
    pieces = split_at_gaps(readings_alone(table), max(1.0, 2.5 * table.step), needs)
    if not pieces:
        raise RecordingError(
            f"{path}: no stretch of 10 rows has {', '.join(needs)} together ({_summary(table.counts)})"
        )
    return pieces


def read_table(path: Path, columns: CsvMap, needs: tuple[str, ...] = NEEDED) -> Recording:
    """All rows of a text recording, separated by comma, semicolon or tab; its rudder may be NaN, too.

    Rows whose time is missing, repeated or runs backwards are dropped and counted; any other cell that is
    empty or not a finite number is "not measured".
    Raises RecordingError with one line when the file is empty, is no text or lacks a column.
    """
    header, rows, decimal = _read_rows(path)
    counts: Counter[str] = Counter(rows=len(rows))
    values: dict[str, Array] = {}
    for quantity in ("time", *CHANNELS):
        column: CsvColumn = getattr(columns, quantity)
        found = header.count(column.column)
        if found == 1:
            raw = _numbers(rows, header.index(column.column), decimal)
            counts[f"missing.{quantity}"] = int(np.isnan(raw).sum())
            values[quantity] = _in_si(path, quantity, column, raw, counts)
            if quantity == "time" and np.isnan(raw).all():
                values["time"] = clock_seconds(_cells(rows, header.index(column.column)))
                counts["missing.time"] = int(np.isnan(values["time"]).sum())
        elif found > 1:
            raise RecordingError(f"{path}: column {column.column!r} is in the file {found} times; keep one")
        elif quantity in CHANNELS and quantity not in needs:
            values[quantity] = np.full(len(rows), np.nan)
        else:
            raise RecordingError(
                f"{path}: column {column.column!r} for {quantity} is not in the file "
                f"(it has: {', '.join(header)}); name yours in the vehicle file under [csv.{quantity}]"
            )
    if np.isnan(values["time"]).all() and rows:
        named = columns.time.column
        example = next(filter(None, _cells(rows, header.index(named))), "")
        raise RecordingError(
            f"{path}: column {named!r} for time holds neither seconds nor times as 2026-03-01T12:00:00.5 "
            f"or 12:00:00.5 (got {example!r})"
        )
    notes: tuple[str, ...] = ()
    repeats, are_rows_twice = _repeated_times(values)
    if not are_rows_twice and (even := evenly_told(values["time"])) is not None:
        values["time"], step = even
        notes = (f"its times are rounded to {step:.3g} s: the rows are taken as evenly spaced",)
    elif repeats > _MANY and not are_rows_twice:
        notes = ("many rows repeat the time of the row before, and are left out: is it rounded?",)
    keep = _advancing(values["time"], counts)
    values = {quantity: column[keep] for quantity, column in values.items()}
    if keep.sum() < 10:
        raise RecordingError(
            f"{path}: only {int(keep.sum())} rows have a time that advances; at least 10 are needed"
        )
    step = float(np.median(np.diff(values["time"])))
    if step > _LONGEST_STEP:
        raise RecordingError(
            f"{path}: rows are {step:.3g} s apart, too far to see any motion; a time in milliseconds needs "
            'unit = "ms" under [csv.time]'
        )
    time = values["time"] - values["time"][0]
    return Recording(
        name=path.name,
        sha256=file_sha256(path),
        time=time,
        depth=values["depth"],
        pitch=values["pitch"],
        rudder=values["rudder"],
        speed=values["speed"],
        pitch_rate=values["pitch_rate"],
        step=step,
        has_angle=columns.rudder.unit != "raw" or columns.rudder.scale != 1.0,
        plane=plane_readings(time, values["rudder"], _pace(time[np.isfinite(values["pitch"])], step)),
        counts=counts,
        notes=notes,
    )


def _pace(time: Array, usual: float) -> float:
    """s from row to row where none is lost; of rows that come at any time `usual`."""
    return min(float(np.quantile(np.diff(time), _SELDOM)), usual) if time.size > 1 else usual


def _repeated_times(values: dict[str, Array]) -> tuple[float, bool]:
    """Share of the rows that repeat the time of the row before, and whether most of them say the same."""
    again = np.flatnonzero(np.diff(values["time"]) == 0.0)
    channels = np.array([values[name] for name in CHANNELS])
    same = (channels[:, again] == channels[:, again + 1]) | np.isnan(channels[:, again])
    return again.size / values["time"].size, bool(again.size and np.mean(same.all(axis=0)) >= 0.5)


def _read_rows(path: Path) -> tuple[list[str], list[list[str]], str]:
    """Header, rows and decimal mark; the separator is the one that the header has most of."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            text = [line for line in file if not line.startswith("#")]
        separator = max(",;\t", key=text[0].count) if text else ","
        lines = list(csv.reader(text, delimiter=separator))
    except UnicodeDecodeError as error:
        raise RecordingError(
            f"{path}: is not UTF-8 text (byte {error.start}); give a .csv with a header row, saved as UTF-8"
        ) from error
    except csv.Error as error:
        raise RecordingError(
            f"{path}: is not a text table ({error}); give a .csv with a header row"
        ) from error
    if not lines:
        raise RecordingError(f"{path}: is empty; a recording has a header row and one row per instant")
    header = [name.strip() for name in lines[0]]
    decimal = "," if separator == ";" else "."  # as spreadsheets write where the comma is the decimal mark
    return header, [row for row in lines[1:] if row], decimal


def _cells(rows: list[list[str]], index: int) -> list[str]:
    return [row[index] if index < len(row) else "" for row in rows]


def _numbers(rows: list[list[str]], index: int, decimal: str) -> Array:
    def number(cell: str) -> float:
        try:
            return float(cell.replace(decimal, "."))
        except ValueError:
            return np.nan

    column = np.array([number(cell) for cell in _cells(rows, index)], dtype=float)
    column[~np.isfinite(column)] = np.nan
    return column


def _in_si(path: Path, quantity: str, column: CsvColumn, raw: Array, counts: Counter[str]) -> Array:
    """Values that no vehicle has are counted and not measured; many of them mean a wrong unit."""
    values: Array = raw * (column.sign * UNITS[quantity][column.unit] * column.scale) + column.offset
    if quantity == "time":
        return values
    limit = LARGEST[Quantity(quantity)]
    beyond = np.abs(values) > limit
    if beyond.sum() > _MANY * np.isfinite(values).sum():
        raise RecordingError(
            f"{path}: {quantity} must be within {limit:.4g} in SI units (got {np.nanmax(abs(values)):.4g} "
            f"from {column.column!r} in {column.unit!r}); set unit and scale under [csv.{quantity}]"
        )
    counts[f"refused.range.{quantity}"] = int(beyond.sum())
    return np.where(beyond, np.nan, values)


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
