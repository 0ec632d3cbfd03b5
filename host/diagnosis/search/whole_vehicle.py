"""A vehicle that shows some of what every vehicle has, has all of it, strong or weak.

What is too weak to pay for itself is not named; but it acts, and bends what is. So a set that shows some
of it is fitted with all of it once: that may be far likelier in another valley than where the few were found,
and it tells how far those that are named may be off.
"""

from dataclasses import replace
from math import log
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import chi2

from host.catalogue import ALONG_THE_HULL, BY_NAME, FAINT, ORDINARY, OVER_GROUND, named
from host.catalogue.nuisance import SPEED_CORRECTION
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.margins import LITTLE, MUCH, margin
from host.diagnosis.fits.starts import begun_beside, begun_from, with_other_moments
from host.diagnosis.search.pruning import pruned
from host.identification.uncertainty import covariance_within
from host.likelihood.gauss_newton import Point
from host.likelihood.valleys import are_apart, has_usual_heave, look_alikes, with_usual_heave
from host.noise.whiteness import correlation_factor

if TYPE_CHECKING:
    from host.diagnosis.fits.fitter import Fitter
    from host.diagnosis.search.search import Search

PATIENT = 10  # iterations before a start is left that leads nowhere: the sides of such valleys are long
MOST_ROUNDS = 3  # as more names see other valleys
BY_CHANCE = 1e-3
SHOWN = 2  # of the effects that every vehicle has: one that shows so many is no textbook's


def is_real(names: Names) -> bool:
    """Whether a set shows a vehicle as they are built."""
    return len(names & {*ORDINARY}) >= SHOWN


def whole(search: "Search", best: Explanation) -> Explanation:
    """The set, or what is left of it with all that every vehicle has, where that is likelier.

    Asked of a set that shows some of it, or that leaves something.
    """
    if best.fit.has_process_noise or not best.names or (best.leaves_white and not is_real(best.names)):
        return best
    search.on_progress("all that every vehicle has")
    for _ in range(MOST_ROUNDS):
        found = search.completion(best)
        gain = 2.0 * (found.fit.log_likelihood - best.fit.log_likelihood)
        if gain < log(best.fit.samples) + margin(best):
            break  # none of them could pay
        lean = pruned(search, search.remember(found))
        if lean.bic >= best.bic:
            break
        best = lean
    return best


def with_all_ordinary(fitter: "Fitter", parent: Explanation) -> Explanation:
    """The set with all that every vehicle has, from where that hardly acts yet.

    In the likeliest of the valleys that the set alone can hardly tell apart.
    """
    fit, names = parent.fit, parent.names | {*ORDINARY, *FAINT}
    here = Point(fit.structure, fit.parameters, fit.initial, fit.levels)
    starts = [begun_beside(fitter, start, names) for start in (here, *look_alikes(here))]
    found = fitter.polished(fitter.explained(names, fitter.fitted(starts)))
    corrected = names | {SPEED_CORRECTION.name} & {*fitter.tools_beside(names)}
    if corrected == names:
        return found
    return min(found, _ended(fitter, begun_from(fitter, found, corrected), corrected), key=lambda e: e.bic)


def all_beside(fitter: "Fitter", leading: Explanation) -> Explanation:
    """The set with all that every vehicle has, and drag that acts along the hull, in one fit.

    And where water moves, a measured speed that may not be through it. Begun where they hardly act yet; not
    carried to its end where much is left.
    """
    names = leading.names | {*ORDINARY, *FAINT, ALONG_THE_HULL}
    if fitter.recordings[0].has_speed and names & {*named(OVER_GROUND).changes}:
        names |= {OVER_GROUND}
    names |= {*fitter.tools_beside(names)}
    found = ended(fitter, begun_from(fitter, leading, names), names)
    if fitter.excess(found.fit) < LITTLE:
        return found
    # Bent to do without the rest, it may have put a change at another moment.
    moved = [ended(fitter, at, names) for at in with_other_moments(fitter, found)]
    return min([found, *moved], key=lambda e: e.bic)


