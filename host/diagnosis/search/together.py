"""What every vehicle has, fitted at once.

Of many effects that act together each may look idle, or be mistaken for another, until the rest are there;
and a search that carries sets side by side costs most where sets are large. So where one effect leaves much,
all that every vehicle has joins it, then what else promises most, and what does not pay is dropped at last.
"""

from collections.abc import Mapping
from math import inf, isfinite, log
from typing import TYPE_CHECKING

from host.catalogue import DRIVE, ORDINARY, named
from host.catalogue.kin import OFFSETS
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.drift_fits import plain_drift
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import is_above_floor
from host.diagnosis.fits.margins import FEW, LITTLE, MUCH, SMALL, margin
from host.diagnosis.fits.patience import is_over
from host.diagnosis.fits.starts import is_far
from host.diagnosis.fits.trims import retrimmed
from host.diagnosis.fits.workers import Task, Workers
from host.diagnosis.recordings.spans import led_excerpt
from host.diagnosis.search.continuation import continued
from host.diagnosis.search.pruning import pruned
from host.diagnosis.search.whole_vehicle import all_beside
from host.likelihood.valleys import look_alikes

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

MOST_BESIDE = 3  # effects beside those that every vehicle has
FAR_TOO_MUCH = 100.0  # times the noise floor, of an excerpt: over all no end was nearer than a fifth of it
HARDLY_LESS = 0.95  # of what is left over the noise floor: another effect beside so many leads nowhere
FAR, LESS = (
    10.0,
    0.7,
)  # times the floor, and the same there: of three that lack, the largest leaves two thirds


def at_once(search: "Search", leading: list[Explanation]) -> Explanation:
    """The leading set with all that every vehicle has, and what else promises most where little is left.

    In one fit, where that leaves little; else each joins the first of them, one after the other.
    """
    search.on_progress("what every vehicle has")
    fitter, found = search.fitter, _in_one_fit(search, leading)
    if found is not None and found.leaves_white:
        return found
    best = _with_few_more(search, with_ordinary(search, leading[0]) if found is None else found)
    if fitter.excess(best.fit) > LITTLE and (alike := _among_look_alikes(search, best)) is not best:
        best = _with_few_more(search, alike)
    return best


def _in_one_fit(search: "Search", leading: list[Explanation]) -> Explanation | None:
    """The likeliest of these sets with all that every vehicle has, where it leaves less than much."""
    found = [search.remember(e) for e in search.workers.results([(all_beside, (one,)) for one in leading])]
    best = min(found, key=lambda e: e.bic)
    if search.fitter.excess(best.fit) > MUCH:
        return None
    search.joint.add(best.names)
    return best


def together(search: "Search", leading: Explanation, joint: Explanation) -> Explanation | None:
    """The leading set with all that every vehicle has, more if need be, pruned; None if too much is left.

    Where it has led astray, all that every vehicle has by continuation, which needs no set to begin with, but
    takes longest. Where that leaves more than a little, but a fraction of what the leading set does, it stays
    as it is: a few effects more come nowhere near.

    joint  what `at_once` made of the leading set
    """
    fitter, best = search.fitter, joint
    if search.asks_drift and fitter.excess(best.fit) > LITTLE:
        search.on_progress("sensors that wander, gusts")
        search.adrift = plain_drift(fitter, best)
    left = fitter.excess(best.fit)
    may_be_led = (left < MUCH or not search.is_second) and not is_over()
    if left > LITTLE and may_be_led and (end := _by_continuation(search, left)) is not None:
        # What drifts can make up for a hull in another valley than the truth.
        if fitter.excess(end.fit) < LITTLE:
            search.adrift = None
        if search.adrift is None and not search.is_led_elsewhere:
            best = with_more(search, min(end, best, key=lambda e: e.bic))
    if search.is_led_elsewhere:
        return None
    if fitter.excess(best.fit) > LITTLE and is_above_floor(fitter, best.fit):
        is_out_of_reach = fitter.excess(best.fit) < MUCH and is_far(fitter, leading)
        return best if is_out_of_reach else None
    best = pruned(search, best)
    return best if best.bic < leading.bic else None


def _with_few_more(search: "Search", best: Explanation) -> Explanation:
    """The set with what else promises most, where so little is left that it will do."""
    return with_more(search, best) if search.fitter.excess(best.fit) < MUCH else best


def with_more(search: "Search", best: Explanation, least: float = LITTLE) -> Explanation:
    """The set with what else promises most, as long as more than the least is left and it helps."""
    left = search.fitter.excess(best.fit)
    for _ in range(MOST_BESIDE):
        if left < least or is_over():
            break
        found = search.workers.results(_more(search, best))
        near = search.polished_near(found, min((e.bic for e in found), default=inf))
        better = min(near, key=lambda e: e.bic, default=best)  # none is near where all run away
        if better.bic > best.bic - margin(better):
            break
        best = better
        search.joint.add(best.names)
        before, left = left, search.fitter.excess(best.fit)
        if left > MUCH and left > (LESS if left > FAR else HARDLY_LESS) * before:
            break
    return best


