"""What makes coefficients of the base equations differ together: a mass, the plane, what rights a hull.

Heave is divided by the mass that heaves, pitch by the inertia that turns, water carried along included, so an
error of either changes all coefficients of its equation by one factor; one of the plane changes b1 and b2.
The fewest such factors that explain all the ratios are told (Occam), each estimated by weighted least squares
of log(given / recorded).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from types import MappingProxyType

import numpy as np
from scipy.stats import chi2, norm

from host.recordings.recording import Array

CAUSES: Mapping[str, Mapping[str, int]] = MappingProxyType(
    {
        "righting_moment": {"a3": 1},
        "plane_force": {"b1": 1, "b2": 1},
        "heave_inertia": {"a1": -1, "b1": -1},
        "pitch_inertia": {"a2": -1, "a3": -1, "b2": -1},
        "heave_damping": {"a1": 1},
        "pitch_damping": {"a2": 1},
    }
)
"""The power of each cause in the coefficients that it changes."""
SIGNIFICANCE = 1e-3  # chance that factors that do explain the ratios are held not to, or that one is 1
ROUGHLY = 0.03  # of a ratio: what is too small to be named on either side bends them so far
CLEARLY = 6.0  # of the misfit, by which another set of as many factors is less likely
TOLD = 5.0  # deviations from zero: a ratio of less says nothing
Value = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Cause:
    """One of CAUSES and how many times as large it is on the other side, with its deviation."""

    name: str
    ratio: float
    std: float

    @property
    def title(self) -> str:
        return self.name.replace("_", " ")


def causes(pairs: Mapping[str, tuple[Value, Value]]) -> list[Cause]:
    """The fewest factors that make the coefficients of one side those of the other; none where none do.

    Of several sets of as many that do about as well, those which all of them hold.

    pairs  each coefficient of the base equations with its deviation, as recorded and as given
    """
    known = {name: pair for name, pair in pairs.items() if _has_ratio(*pair)}
    ratios = np.array([np.log(given[0] / recorded[0]) for recorded, given in known.values()])
    std = np.array([np.hypot(ROUGHLY, _relative(*pair)) for pair in known.values()])
    acting = [name for name, powers in CAUSES.items() if known.keys() & powers.keys()]
    for count in range(len(ratios) + 1):
        found = [_fitted(names, list(known), ratios, std) for names in combinations(acting, count)]
        misfit, logs, deviations, names = min(found, key=lambda one: one[0])
        if misfit <= chi2.isf(SIGNIFICANCE, max(len(ratios) - count, 1)):
            break
    sure = set.intersection(*(set(one[3]) for one in found if one[0] < misfit + CLEARLY))
    least = norm.isf(SIGNIFICANCE / 2.0)
    return [
        Cause(name, float(np.exp(x)), float(np.exp(x) * s))
        for name, x, s in zip(names, logs.tolist(), deviations.tolist(), strict=True)
        if name in sure and abs(x) > least * s
    ]


def _has_ratio(recorded: Value, given: Value) -> bool:
    """Whether both sides tell a coefficient, and have it of one sign."""
    return recorded[0] * given[0] > 0.0 and all(abs(value) > TOLD * std for value, std in (recorded, given))


def _relative(recorded: Value, given: Value) -> float:
    return float(np.hypot(recorded[1] / recorded[0], given[1] / given[0]))


def _fitted(
    names: tuple[str, ...], coefficients: list[str], ratios: Array, std: Array
) -> tuple[float, Array, Array, tuple[str, ...]]:
    """The misfit, the logarithms of these factors and their deviations; no misfit is as large as of twins."""
    design = np.array([[CAUSES[name].get(one, 0) for name in names] for one in coefficients], dtype=float)
    weighted = design.reshape(len(coefficients), len(names)) / std[:, None]
    if np.linalg.matrix_rank(weighted) < len(names):
        return np.inf, np.zeros(len(names)), np.zeros(len(names)), names
    covariance = np.linalg.inv(weighted.T @ weighted)
    logs = covariance @ weighted.T @ (ratios / std)
    misfit = float(np.sum((ratios / std - weighted @ logs) ** 2))
    return misfit, logs, np.sqrt(np.diag(covariance)), names
