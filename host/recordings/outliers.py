"""Spikes of a recording: bad frames, dropouts of a sonar, values that belong to no motion of the vehicle.

A window of 13 measured values is smooth if a cubic passes through them as closely as through most windows of
the channel, the worst value of each aside. Where it is not, up to four of the inner values are left out, as
few as will do: with residuals e = (I - H) y of the whole window, leaving out the set D takes
e_D^T (I - H_DD)^-1 e_D from their squares, and (I - H_DD)^-1 e_D is how far D lies from the cubic through the
rest (Cook and Weisberg, Residuals and Influence in Regression, 1982, ch. 3). Only values far off the rest are
spikes: a quick manoeuvre or a wave bends the rest as well, and after a step the motion does not come back.
"""

from collections import Counter
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from host.recordings.recording import Array, Recording

CHANNELS = ("depth", "pitch", "speed", "pitch_rate")
WINDOW = 13  # values
COEFFICIENTS = 4  # of a cubic
FREEDOM = WINDOW - COEFFICIENTS
TYPICAL = 5.0  # median of the squares that unit white noise leaves in a window without its worst inner value
LONGEST = 4  # spikes in one window
FEW = 3  # spikes; more may be the motion's own, and must be twice as far off
FLANK = 2  # values at either end that show the motion before and after
ROUGH = 1.5  # of the usual scatter, above which a window is not smooth
FAR = 8.0  # of the usual scatter, off a smooth rest
FAR_OFF_ROUGH = 12.0  # of the rest's own scatter, where that is not smooth
MOST_PASSES = 8  # what one pass leaves out uncovers what lay beside it

Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]
Found = dict[str, Mask]


def without_outliers(recordings: list[Recording]) -> list[Recording]:
    """The recordings with their spikes "not measured".

    `counts` and `notes` say of each file how many: "outlier.depth" and so on.
    """
    found = [{name: outliers(each.time, getattr(each, name)) for name in CHANNELS} for each in recordings]
    cleaned = []
    for recording, spikes in zip(recordings, found, strict=True):
        of_file = [pair for pair in zip(recordings, found, strict=True) if pair[0].name == recording.name]
        counts, notes = _told(of_file)
        values: dict[str, Any] = {
            name: np.where(mask, np.nan, getattr(recording, name))
            for name, mask in spikes.items()
            if mask.any()
        }
        cleaned.append(
            replace(recording, **values, counts=recording.counts + counts, notes=(*recording.notes, *notes))
        )
    return cleaned


def _told(of_file: list[tuple[Recording, Found]]) -> tuple[Counter[str], list[str]]:
    counts: Counter[str] = Counter()
    notes = []
    for name in CHANNELS:
        count = sum(int(spikes[name].sum()) for _, spikes in of_file)
        if count:
            measured = sum(int(np.isfinite(getattr(recording, name)).sum()) for recording, _ in of_file)
            counts[f"outlier.{name}"] = count
            notes.append(told(name, count, measured))
    return counts, notes


def told(name: str, count: int, measured: int) -> str:
    """The note on a channel's spikes."""
    return f"{count} of {measured} {name.replace('_', ' ')} values lie off their neighbours and were left out"


def outliers(time: Array, values: Array) -> Mask:
    """Which of the values (N,), measured at `time` (N,) s or NaN, are spikes; none of fewer than 26."""
    spikes = np.zeros(values.size, dtype=bool)
    for _ in range(MOST_PASSES):
        rows = np.flatnonzero(np.isfinite(values) & ~spikes)
        found = _one_pass(time[rows], values[rows])
        if not found.any():
            break
        spikes[rows[found]] = True
    return spikes