def completed(search: "Search", best: Explanation) -> Explanation:
    """A set of many, or what is left of it when all that every vehicle has joins at once.

    One at a time they may promise nothing, where the set is bent to do without them.
    """
    if len(best.names) <= SMALL or _was_joint(search, best) or search.root.fit.has_process_noise:
        return best
    if search.joint and search.fitter.excess(best.fit) > MUCH:
        return best  # they led nowhere beside less, too
    search.on_progress("what every vehicle has beside it")
    (joint,) = search.across([with_ordinary(search, best)])
    return min(best, pruned(search, joint), key=lambda e: e.bic)


def _was_joint(search: "Search", best: Explanation) -> bool:
    """Whether all that every vehicle has was fitted with it, and not in a poorer valley than it is in now."""
    least = best.fit.log_likelihood
    # One that joined later was fitted beside all that was left then.
    return any(
        len(best.names - names - {*OFFSETS}) <= 1 and search.tried[names].fit.log_likelihood > least
        for names in search.joint
    )


def with_ordinary(search: "Search", explanation: Explanation) -> Explanation:
    """The set with all that every vehicle has, whatever the plane did before, and a speed sensor tells."""
    for name in (*ORDINARY, *search.fitter.tools_beside(frozenset(ORDINARY))):
        if name not in explanation.names:
            grown = search.fitter.grown(explanation, name, search.values(name))
            if isfinite(grown.bic):
                explanation = grown
    search.joint.add(explanation.names)
    return search.remember(search.fitter.polished(explanation))


def _among_look_alikes(search: "Search", best: Explanation) -> Explanation:
    """The set in the likeliest valley of the points that move much as it does (host.likelihood.valleys).

    A lag that joins a leading effect which had its work to do may leave the hull the lag's pole and take one
    of the hull's, from where no fit comes back.
    """
    rival = best.lean()
    tasks: list[Task] = [(Fitter.entered, (start, rival)) for start in look_alikes(best.fit.end)]
    found = min(search.workers.results(tasks), key=lambda e: e.bic, default=best)
    return search.remember(found) if found.bic < best.bic - margin(best) else best


def _by_continuation(search: "Search", most: float) -> Explanation | None:
    """All that every vehicle has, with little beside it; None where the filter loses the recording.

    Or where it leaves more than the most of an excerpt, which a set that is known leaves of all.

    With what keeps the plane back, where that leads: no force is to stand for that.
    """
    search.on_progress("what every vehicle has, led by the measurements")
    faults, known = _faults_of_the_drive(search)
    names = frozenset({*ORDINARY, FREE_TRIM.name, *faults})
    names |= {*search.fitter.tools_beside(names)}
    found = _led_by_the_measurements(search, names, known, most)
    if found is None:
        return None
    end = search.remember(search.fitter.polished(found))
    search.joint.add(end.names)
    return end


def _faults_of_the_drive(search: "Search") -> tuple[Names, dict[str, float]]:
    """What keeps the plane back, where that leads, and the values of its parameters."""
    if (leading := search.fault_of_the_drive) is None:
        return frozenset(), {}
    names = leading.names & {*DRIVE}
    own = {parameter.name for name in names for parameter in named(name).parameters}
    pairs = zip(leading.fit.structure.names, leading.fit.parameters.tolist(), strict=True)
    return names, {name: value for name, value in pairs if name in own}


def _led_by_the_measurements(
    search: "Search", names: Names, known: Mapping[str, float], most: float
) -> Explanation | None:
    """The set by continuation through an excerpt, and from there over all; over all if it leaves much of it.

    Where it leaves far too much of short pieces, or more than `most`, it leads nowhere over all, which takes
    longest.
    """
    pieces = led_excerpt(search.fitter.recordings)
    if pieces is not search.fitter.recordings and not search.fitter.wander.any():
        fitter = Fitter(pieces)
        with Workers(fitter, search.workers.jobs) as workers:
            found = continued(search.elsewhere(fitter, workers), names, MOST_BESIDE, known)
        left = inf if found is None else fitter.excess(found.fit)
        if found is not None and left < MUCH:
            return search.fitter.refitted(found)
        if min(most, FAR_TOO_MUCH) < left < inf:
            return None
    return continued(search, names, MOST_BESIDE, known)


def _more(search: "Search", best: Explanation) -> list[Task]:
    """The set with one of the most promising effects more, or with an offset in place of the free trim.

    Of one that leaves white noise it is well foretold what pays, and a free trim does what an offset would.
    """
    gains, is_done = search.gains(best), best.leaves_white
    least = margin(best) + log(best.fit.samples) if is_done else -inf
    promising = sorted(gains, key=lambda name: -gains[name])[:FEW]
    tasks = [search.growth(best, name) for name in promising if gains[name] >= least]
    if FREE_TRIM.name in best.names and not is_done:
        tasks += [(retrimmed, (best, frozenset({name}))) for name in OFFSETS]
    return tasks
