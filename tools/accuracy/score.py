"""What many dives say about a method."""

from dataclasses import dataclass

import numpy as np

from tools.accuracy.dive import Array, Dive, fly, simulate

CONFIDENCE = 1.959964
"""Standard deviations of a 95 % interval."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """Over all dives of a case, by parameter (6,); NaN for what the method does not estimate.

    bias      mean error, percent of the truth
    efficiency  standard deviation of the errors over the Cramér-Rao bound
    honesty   stated standard deviation (root mean square) over the true one
    coverage  percent of the 95 % intervals that hold the truth
    diverged  dives with an answer missing, or further off than 8 bounds and a quarter of the truth
    """

    bias: Array
    efficiency: Array
    honesty: Array
    coverage: Array
    diverged: int
    dives: int


def score(values: Array, stds: Array, bounds: Array, truth: Array) -> Score:
    """values, stds, bounds (S, 6) of S dives."""
    errors = values - truth
    estimated = ~np.isnan(values).all(axis=0)
    limit = np.maximum(8.0 * np.nan_to_num(bounds, nan=0.01), 0.25 * np.abs(truth))
    with np.errstate(invalid="ignore"):
        far = ~(np.abs(errors) <= limit)[:, estimated]
        covered = (np.abs(errors) <= CONFIDENCE * stds).mean(axis=0)
    spread = np.sqrt(np.mean((errors - errors.mean(axis=0)) ** 2, axis=0) * len(errors) / (len(errors) - 1))
    spread = np.where(spread > 0.0, spread, np.nan)
    return Score(
        bias=100.0 * errors.mean(axis=0) / np.abs(truth),
        efficiency=spread / np.sqrt(np.mean(bounds**2, axis=0)),
        honesty=np.sqrt(np.mean(stds**2, axis=0)) / spread,
        coverage=np.where(np.isnan(spread), np.nan, 100.0 * covered),
        diverged=int(far.any(axis=1).sum()),
        dives=len(values),
    )


def free_run_fit(dive: Dive, values: Array) -> Array:
    """Fit in percent of pitch and depth (2,) on another dive of the same case, started from its true state.

    100 (1 - |y - yhat|/|y - mean y|) against noise-free outputs; trims are those of the other dive.
    """
    other = fly(dive.case, 10_000_019)
    known = np.where(np.isfinite(values), values, dive.case.vehicle)
    truth = simulate(dive.case, np.array(dive.case.vehicle), other.rudder, other.start, other.trim[:, None])[
        2:
    ]
    model = simulate(dive.case, known, other.rudder, other.start, other.trim[:, None])[2:]
    if not np.isfinite(model).all():
        return np.full(2, -np.inf)
    miss = np.linalg.norm(truth - model, axis=1)
    return np.asarray(100.0 * (1.0 - miss / np.linalg.norm(truth - truth.mean(axis=1)[:, None], axis=1)))
