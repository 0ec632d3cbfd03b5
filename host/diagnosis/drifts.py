"""Searches beside what drifts: a sensor whose error wanders, water that rises and sinks at random."""

from collections.abc import Callable

from host.catalogue import UNKNOWN
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.drift_fits import beside, drifting
from host.diagnosis.explanation import Explanation
from host.diagnosis.fitter import Fitter
from host.diagnosis.leftover import leftover
from host.diagnosis.margins import NAMING_MARGIN, TWIN_MARGIN
from host.diagnosis.sea_fits import as_filtered, with_sea
from host.diagnosis.search import Search
from host.diagnosis.seas import Explained
from host.diagnosis.together import with_more
from host.diagnosis.trims import untrimmed
from host.diagnosis.workers import Workers

CLEARLY = 2.0 * TWIN_MARGIN  # likelier: gusts and white forces may be all but the same
ROUNDS = 3  # of a search and of the levels beside what it found


def in_drift(calm: Search, first: Explanation) -> Explained | None:
    """The search from a set of many beside what drifts with it.

    None where in the end nothing does, or effects or random forces in the place of what drifts are likelier;
    the search without it then remembers what was found.
    While sets are compared what drifts stays as it was first found; it is estimated again beside the best.
    """
    fitter, found = calm.fitter, first
    for number in range(ROUNDS):
        search = _search(fitter, calm.workers, calm.on_progress, found)
        found = search.run_from(untrimmed(search.fitter, found)) if number == 0 else search.settle(found)
        again = drifting(fitter, found)
        if again is None:
            calm.remember(fitter.reduced(found, found.names))
            return None
        if again.bic > found.bic - TWIN_MARGIN or number == ROUNDS - 1:
            break
        found = again
    instead = _with_effects_instead(calm, found)
    if with_sea(fitter, found).bic < found.bic - CLEARLY or instead.bic < found.bic - NAMING_MARGIN:
        return None
    return Explained(found, search, leftover(search.fitter, found), None)


def _with_effects_instead(calm: Search, found: Explanation) -> Explanation:
    """What was found beside drift with a few effects more under white noise alone, which passed for drift."""
    bare = calm.remember(calm.fitter.reduced(found, found.names))
    return as_filtered(calm.fitter, with_more(calm, bare, least=0.0))


def among_drift(calm: Search, best: Explanation) -> Explained | None:
    """The search beside what drifts, where that explains more than the best so far, random forces or none."""
    calm.on_progress("sensors that wander, gusts")
    fitter = calm.fitter
    known = best.names.difference(UNKNOWN)
    first = drifting(fitter, best if known == best.names else fitter.reduced(best, known))
    if first is None or first.bic > as_filtered(fitter, best).bic - NAMING_MARGIN:
        return None
    found = in_drift(calm, first)
    return found if found is not None and found.best.bic < as_filtered(fitter, best).bic else None


def again_in_drift(
    fitter: Fitter, workers: Workers, on_progress: Callable[[str], None], part: Explained
) -> Explained:
    """What was found so on a part of the recordings, on the whole of them."""
    levels = part.best.fit.relative_wander
    again = beside(fitter, levels).refitted(part.best)
    found = drifting(fitter, again) or again
    search = _search(fitter, workers, on_progress, found, part.search)
    best = search.settle(found)
    return Explained(best, search, leftover(search.fitter, best), None)


def _search(
    fitter: Fitter,
    workers: Workers,
    on_progress: Callable[[str], None],
    first: Explanation,
    part: Search | None = None,
) -> Search:
    """Beside what drifts with a set, the base and the root begun from it."""
    among = beside(fitter, first.fit.relative_wander)
    base = among.reduced(first, frozenset())
    root = among.reduced(untrimmed(among, first), frozenset({FREE_TRIM.name}))
    return Search(among, workers.beside(among), on_progress, base, root, part)
