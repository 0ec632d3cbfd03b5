"""Held-out free runs of every method on one recording, and the table of them."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from host.errors import RecordingError
from host.identification.predict import SETTLING_SPAN
from host.noise.noise_floor import noise_floor
from host.recordings.recording import Array, Recording
from tools.compare.free_run import FreeRun
from tools.compare.methods import EXTENDED, LINEAR, Teach, extended_model, installed, linear_model

TEACHES = 0.7  # share of the time of all stretches
SHORTEST = 3.0 * SETTLING_SPAN  # s; less of a free run judges nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldOut:
    """Free-run errors after the first 5 s, pitch and depth (2,); `seconds` it took to learn.

    fit   100 (1 - |y - yhat|/|y - mean y|), %
    chi2  mean squared error over the variance of the sensors' noise: 1 where nothing is left to explain
    rmse  rad, m
    """

    method: str
    fit: Array
    chi2: Array
    rmse: Array
    seconds: float


FAILED = np.array([np.nan, np.nan])


def compare(
    recordings: list[Recording],
    on_progress: Callable[[str], None] = lambda _: None,
    methods: dict[str, Teach] | None = None,
) -> list[HeldOut]:
    """Every method (by default the installed packages, the linear model and `mils diagnose`) on one vehicle.

    All learn from the first 70 % and run freely over the rest. Raises RecordingError when that is too short.
    """
    teaching, judging = divide(recordings)
    floor = noise_floor(recordings)
    if methods is None:
        methods = installed() | {LINEAR: linear_model, EXTENDED: extended_model}
    found = []
    for name, teach in methods.items():
        on_progress(name)
        found.append(held_out(name, teach, teaching, judging, floor))
    return found


def divide(recordings: list[Recording]) -> tuple[list[Recording], list[Recording]]:
    """Stretches before and after 70 % of the recorded time."""
    left = TEACHES * sum(recording.duration for recording in recordings)
    teaching: list[Recording] = []
    judging: list[Recording] = []
    for recording in recordings:
        edge = recording.time[0] + left
        left -= recording.duration
        for part, side in (
            (recording.between(-np.inf, edge), teaching),
            (recording.between(edge, np.inf), judging),
        ):
            if part.time.size and part.duration >= SHORTEST and _opens(part):
                side.append(part)
    if not teaching or not judging:
        name = recordings[0].name
        raise RecordingError(f"{name}: too short or with too many gaps to be divided and run freely")
    return teaching, judging


def _opens(part: Recording) -> bool:
    opening = part.between(part.time[0], part.time[0] + SETTLING_SPAN)
    return bool(np.isfinite(opening.pitch).any() and np.isfinite(opening.depth).any())


def held_out(
    name: str, teach: Teach, teaching: list[Recording], judging: list[Recording], floor: Array
) -> HeldOut:
    """One method; NaN where it gives no model."""
    begun = perf_counter()
    try:
        run = teach(teaching)
    except (ValueError, np.linalg.LinAlgError, RecordingError):
        return HeldOut(method=name, fit=FAILED, chi2=FAILED, rmse=FAILED, seconds=perf_counter() - begun)
    seconds = perf_counter() - begun
    return judge(name, run, judging, floor, seconds)


def judge(name: str, run: FreeRun, judging: list[Recording], floor: Array, seconds: float) -> HeldOut:
    """Errors of its free runs over all stretches that judge."""
    squares, spread, count = np.zeros(2), np.zeros(2), np.zeros(2)
    for recording in judging:
        measured = np.array([recording.pitch, recording.depth])
        measured[:, recording.time < recording.time[0] + SETTLING_SPAN] = np.nan
        with np.errstate(all="ignore"):
            off = np.where(np.isfinite(measured), measured - run(recording), 0.0)
            squares += np.sum(np.nan_to_num(off, nan=np.inf) ** 2, axis=1)
        spread += np.nansum((measured - np.nanmean(measured, axis=1)[:, None]) ** 2, axis=1)
        count += np.isfinite(measured).sum(axis=1)
    with np.errstate(all="ignore"):
        return HeldOut(
            method=name,
            fit=100.0 * (1.0 - np.sqrt(squares / spread)),
            chi2=squares / count / floor,
            rmse=np.sqrt(squares / count),
            seconds=seconds,
        )


def median_of(several: list[HeldOut]) -> HeldOut:
    """Of one method over several dives; where it gives no model it is worse than any."""
    fit, chi2, rmse = (np.array([getattr(one, name) for one in several]) for name in ("fit", "chi2", "rmse"))
    return HeldOut(
        method=several[0].method,
        fit=np.median(np.where(np.isnan(fit), -np.inf, fit), axis=0),
        chi2=np.median(np.where(np.isnan(chi2), np.inf, chi2), axis=0),
        rmse=np.median(np.where(np.isnan(rmse), np.inf, rmse), axis=0),
        seconds=float(np.median([one.seconds for one in several])),
    )


def table_of(lines: list[HeldOut]) -> str:
    """The table as text."""
    head = ("pitch fit %", "depth fit %", "pitch chi2", "depth chi2", "pitch deg", "depth m", "s")
    text = [f"{'held-out free run':24s}" + "".join(f"{name:>13s}" for name in head)]
    for line in lines:
        cells = [*line.fit, *line.chi2, np.degrees(line.rmse[0]), line.rmse[1]]
        digits = (2, 2, 2, 2, 3, 4)
        text.append(
            f"{line.method:24s}"
            + "".join(_cell(value, places) for value, places in zip(cells, digits, strict=True))
            + f"{line.seconds:13.1f}"
        )
    return "\n".join(text)


def _cell(value: float, digits: int) -> str:
    if np.isnan(value):
        return f"{'no model':>13s}"
    if not np.isfinite(value) or abs(value) >= 1e6:
        return f"{'diverged':>13s}"
    return f"{value:13.{digits}f}"
