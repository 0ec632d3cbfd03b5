"""What a recording leaves open: parameters, combinations of parameters, and whole modes.

A combination is an eigenvector of the Fisher information's inverse, each parameter scaled by the deviation at
which it would be worth nothing; a deviation above one along it means that the recording does not tell the
parameters in it apart, however well each would be known if the others were.
"""

from dataclasses import dataclass

import numpy as np

from host.dynamics.equations import NAMES, PARAMETERS
from host.likelihood.gauss_newton import Mask
from host.recordings.recording import Array

JUDGED = ("a1", "a2", "a3", "b1", "b2", "u0")
PART_OF_IT = 0.3  # of the largest component: smaller ones do not belong to a combination
HEAVE_STEPS = "plane steps of 1 to 8 s with the depth hold off, so that the plane's own force moves heave"
QUICK_STEPS = "quick plane reversals (3-2-1-1) that make the pitch overshoot"
HELD_PITCH = "held pitch of both signs for ten seconds or more, or record the speed"
MANOEUVRE = {
    "a1": HEAVE_STEPS,
    "b1": HEAVE_STEPS,
    "a2": QUICK_STEPS,
    "a3": "plane steps held until the pitch settles, at several angles",
    "b2": "plane steps large against the pitch noise",
    "u0": HELD_PITCH,
}
"""The manoeuvre that shows each parameter."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Combination:
    """Parameters that the recording knows only together.

    change     how they may change together, by name, SI units: one standard deviation along the combination
    manoeuvre  what would tell them apart
    """

    change: dict[str, float]
    manoeuvre: str

    @property
    def sentence(self) -> str:
        """For a person."""
        units = {parameter.name: parameter.unit for parameter in PARAMETERS}
        names = list(self.change)
        along = ", ".join(f"{name} {self.change[name]:+.2g} {units[name]}" for name in names)
        return (
            f"{', '.join(names[:-1])} and {names[-1]} are known only together, along ({along}): "
            f"the motion hardly changes when they change so. To tell them apart: {self.manoeuvre}."
        )


def undetermined(parameters: Array, covariance: Array, free: Mask) -> list[str]:
    """Names of the parameters that the recording leaves open: a 95 % interval as wide as the value itself."""
    std = np.sqrt(np.diag(covariance))
    worthless = _worthless(parameters)
    return [name for name in JUDGED if free[NAMES.index(name)] and std[NAMES.index(name)] > worthless[name]]


def left_open(parameters: Array, stds: Array) -> str:
    """A sentence about parameters that a recording in which nothing is missing does not tell; else empty."""
    if not (names := undetermined(parameters, np.diag(stds**2), stds > 0.0)):
        return ""
    return (
        f"But it leaves {', '.join(names)} open, so that what is missing there might not show. "
        f"To decide: {_telling_apart(set(names))}."
    )


def open_combinations(parameters: Array, covariance: Array, free: Mask) -> list[Combination]:
    """The combinations of two parameters and more that the recording leaves open, the worst first."""
    names = [name for name in JUDGED if free[NAMES.index(name)]]
    at = [NAMES.index(name) for name in names]
    worthless = _worthless(parameters)
    scale = np.array([min(max(worthless[name], 1e-12), 1e12) for name in names])
    values, vectors = np.linalg.eigh(covariance[np.ix_(at, at)] / np.outer(scale, scale))
    # Deviations if all others were known: what is open by itself is no matter of combinations.
    alone = 1.0 / np.sqrt(np.sum(vectors**2 / np.maximum(values, 1e-12), axis=1))
    found = []
    for value, vector in zip(values[::-1], vectors.T[::-1], strict=True):
        largest = np.abs(vector).max()
        order = [k for k in np.argsort(-np.abs(vector)) if alone[k] < 1.0]
        parts = [k for k in order if abs(vector[k]) > PART_OF_IT * largest]
        if value > 1.0 and len(parts) > 1:
            change = {
                names[k]: float(np.sqrt(value) * vector[k] * np.sign(vector[parts[0]]) * scale[k])
                for k in parts
            }
            found.append(Combination(change=change, manoeuvre=_telling_apart(set(change))))
    return found


def ambiguity(parameters: Array, rival: Array) -> str:
    """A sentence about another mode that explains the recording almost as well."""
    values = zip(NAMES, parameters.tolist(), rival.tolist(), strict=False)
    both = {name: (one, other) for name, one, other in values if name in JUDGED and other != one}
    if not both:
        return "Two answers explain the recording almost equally well: they differ in the effects alone."
    apart = {name: pair for name, pair in both.items() if _change(pair) > 0.1}
    apart = apart or {name: both[name] for name in [max(both, key=lambda name: _change(both[name]))]}
    listed = ", ".join(f"{name} = {other:.4g} instead of {one:.4g}" for name, (one, other) in apart.items())
    return (
        f"Two answers explain the recording almost equally well; the other has {listed}. "
        f"To decide: {_telling_apart(set(apart))}."
    )


def _change(pair: tuple[float, float]) -> float:
    """Of the second value against the first."""
    return abs(pair[1] - pair[0]) / max(abs(pair[0]), 1e-12)


def _worthless(parameters: Array) -> dict[str, float]:
    """Deviations at which a value says nothing.

    The plane's heave force and the heave damping count against the depth that pitching gives, for on most
    vehicles they are small: b1 is known when its share of the steady climb is known to a quarter.
    """
    values = dict(zip(NAMES, parameters.tolist(), strict=False))
    limits = {name: 0.5 * abs(values[name]) for name in JUDGED}
    climb_by_pitch = abs(values["u0"] * values["b2"] / values["a3"]) if values["a3"] else np.inf
    limits["b1"] = 0.25 * abs(values["a1"]) * climb_by_pitch
    return limits


def _telling_apart(names: set[str]) -> str:
    """Gains and dampings part in quick motion, the speed in slow."""
    if names <= {"a2", "a3", "b2"}:
        return QUICK_STEPS
    if "u0" in names and names & {"a1", "b1"}:
        return f"{HEAVE_STEPS}; then {HELD_PITCH}"
    return "; ".join(dict.fromkeys(MANOEUVRE[name] for name in JUDGED if name in names))
