"""How much of what a model leaves drifts: the likeliest variances and time constants of host.noise.drift."""

from dataclasses import replace
from itertools import combinations, product

import numpy as np
from scipy.optimize import minimize

from host.noise.drift import NOTHING, Drift, log_likelihood
from host.recordings.recording import Array

SENSOR, WATER = "wander", "current"
Longest = dict[str, float]
"""What may drift in a channel, and for less than how long, s."""
# A pitch that is off for longer is the trim of the vehicle, whose depth follows; such a depth is the water's.
OF_PITCH: Longest = {SENSOR: 5.0}
OF_DEPTH: Longest = {SENSOR: 10.0, WATER: 120.0}
FIRST_TIMES, FIRST_SIZES = (0.5, 2.0, 8.0, 30.0), (1.0, 30.0)  # s, and variance of what drifts in such a time
NEARLY = 0.98  # as long as may be: it would last longer
APART = 3.0  # times the step, what lasts no longer is white
LEAST, MOST = 1e-6, 1e8  # variance in units of the white noise
CLOSE_ENOUGH = 2e-6  # of the log-likelihood
STRIDE = 1e-3  # of a logarithm of a level, for slopes


def likeliest_drift(
    drifts: list[Drift], residuals: list[Array], longest: Longest
) -> dict[str, tuple[float, float]]:
    """The kinds that pay, of these, with their levels; none where all that is left is white.

    What would drift for longer than may be is something else, and is not told.

    drifts     what drifts anyway, in each recording
    residuals  (N,) of the free run in each
    """
    count = sum(float(drift.present.sum()) for drift in drifts)
    step = float(np.median(np.concatenate([drift.interval for drift in drifts])))
    best: dict[str, tuple[float, float]] = {}
    least = np.inf
    told = [kind for kind, most in longest.items() if most > APART * step]  # from white noise
    for kinds in (kinds for size in range(len(told) + 1) for kinds in combinations(told, size)):
        levels, likelihood = _fitted(drifts, residuals, {kind: longest[kind] for kind in kinds}, step)
        bic = 2.0 * len(kinds) * np.log(count) - 2.0 * likelihood
        if bic < least and all(time < NEARLY * longest[kind] for kind, (_, time) in levels.items()):
            best, least = levels, bic
    return best


def _fitted(
    drifts: list[Drift], residuals: list[Array], longest: Longest, step: float
) -> tuple[dict[str, tuple[float, float]], float]:
    """The likeliest levels of these kinds, and the log-likelihood there."""

    def levels(logs: Array) -> dict[str, tuple[float, float]]:
        pairs = np.exp(logs).reshape((-1, 2)).tolist()
        return {kind: (variance, time) for kind, (variance, time) in zip(longest, pairs, strict=True)}

    def cost(logs: Array) -> float:
        own = levels(logs)
        wander, current = own.get(SENSOR, NOTHING), own.get(WATER, NOTHING)
        return -log_likelihood([replace(d, wander=wander, current=current) for d in drifts], residuals)

    if not longest:
        return {}, -cost(np.zeros(0))
    bounds = [np.log(pair) for most in longest.values() for pair in ((LEAST, MOST), (step, most))]
    first = min(_starts(longest, step), key=cost)
    end = minimize(
        cost, first, method="L-BFGS-B", bounds=bounds, options={"ftol": CLOSE_ENOUGH, "eps": STRIDE}
    )
    return levels(end.x), -float(end.fun)


def _starts(longest: Longest, step: float) -> list[Array]:
    """Logarithms to begin with: of every time constant, what wanders by as much as the white noise, or more.

    Water that moves so in its time constant.
    """
    choices = []
    for kind, most in longest.items():
        times = [time for time in FIRST_TIMES if step < time <= most] or [np.sqrt(step * most)]
        per_size = [1.0 / time**2 if kind == WATER else 1.0 for time in times]
        pairs = zip(times, per_size, strict=True)
        choices.append([(size * unit, time) for time, unit in pairs for size in FIRST_SIZES])
    return [np.log(np.ravel(start)) for start in product(*choices)]
