"""Runs methods over many dives on all cores, and prints what came out."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from tools.accuracy.bound import cramer_rao
from tools.accuracy.dive import NAMES, Array, fly
from tools.accuracy.methods import CASES, METHODS
from tools.accuracy.score import Score, free_run_fit, score

FIRST_SEED = 5000


@dataclass(frozen=True, kw_only=True)
class Line:
    """One line of the table: the score, and the median free-run fit (2,) in percent."""

    case: str
    method: str
    score: Score
    fit: Array


def _one(job: tuple[str, str, int]) -> tuple[Array, Array, Array, Array]:
    case, method, seed = job
    dive = fly(CASES[case], seed)
    with np.errstate(all="ignore"):
        values, std = METHODS[method](dive)
        return values, std, cramer_rao(dive, dive.case.tells_speed), free_run_fit(dive, values)


def measure(
    pairs: list[tuple[str, str]], seeds: int, workers: int, on_progress: Callable[[str], None]
) -> Iterator[Line]:
    """Every pair of case and method on the same `seeds` dives of its case, each as soon as it is flown."""
    with get_context("spawn").Pool(workers) as pool:
        for case, method in pairs:
            jobs = [(case, method, FIRST_SEED + seed) for seed in range(seeds)]
            answers = []
            for answer in pool.imap(_one, jobs):
                answers.append(answer)
                if len(answers) % max(1, seeds // 4) == 0:
                    on_progress(f"{case}, {method}: {len(answers)} of {seeds} dives")
            values, stds, bounds, fits = (np.array(column) for column in zip(*answers, strict=True))
            with np.errstate(all="ignore"):
                result = score(values, stds, bounds, CASES[case].truth)
            yield Line(case=case, method=method, score=result, fit=np.median(fits, axis=0))


def heading() -> str:
    """The names above the columns."""
    return f"{'':36s}" + "".join(f"{name:>9s}" for name in NAMES)


def show(line: Line) -> str:
    """A line of the table as text, in a block of five rows."""
    s, (pitch, depth) = line.score, line.fit
    text = [
        f"{line.case} | {line.method} | diverged {s.diverged} of {s.dives} | "
        f"free run on another dive: pitch {pitch:.2f} %, depth {depth:.2f} %"
    ]
    for name, row, digits in (
        ("bias %", s.bias, 2),
        ("deviation / Cramér-Rao bound", s.efficiency, 2),
        ("stated / actual deviation", s.honesty, 2),
        ("95 % intervals that hold, %", s.coverage, 1),
    ):
        text.append(f"    {name:32s}" + "".join(_number(value, digits) for value in row))
    return "\n".join(text)


def _number(value: float, digits: int) -> str:
    if not np.isfinite(value):
        return f"{'-':>9s}"
    return f"{value:9.{digits}f}" if abs(value) < 1e5 else f"{value:9.1e}"
