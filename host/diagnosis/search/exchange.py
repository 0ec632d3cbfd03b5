"""What could stand in the place of a member: exchanged where it does better, told as a twin where as well."""

from math import log
from typing import TYPE_CHECKING

from host.catalogue import BY_NAME, ORDINARY, named
from host.catalogue.kin import AS_A_LEVER, OFFSETS, PITCHING_INTO_DEPTH, both_come, measure_alike
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import FEW, LARGEST_SET, NAMING_MARGIN, ROUGH, SMALL, TWIN_MARGIN, margin
from host.diagnosis.fits.trims import retrimmed
from host.diagnosis.fits.workers import Task
from host.diagnosis.search.candidates import eligible
from host.diagnosis.search.pruning import pruned
from host.noise.whiteness import correlation_factor

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

LARGEST_CLASS = 3  # a longer list of alternatives helps nobody
RIVALS = 5
ALIKE = 0.95  # of the largest gain predicted
POLISHED = 3


def exchanged(search: "Search", best: Explanation, settled: Names = frozenset()) -> Explanation:
    """The best set with one member exchanged for another, where that is better still; else itself.

    settled  members that stay: they were tried against all others before
    """
    fewer = search.each_without(best, sorted(best.names - settled))
    tasks: dict[Names, Task] = {}
    is_small, is_large = len(best.names) <= SMALL, len(best.names) > LARGEST_SET
    for smaller in fewer:
        (member,) = best.names - smaller.names
        kin = {e.name for e in eligible(search) if _is_kin(search, e.name, member)}
        # In a large set a rare member may stand for a common one that joined too late.
        fair = kin if named(member).is_common else kin | {*ORDINARY}
        near = _near_on_a_part(search, best, smaller)
        gains = search.gains(smaller, is_small, fair if is_large else near)
        rivals = _likely(gains, smaller.bic - best.bic, RIVALS if is_small else FEW)
        kin &= gains.keys()
        rivals |= kin if is_small else {name for name in kin if _is_close_kin(name, member)}
        for name in sorted(rivals - best.names):
            beside, goal = best if name in kin else None, best.fit if is_large else None
            fits = (Fitter.grown, (smaller, name, search.values(name), beside, goal))
            tasks.setdefault(smaller.names | {name}, fits)
        if member in OFFSETS:
            kept = smaller.names & {*OFFSETS}
            for name in {*OFFSETS} - best.names if near is None else near & {*OFFSETS}:
                tasks[smaller.names | {name}] = (retrimmed, (best, kept | {name}))
    tasks = {names: task for names, task in tasks.items() if names not in search.rivals}
    search.rivals.update(tasks)
    grown = [search.remember(e) for e in search.workers.results(list(tasks.values()))]
    if is_small:
        grown += search.across([e for e in grown if _moves_depth(e, best)])
    # Twins may lie at the far end of a curved valley, where a short fit does not come.
    first = sorted(grown, key=lambda e: e.bic)
    least = POLISHED if is_small else 1
    close = [e for k, e in enumerate(first) if k < least or e.bic < best.bic + 4.0 * TWIN_MARGIN]
    close = [search.remember(e) for e in search.workers.results([(Fitter.polished, (e,)) for e in close])]
    # Two members may stand for what one does that was not there: with it they are no longer needed.
    close = [e for e in close if e.bic < best.bic + margin(best)]
    leaner = (pruned(search, e) if 1 < len(e.names) <= LARGEST_SET else e for e in close)
    rival = min(leaner, key=lambda e: e.bic, default=best)
    if rival.bic > best.bic - 0.01:
        return best
    return rival if is_small else pruned(search, rival)


def _near_on_a_part(search: "Search", best: Explanation, smaller: Explanation) -> set[str] | None:
    """The effects that came near in the place of a member where a part of the recordings was searched.

    What is far behind there is farther on all. None where the part had another best set, or forces act, under
    which all come nearer.
    """
    part = search.part
    if part is None or best.fit.has_process_noise or len(best.names) > LARGEST_SET:
        return None
    there = min(part.untrimmed, key=lambda e: e.bic)
    if there.names != best.names or there.fit.has_process_noise:
        return None
    alike = (e for e in part.untrimmed if len(e.names - smaller.names) == 1 and e.names > smaller.names)
    return {next(iter(e.names - smaller.names)) for e in alike if e.bic < there.bic + ROUGH} - best.names


def _moves_depth(rival: Explanation, best: Explanation) -> bool:
    """Whether the exchange is one of near twins among which the base bends most."""
    return (rival.names ^ best.names) <= {*PITCHING_INTO_DEPTH}


def _likely(gains: dict[str, float], worth: float, count: int) -> set[str]:
    """Those predicted to do most of what a member is worth, and all that promise as much as the best.

    A fit far from the recording promises less than there is, but the same to all that mend it.
    """
    most = max(gains.values(), default=0.0)
    likely = [name for name in gains if gains[name] > 0.5 * min(worth, most)]
    ordered = sorted(likely, key=lambda name: -gains[name])
    return {name for k, name in enumerate(ordered) if k < count or gains[name] > ALIKE * most}


def _is_kin(search: "Search", name: str, member: str) -> bool:
    """Whether prediction may misjudge its gain: they measure alike, or share an end of it and pay."""
    if name == member:
        return False
    if _is_close_kin(name, member) or {name, member} <= {*PITCHING_INTO_DEPTH}:
        return True
    slots = {named(name).slot, named(member).slot}
    if member in OFFSETS and len(slots) == 1:
        return True  # alone it was tried beside a free trim, which did all that it could do
    pays = search.gain_alone(name) > NAMING_MARGIN
    return pays and (len(slots) == 1 or slots == {"actuator", "sensor"})


def _is_close_kin(name: str, member: str) -> bool:
    one, other = named(name), named(member)
    return measure_alike(one, other) or both_come(one, other) or {name, member} == {*AS_A_LEVER}


def twins(search: "Search", best: Explanation, name: str) -> list[str]:
    """The effects that would do the work of one member as well, or nearly: the two closest.

    Parsimony chooses a name, but excludes no other: of two that fit alike, the one with more coefficients
    is charged as a forecast would be (Akaike), not by what it costs to prefer it.
    """
    if search.part is not None and len(best.names) > LARGEST_SET and best.names in search.part.tried:
        return twins(search.part, search.part.tried[best.names], name)
    in_its_place = {
        next(iter(names - best.names)): explanation
        for names, explanation in search.tried.items()
        if len(names) == len(best.names) and best.names - names == {name}
    }
    limit = TWIN_MARGIN * correlation_factor(best.fit.whitened)
    close = {
        other: explanation.bic
        for other, explanation in in_its_place.items()
        if other in BY_NAME and explanation.bic - best.bic - _excess(search, explanation, best) < limit
    }
    return sorted(close, key=lambda other: close[other])[: LARGEST_CLASS - 1]


def _excess(search: "Search", explanation: Explanation, best: Explanation) -> float:
    """Of BIC, what more coefficients than the best set has are charged beyond Akaike's 2 for each."""
    more = search.fitter.free_parameters(explanation.names) - search.fitter.free_parameters(best.names)
    return max(more, 0) * (log(best.fit.samples) - 2.0)
