"""How a recording is kept: sensors slower than its rows, rounded times, rows lost.

Real tables are so, as one clock has to serve sensors of several rates. The plant's own instruments are right
at every row; this stands between them and the file.
"""

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
import numpy.typing as npt

from tools.sitl.recording import Table

Array = npt.NDArray[np.float64]
Fill = Literal["empty", "last", "line"]
FILLS: tuple[Fill, ...] = ("empty", "empty", "last", "line")
DEPTH_HZ = (1.0, 2.0, 4.0)
PLANE_HZ = (2.0, 4.0, 5.0)
TIME_STEPS = (0.01, 0.1, 1.0)  # s


@dataclass(frozen=True, slots=True, kw_only=True)
class Logger:
    """every   by column: rows from one reading to the next, 1 where it is not here
    fill       what stands between two readings: nothing, the last one, or the line to the next
    lost       share of all rows that are not in the file
    time_step  s, to which the times are rounded; 0 for exact ones
    seed       of which rows are lost
    """

    every: dict[str, int]
    fill: Fill = "empty"
    lost: float = 0.0
    time_step: float = 0.0
    seed: int = 0

    @classmethod
    def drawn(cls, rng: np.random.Generator, rate_hz: float) -> Self:
        """With half of all faults absent."""
        every = {}
        if rng.random() < 0.5:
            every["depth_m"] = _rows(rng, DEPTH_HZ, rate_hz)
        if rng.random() < 0.35:
            every["rudder_rad"] = _rows(rng, PLANE_HZ, rate_hz)
        if rng.random() < 0.5:
            every["speed_mps"] = _rows(rng, DEPTH_HZ, rate_hz)
        return cls(
            every=every,
            fill=FILLS[rng.integers(len(FILLS))],
            lost=float(rng.uniform(0.01, 0.3)) if rng.random() < 0.25 else 0.0,
            time_step=float(rng.choice(TIME_STEPS)) if rng.random() < 0.35 else 0.0,
            seed=int(rng.integers(2**31)),
        )

    def told(self) -> dict[str, float | str]:
        """For the answer."""
        rows = {f"{name} every": float(rows) for name, rows in self.every.items() if rows > 1}
        return {**rows, "fill": self.fill, "lost_rows": round(self.lost, 3), "time_step_s": self.time_step}

    def rows(self, count: int) -> npt.NDArray[np.intp]:
        """Which of `count` rows are in the file; the first one always is."""
        if self.lost == 0.0:
            return np.arange(count)
        kept = np.random.default_rng(self.seed).random(count) >= self.lost
        kept[0] = True
        return np.flatnonzero(kept)

    def readings(self, table: Table) -> Table:
        """The rows in the file, and of each column what is really read there; NaN elsewhere."""
        rows = self.rows(len(table["time_s"]))
        seen = {}
        for name, column in table.items():
            seen[name] = column[rows].copy()
            seen[name][rows % self.every.get(name, 1) != 0] = np.nan
        return seen

    def kept(self, table: Table) -> Table:
        """What stands in the file."""
        seen = self.readings(table)
        time = seen["time_s"].copy()
        for name in self.every.keys() & seen.keys():
            seen[name] = _filled(time, seen[name], self.fill)
        if self.time_step > 0.0:
            seen["time_s"] = np.floor(time / self.time_step + 1e-9) * self.time_step
        return seen


def _rows(rng: np.random.Generator, rates_hz: tuple[float, ...], rate_hz: float) -> int:
    return max(round(rate_hz / float(rng.choice(rates_hz))), 1)


def _filled(time: Array, column: Array, fill: Fill) -> Array:
    known = np.flatnonzero(np.isfinite(column))
    if fill == "empty" or known.size == 0:
        return column
    if fill == "line":
        return np.interp(time, time[known], column[known])
    last = np.maximum.accumulate(np.where(np.isfinite(column), np.arange(column.size), 0))
    return column[last]
