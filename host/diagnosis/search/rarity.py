"""What seldom acts gives way to what every vehicle has, where the recording cannot tell them apart.

A vehicle on which two of the effects show that every real one has, has all of them, strong or weak. One that
seldom acts may look likelier there only because it does the work of several of these at once, each too weak
to pay for itself: a slow attitude filter that of a servo and a little coupling, a net weight that of the mean
of a drag. So it must pay beside all of them, named or not; else it is left out, all that every vehicle has
joins, and what of it does not pay is dropped: that set is preferred unless it is clearly less likely. Nor is
named there what explains a hundredth of the sensors' noise or less, however significant: the forms of drags
and speed loss are not exact to that.
"""

from math import log
from typing import TYPE_CHECKING

from host.catalogue import BY_NAME, FAINT, ORDINARY, named
from host.catalogue.kin import measure_alike
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import margin
from host.diagnosis.search.pruning import pruned
from host.diagnosis.search.whole_vehicle import is_real

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

CLEARLY = 20.0  # of BIC, by which a rare effect must pay; as much worse a set of usual ones may be
SLIGHT = 0.01  # of BIC a sample: of the noise's variance


def told_by_the_usual(search: "Search", best: Explanation) -> Explanation:
    """The set, or one with a rare member less that is not clearly less likely."""
    if not is_real(best.names) or search.root.fit.has_process_noise:
        return best
    best = _without_the_slight(search, best)
    rare = sorted(name for name in best.names & BY_NAME.keys() if not _is_usual(name))
    if not rare:
        return best
    search.on_progress("what every vehicle has in place of " + " and ".join(rare))
    whole = search.completion(best)
    for name in rare:
        if name not in best.names:
            continue  # gone with another
        fewer = search.without(best, name)
        other = search.completion(fewer)
        if _pays(search, name, whole, other):
            continue
        lean = min(fewer, pruned(search, search.remember(other)), key=lambda e: e.bic)
        if lean.bic < best.bic + CLEARLY:
            best, whole = lean, other
            _tell_twins(search, best, name)
    return _without_the_slight(search, best)


def _pays(search: "Search", name: str, whole: Explanation, other: Explanation) -> bool:
    """Whether all that every vehicle has is clearly less likely without the effect.

    By more than names need elsewhere: the forms of the usual effects are not exact.
    """
    charge = log(whole.fit.samples) * search.fitter.free_parameters(frozenset({name}))
    return 2.0 * (whole.fit.log_likelihood - other.fit.log_likelihood) > charge + max(CLEARLY, margin(whole))


def _without_the_slight(search: "Search", best: Explanation) -> Explanation:
    """The set less the members, but those of every vehicle, that hardly matter."""
    while members := sorted(name for name in best.names & BY_NAME.keys() if name not in ORDINARY):
        least = min(search.each_without(best, members), key=lambda one: one.bic)
        if least.bic > best.bic + SLIGHT * best.fit.samples:
            break
        best = least
    return best


def _is_usual(name: str) -> bool:
    effect = named(name)
    return name in {*ORDINARY, *FAINT} or bool(effect.changes)


def _tell_twins(search: "Search", best: Explanation, rare: str) -> None:
    """Fits the rare effect in the place of what measures alike, so that it is told as a twin."""
    kin = [name for name in best.names & BY_NAME.keys() if measure_alike(named(name), named(rare))]
    fewer = search.each_without(best, kin)
    tasks = [(Fitter.grown, (smaller, rare, search.values(rare), best)) for smaller in fewer]
    search.polish([search.remember(found).names for found in search.workers.results(tasks)])
