"""A table of the report: shown in HTML, written as CSV, and gathered in one JSON file."""

import csv
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

Cell = str | float | int | None
LINES = "lines"  # format of text whose lines are not to be broken


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Rows of cells under columns.

    name     file name of the CSV, without suffix
    formats  a format for each column's numbers; "" or LINES where the column holds text
    marked   indices of rows to be set off
    """

    name: str
    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[Cell, ...]]
    formats: tuple[str, ...]
    note: str = ""
    marked: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        for row in [self.formats, *self.rows]:
            if len(row) != len(self.columns):
                raise ValueError(f"{self.name}: a row has {len(row)} cells for {len(self.columns)} columns")

    def shown(self) -> list[list[str]]:
        """The cells as text."""
        return [
            [_shown(cell, form) for cell, form in zip(row, self.formats, strict=True)] for row in self.rows
        ]

    def column(self, name: str) -> list[Cell]:
        """The cells of one column."""
        at = self.columns.index(name)
        return [row[at] for row in self.rows]


def _shown(cell: Cell, form: str) -> str:
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return "–"
    if isinstance(cell, float) and math.isinf(cell):
        return "overflow"
    if isinstance(cell, str):
        return str(cell)
    if form.endswith("f") and abs(cell) >= 1e5:
        return f"{cell:.1e}".replace("-", "−")
    return f"{cell:{form}}".replace("-", "−")


def write_tables(tables: list[Table], folder: Path) -> None:
    """One CSV for each table, and tables.json with all of them."""
    for table in tables:
        with (folder / f"{table.name}.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(table.columns)
            writer.writerows(
                [[" ".join(c.split()) if isinstance(c, str) else c for c in row] for row in table.rows]
            )
    document = {
        table.name: {
            "title": table.title,
            "rows": [
                {name: _json(cell) for name, cell in zip(table.columns, row, strict=True)}
                for row in table.rows
            ],
        }
        for table in tables
    }
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    (folder / "tables.json").write_text(text + "\n", encoding="utf-8")


def _json(cell: Cell) -> Cell:
    return None if isinstance(cell, float) and not math.isfinite(cell) else cell
