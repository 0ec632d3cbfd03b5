"""A recording as the packages want it: equal steps, nothing missing."""

from dataclasses import dataclass

import numpy as np

from host.identification.predict import SETTLING_SPAN
from host.recordings.recording import Array, Recording


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """Equal steps of `step` s.

    plane    (N,) rad, mean over the step that follows
    outputs  (2, N), pitch rad and depth m
    """

    step: float
    time: Array
    plane: Array
    outputs: Array

    @property
    def opening(self) -> int:
        """Rows of the first 5 s, from which alone a free run may learn its start."""
        return int(min(np.ceil(SETTLING_SPAN / self.step), self.time.size))

    def part(self, first: float, last: float) -> "Series":
        """The rows between two shares of its length."""
        rows = slice(round(first * self.time.size), round(last * self.time.size))
        return Series(
            step=self.step, time=self.time[rows], plane=self.plane[rows], outputs=self.outputs[:, rows]
        )


def series_of(recording: Recording, every: int = 1) -> Series:
    """Rows at `every` nominal steps; gaps are bridged by straight lines, the plane held in them."""
    fine = recording.time[0] + recording.step * np.arange(round(recording.duration / recording.step) + 1)
    held = np.searchsorted(recording.time, fine + 1e-9 * recording.step, side="right") - 1
    count = fine.size // every
    outputs = np.array([_bridged(recording.time, y, fine) for y in (recording.pitch, recording.depth)])
    return Series(
        step=recording.step * every,
        time=fine[: count * every : every],
        plane=recording.rudder[held][: count * every].reshape(count, every).mean(axis=1),
        outputs=outputs[:, : count * every : every],
    )


def _bridged(time: Array, values: Array, at: Array) -> Array:
    known = np.isfinite(values)
    return np.asarray(np.interp(at, time[known], values[known]), dtype=np.float64)
