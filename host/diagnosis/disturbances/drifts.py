"""Searches beside what drifts: a sensor whose error wanders, water that rises and sinks at random."""

from collections.abc import Callable

from host.catalogue import UNKNOWN
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.disturbances.seas import Explained
from host.diagnosis.fits.drift_fits import beside, drifting
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import leftover
from host.diagnosis.fits.margins import NAMING_MARGIN, TWIN_MARGIN, margin
from host.diagnosis.fits.prospects import form_gains
from host.diagnosis.fits.sea_fits import as_filtered, with_sea
from host.diagnosis.fits.trims import untrimmed
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search.lone_form import likely_forms
from host.diagnosis.search.search import Search
from host.diagnosis.search.together import with_more
from host.diagnosis.search.whole_vehicle import with_all_ordinary

CLEARLY = 2.0 * TWIN_MARGIN  # likelier: gusts and white forces may be all but the same
ROUNDS = 3  # of a search and of the levels beside what it found


def in_drift(calm: Search, first: Explanation) -> Explained | None:
    """The search from a set of many beside what drifts with it.

    None where in the end nothing does, or effects, a form of unknown physics or random forces in the place of
    what drifts are likelier; the search without it then remembers what was found, and under which forces.
    While sets are compared what drifts stays as it was first found; it is estimated again beside the best.
    """
    fitter, found = calm.fitter, first
    for number in range(ROUNDS):
        search = _search(fitter, calm.workers, calm.on_progress, found)
        found = search.run_from(untrimmed(search.fitter, found)) if number == 0 else search.settle(found)
        again = drifting(fitter, found)
        if again is None:
            _instead(calm, search, found)
            return None
        if again.bic > found.bic - TWIN_MARGIN or number == ROUNDS - 1:
            break
        found = again
    instead, sea = _instead(calm, search, found), with_sea(fitter, found)
    if sea.bic < found.bic - CLEARLY:
        calm.pushed = sea
        return None
    if instead.bic < found.bic - NAMING_MARGIN:
        return None
    return Explained(found, search, leftover(search.fitter, found), None)


def _instead(calm: Search, search: Search, found: Explanation) -> Explanation:
    """What was found beside drift, under white noise alone with what may have passed for it: the likeliest.

    That is a few effects more, or one form of unknown physics, with which all that every vehicle has joins.
    """
    bare = calm.remember(calm.fitter.reduced(found, found.names))
    likely = likely_forms(form_gains(search.fitter, found), margin(found))
    grown = calm.workers.results([(_with_form, (found, name)) for name in likely])
    likeliest = map(calm.remember, sorted(grown, key=lambda e: e.bic)[:1])
    sets = [with_more(calm, one, least=0.0) for one in (bare, *likeliest)]
    return min((as_filtered(calm.fitter, one) for one in sets), key=lambda e: e.bic)


def _with_form(fitter: Fitter, found: Explanation, name: str) -> Explanation:
    return with_all_ordinary(fitter, fitter.grown(found, name, []))


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
