"""How a package's model is chosen and run: one rule for all of them."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol

import numpy as np
from scipy.optimize import least_squares

from host.recordings.recording import Array, Recording
from tools.compare.series import Series, series_of

FreeRun = Callable[[Recording], Array]
"""Pitch and depth (2, N) at the recording's rows; of what was measured it sees the first 5 s."""

UNITS = np.array([[0.00175], [0.01]])  # 0.1 deg, 1 cm: weights of a start, as in host.identification.predict
CHOSEN_ON = 0.7  # share of the series that a candidate learns from; the rest chooses among them
RUNAWAY = 1e6  # in UNITS


class Model(Protocol):
    """What a package has learnt."""

    def guess(self, series: Series) -> Array:
        """A start from the opening of the series."""

    def run(self, start: Array, plane: Array) -> Array:
        """Pitch and depth (2, N) of the free run."""


Learner = Callable[[Series], Model]


def best_of(learners: Sequence[tuple[int, Learner]], teaching: list[Recording]) -> FreeRun:
    """The best of a grid, chosen by free run over the last 30 % of what it may learn from, then learnt anew.

    learners  (rows to a step, learner). The packages take one uninterrupted record: the longest one teaches.
    Raises ValueError when none of them gives a model.
    """
    longest = max(teaching, key=lambda recording: recording.duration)
    ranked = []
    for i, (every, learn) in enumerate(learners):
        series = series_of(longest, every)
        try:
            error = _error(learn(series.part(0.0, CHOSEN_ON)), series.part(CHOSEN_ON, 1.0))
        except (ValueError, np.linalg.LinAlgError, FloatingPointError, IndexError):
            continue
        ranked.append((error, i))
    for _, i in sorted(ranked):
        every, learn = learners[i]
        try:
            model = learn(series_of(longest, every))
        except (ValueError, np.linalg.LinAlgError, FloatingPointError, IndexError):
            continue
        return partial(run_on, model, every)
    raise ValueError("no setting gave a model")


def run_on(model: Model, every: int, recording: Recording) -> Array:
    """The free run at the recording's own rows."""
    series = series_of(recording, every)
    outputs = free_run(model, series)
    return np.array([np.interp(recording.time, series.time, y) for y in outputs])


def free_run(model: Model, series: Series) -> Array:
    """Free run from the start that meets the opening best."""
    plane, seen = series.plane[: series.opening], series.outputs[:, : series.opening]

    def misses(start: Array) -> Array:
        with np.errstate(all="ignore"):
            errors = (model.run(start, plane) - seen) / UNITS
        return np.asarray(np.clip(np.nan_to_num(errors, nan=RUNAWAY), -RUNAWAY, RUNAWAY).ravel())

    start = least_squares(misses, model.guess(series), x_scale="jac", max_nfev=20).x
    with np.errstate(all="ignore"):
        return model.run(start, series.plane)


def _error(model: Model, series: Series) -> float:
    """Squared error after the opening over the variance of each channel, both together."""
    after = slice(series.opening, None)
    truth = series.outputs[:, after]
    with np.errstate(all="ignore"):
        errors = free_run(model, series)[:, after] - truth
        total = float(np.sum(np.mean(errors**2, axis=1) / np.maximum(np.var(truth, axis=1), 1e-12)))
    return total if np.isfinite(total) else np.inf