class _Windows:
    """All windows of a channel: residuals e (M, 13) of their cubics, H = Q Q^T, and the usual scatter."""

    def __init__(self, time: Array, values: Array) -> None:
        self.instants, self.values = sliding_window_view(time, WINDOW), sliding_window_view(values, WINDOW)
        share = (self.instants - self.instants[:, :1]) / (self.instants[:, -1:] - self.instants[:, :1])
        self.Q = np.linalg.qr((2.0 * share - 1.0)[:, :, None] ** np.arange(COEFFICIENTS))[0]
        y = self.values - self.values[:, :1]
        self.e = y - np.einsum("nai,nbi,nb->na", self.Q, self.Q, y, optimize=True)
        self.squares = np.sum(self.e**2, axis=1)
        self.interval = float(np.median(np.diff(time)))
        self.usual = max(self._scatter(), _rounding(values))

    def _scatter(self) -> float:
        """Standard deviation about most cubics, each without the one inner value that fits it least."""
        at = np.arange(len(self.e))
        least = np.min([self.without(at, (k,))[0] for k in range(FLANK, WINDOW - FLANK)], axis=0)
        return float(np.sqrt(max(np.median(least), 0.0) / TYPICAL))

    def without(self, at: Rows, D: tuple[int, ...]) -> tuple[Array, Array]:
        """Of the windows `at`: squares that are left without D, and deviations that D is off, the least."""
        inside = list(D)
        e_D, Q_D = self.e[at][:, inside], self.Q[at][:, inside]
        spread = np.linalg.inv((1.0 + 1e-9) * np.eye(len(D)) - np.einsum("nai,nbi->nab", Q_D, Q_D))
        away = np.einsum("nab,nb->na", spread, e_D)
        off = np.abs(away) / np.sqrt(np.einsum("naa->na", spread)) / self._stretch(at, D)[:, None] ** 2
        if D[0] < FLANK or D[-1] >= WINDOW - FLANK:
            moved = np.ptp(np.delete(self.values[at], inside, axis=1), axis=1)
            off = np.where(np.abs(away) > moved[:, None], off, 0.0)
        return self.squares[at] - np.sum(e_D * away, axis=1), off.min(axis=1)

    def _stretch(self, at: Rows, D: tuple[int, ...]) -> Array:
        """How many times as long as usual the intervals are about D: the longer, the less is known there."""
        instants, stretch = self.instants[at], np.ones(at.size)
        for k in D:
            before = next((i for i in range(k - 1, 0, -1) if i not in D), 0)
            after = next((i for i in range(k + 1, WINDOW) if i not in D), WINDOW - 1)
            mean = (instants[:, after] - instants[:, before]) / (after - before)
            stretch = np.maximum(stretch, mean / self.interval)
        return stretch


def _one_pass(time: Array, values: Array) -> Mask:
    spikes = np.zeros(values.size, dtype=bool)
    if values.size < 2 * WINDOW:
        return spikes
    windows = _Windows(time, values)
    rough = np.flatnonzero(windows.squares > FREEDOM * (ROUGH * windows.usual) ** 2)
    for count in range(1, LONGEST + 1):
        least, off = np.full(rough.size, np.inf), np.zeros(rough.size)
        rows = np.zeros((rough.size, count), dtype=int)
        for D in combinations(range(WINDOW), count):
            is_open = np.ones(rough.size, dtype=bool)
            if D[0] < FLANK:  # only at the ends of the recording must one side do
                is_open &= rough == 0
            if D[-1] >= WINDOW - FLANK:
                is_open &= rough == len(windows.e) - 1
            at = np.flatnonzero(is_open)
            left, far = windows.without(rough[at], D)
            is_less = left < least[at]
            at = at[is_less]
            least[at], off[at] = left[is_less], far[is_less]
            rows[at] = rough[at, None] + D
        scatter = np.sqrt(np.maximum(least, 0.0) / (FREEDOM - count))
        is_smooth = scatter <= ROUGH * windows.usual
        gate = (1 + (count > FEW)) * np.where(
            is_smooth, FAR * np.maximum(scatter, windows.usual), FAR_OFF_ROUGH * scatter
        )
        spikes[rows[off > gate]] = True
        rough = rough[~is_smooth & (off <= gate)]
    return spikes


def _rounding(values: Array) -> float:
    """Standard deviation of rounding to a resolution, taken for the smaller steps from value to value."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 0.0]
    return float(np.quantile(steps, 0.2)) / 12.0**0.5 if steps.size else 0.0
