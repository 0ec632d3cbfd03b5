"""The other side of a comparison (a model, a simulator), and the recording told in its words."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from host.catalogue import named, structure_of
from host.catalogue.nuisance import PLANE_BEFORE, SPEED_CORRECTION
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import NAMING_MARGIN
from host.dynamics.equations import PARAMETERS
from host.identification.uncertainty import covariance
from host.likelihood.gauss_newton import Point

TOOLS = frozenset({PLANE_BEFORE.name, SPEED_CORRECTION.name})  # of one recording, and no physics
Value = tuple[float, float]
"""A coefficient and its deviation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """What one side holds: its effects, and all its coefficients by parameter name."""

    names: Names
    values: dict[str, Value]

    def of(self, name: str) -> dict[str, Value]:
        """The coefficients of one effect."""
        return {parameter.name: self.values[parameter.name] for parameter in named(name).parameters}


def side_of(explanation: Explanation) -> Side:
    """An explanation as one side of a comparison."""
    fit = explanation.fit
    std = np.sqrt(np.diag(covariance(fit))).tolist()
    pairs = zip(fit.parameters.tolist(), std, strict=True)
    return Side(names=explanation.names, values=dict(zip(fit.structure.names, pairs, strict=True)))


def at_speed(side: Side, speed: float) -> Side:
    """The same physics at another forward speed, m/s: each coefficient grows with its power of it."""
    parameters = [*PARAMETERS, *(p for name in side.names for p in named(name).parameters)]
    growth = {p.name: (speed / side.values["u0"][0]) ** p.speed_power for p in parameters}
    values = {name: (value * growth[name], std * growth[name]) for name, (value, std) in side.values.items()}
    return replace(side, values=values | {"u0": (speed, side.values["u0"][1])})


def there(fitter: Fitter, own: Explanation, other: Side) -> Point:
    """The other side's effects at their coefficients, on our recordings."""
    names = other.names | (own.names & TOOLS)
    known = dict(zip(own.fit.structure.names, own.fit.parameters.tolist(), strict=True))
    known |= {name: value for name, (value, _) in other.values.items()}
    known |= fitter.held_in(names)
    structure = structure_of(names)
    start = np.array([known[name] for name in structure.names])
    return Point(structure, start, own.fit.initial, own.fit.levels)


def in_words_of(fitter: Fitter, own: Explanation, other: Side) -> Explanation:
    """The recording explained with the other side's effects, ours only where those do not do.

    Two ways lead there, as several of ours may do the work of one of theirs, which none of ours alone can
    give way to: ours and theirs, less what of ours is not needed; and theirs at their own coefficients, with
    what of ours is. Where both do as well, the one with less of ours tells more plainly what differs.
    """
    joint = fitter.polished(own)
    ways = [_less_ours(fitter, _beside(fitter, joint, other), other)]
    if own.names - other.names:
        start = there(fitter, joint, other)
        theirs = fitter.explained(start.structure.effect_names, fitter.fitted([start]))
        ways.append(_with_ours(fitter, fitter.polished(theirs), joint))
    return min(ways, key=lambda way: way.bic + NAMING_MARGIN * len(way.names - other.names))


def _beside(fitter: Fitter, own: Explanation, other: Side) -> Explanation:
    """Our explanation with the other side's effects."""
    for name in sorted(other.names - own.names):
        start = np.array([value for value, _ in other.of(name).values()])
        own = fitter.polished(fitter.grown(own, name, [start]))
    return own


def _less_ours(fitter: Fitter, joint: Explanation, other: Side) -> Explanation:
    """Without what of ours does not pay beside theirs."""
    while joint.names - other.names:
        fewer = [fitter.polished(fitter.shrunk(joint, name)) for name in joint.names - other.names]
        leanest = min(fewer, key=lambda explanation: explanation.bic)
        if leanest.bic > joint.bic + NAMING_MARGIN:
            break
        joint = leanest
    return joint


def _with_ours(fitter: Fitter, theirs: Explanation, own: Explanation) -> Explanation:
    """With what of ours pays beside theirs, the most telling first."""
    while True:
        larger = list(_larger(fitter, theirs, own))
        best = min(larger, key=lambda explanation: explanation.bic, default=theirs)
        if best.bic > theirs.bic - NAMING_MARGIN:
            return theirs
        theirs = best


def _larger(fitter: Fitter, theirs: Explanation, own: Explanation) -> Iterator[Explanation]:
    known = dict(zip(own.fit.structure.names, own.fit.parameters.tolist(), strict=True))
    for name in sorted(own.names - theirs.names):
        start = np.array([known[parameter.name] for parameter in named(name).parameters])
        yield fitter.polished(fitter.grown(theirs, name, [start]))
