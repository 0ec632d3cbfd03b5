"""Reads back a recording of the trial."""

import csv
from math import nan
from pathlib import Path

import numpy as np
import numpy.typing as npt


def read_recorded(path: Path) -> dict[str, npt.NDArray[np.float64]]:
    """Columns as arrays, NaN where a cell is empty."""
    with path.open(newline="", encoding="utf-8") as file:
        header, *rows = list(csv.reader(file))
    values = np.array([[float(cell) if cell else nan for cell in row] for row in rows])
    return dict(zip(header, values.T, strict=True))