def ended(fitter: "Fitter", start: Point, names: Names) -> Explanation:
    """A set of many from this start, polished where it leaves little.

    And from the heave of a usual hull, where the start has none: a set that lacks an effect may follow its
    plane at once, and from there many lead nowhere. A measured speed is taken as it is at first: what may
    correct it would do the work of all that is not yet where it belongs, and lead elsewhere.
    """
    if SPEED_CORRECTION.name not in names:
        return _ended(fitter, start, names)
    few = names - {SPEED_CORRECTION.name}
    taken = _ended(fitter, begun_beside(fitter, start, few), few)
    if taken.leaves_white and fitter.excess(taken.fit) < LITTLE:
        return taken
    return min(taken, _ended(fitter, begun_from(fitter, taken, names), names), key=lambda e: e.bic)


def _ended(fitter: "Fitter", start: Point, names: Names) -> Explanation:
    starts = [start] if has_usual_heave(start) else [start, *with_usual_heave(start)]
    found = fitter.explained(names, fitter.fitted(starts, first=PATIENT))
    return fitter.polished(found) if fitter.excess(found.fit) < MUCH else found


def beside_all(fitter: "Fitter", found: Explanation) -> Explanation | None:
    """A set with all that every vehicle has, where that acts beside it, named or not; else None.

    It does where two of these are named, or where all together tell: twice their gain in log-likelihood is
    that of chance, chi2 of as many degrees as they have coefficients, once in a thousand sets.
    """
    if found.fit.has_process_noise or not found.names & BY_NAME.keys():
        return None
    complete = with_all_ordinary(fitter, found)
    gain = 2.0 * (complete.fit.log_likelihood - found.fit.log_likelihood)
    more = fitter.free_parameters(complete.names) - fitter.free_parameters(found.names)
    by_chance = chi2.isf(BY_CHANCE, more) * correlation_factor(found.fit.whitened)
    return complete if is_real(found.names) or gain > by_chance else None


def in_the_valley_of(fitter: "Fitter", whole: Explanation, found: Explanation) -> Explanation:
    """The set in the valley in which it and all that every vehicle has are likeliest together.

    Alone it may be likelier in another one, bent to do the work of what is not named; where it would lose
    more by leaving that than the whole gains by being complete, it stays.
    """
    there = fitter.reduced(whole, found.names)
    lost = found.fit.log_likelihood - there.fit.log_likelihood
    gained = whole.fit.log_likelihood - found.fit.log_likelihood
    return there if are_apart(there.fit, found.fit) and lost < gained else found


def widened(std: dict[str, float], found: Explanation, whole: Explanation) -> dict[str, float]:
    """Deviations of a set's coefficients, as far as what is not named may bend them.

    var = max(var, var_w) + (p - p_w)^2 with the value and the variance beside all that every vehicle has
    (subscript w), where each coefficient that is not named is somewhere between its bounds. A moment at which
    something changed has no variance by curvature; it moves by the rest.
    """
    fit, structure = whole.fit, found.fit.structure
    names = fit.structure.names
    unnamed = np.array([name not in structure.names for name in names])
    widths = np.array([p.upper - p.lower for p in fit.structure.parameters])
    information = fit.information + np.diag(np.where(unnamed, 12.0 / widths**2, 0.0))
    beside = np.sqrt(np.diag(covariance_within(replace(fit, information=information))))
    most = widths / np.sqrt(12.0)  # of a draw between the bounds: where the recordings tell nothing
    beside[np.isin(names, list(structure.moments))] = 0.0
    wider = dict(std)
    for name, value in zip(structure.names, found.fit.parameters.tolist(), strict=True):
        k = names.index(name)
        if std[name] > 0.0:
            apart = np.hypot(max(std[name], beside[k]), value - fit.parameters[k])
            wider[name] = max(std[name], float(min(apart, most[k])))
    return wider
