"""What a simulation contains, told by its motion with hardly any noise."""

import numpy as np
from scipy.stats import chi2

from host.catalogue import named
from host.catalogue.nuisance import SPEED_CORRECTION
from host.diagnosis.against.comparison import SIGNIFICANCE
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter

CLEARLY_NEEDED = 1000.0  # of 2 log L, lost without a member: nothing else that goes makes it idle
TRACE = 0.1  # of what the recording shows of an effect
LARGE_ANGLES = frozenset({"large_angle_kinematics", "large_angle_restoring"})


def contained(fitter: Fitter, theirs: Explanation, ours: Explanation) -> Explanation:
    """What a simulation contains: what it was diagnosed to hold, or what the recording does, if likelier.

    Either is asked for each effect of the other: less evidence will then do. At the sensors' noise one set
    may do another's work, with coefficients that no vehicle has; with little noise the simulation itself
    tells, and large angles are in most of them.

    fitter  of the simulation with little noise
    theirs  what it was diagnosed to hold
    ours    what the recording was
    """
    candidates = [_with_those_of(fitter, fitter.polished(theirs), ours)]
    if SPEED_CORRECTION.name not in ours.names:  # of a speed that the simulation need not have
        alike = fitter.refitted(ours)
        for name in sorted(LARGE_ANGLES - ours.names):
            alike = fitter.polished(fitter.grown(alike, name, []))
        alike = _needed_of(fitter, alike)
        candidates.append(_with_those_of(fitter, alike, theirs))
    likeliest = min(candidates, key=lambda explanation: explanation.bic)
    traces = [name for name in sorted(likeliest.names & ours.names) if _is_trace(name, likeliest, ours)]
    return fitter.polished(fitter.shrunk(likeliest, *traces)) if traces else likeliest


def _is_trace(name: str, theirs: Explanation, ours: Explanation) -> bool:
    """Whether a simulation holds hardly any of an effect: it does the work of what is too small to name."""
    theirs_of, ours_of = (
        dict(zip(e.fit.structure.names, e.fit.parameters.tolist(), strict=True)) for e in (theirs, ours)
    )
    sizes = named(name).size_names
    return bool(sizes) and all(abs(theirs_of[size]) < TRACE * abs(ours_of[size]) for size in sizes)


def _with_those_of(fitter: Fitter, held: Explanation, other: Explanation) -> Explanation:
    values = dict(zip(other.fit.structure.names, other.fit.parameters, strict=True))
    for name in sorted(other.names - held.names):
        start = np.array([values[parameter.name] for parameter in named(name).parameters])
        grown = fitter.polished(fitter.grown(held, name, [start]))
        if _gain(grown, held) > chi2.isf(SIGNIFICANCE, start.size):
            held = grown
    return held


def _needed_of(fitter: Fitter, held: Explanation) -> Explanation:
    """The set less the members that a simulation shows nothing of."""
    doubtful = held.names
    while doubtful:
        fewer = {name: fitter.polished(fitter.shrunk(held, name)) for name in sorted(doubtful)}
        lost = {name: _gain(held, without) for name, without in fewer.items()}
        least = min(fewer, key=lambda name: fewer[name].bic)
        if fewer[least].bic > held.bic:
            break
        held = fewer[least]
        doubtful = frozenset(name for name in doubtful - {least} if lost[name] < CLEARLY_NEEDED)
    return held


def _gain(larger: Explanation, smaller: Explanation) -> float:
    return 2.0 * (larger.fit.log_likelihood - smaller.fit.log_likelihood)
