"""A set less the members that do not pay for themselves."""

from itertools import combinations
from math import inf, log
from typing import TYPE_CHECKING

from host.catalogue import named
from host.diagnosis.fits.absence import one_step_without
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.margins import LARGEST_SET, ROUGH, SMALL, margin

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

IDLE = 4.0  # of BIC, that leaving out a member must promise: about half of what one coefficient is charged
CLEARLY = 20.0  # times the margin: no doubt is left that a member is needed


def pruned(search: "Search", explanation: Explanation) -> Explanation:
    """The set less the members that do not pay for themselves, alone or two together."""
    given = explanation
    if len(explanation.names) > LARGEST_SET:
        explanation = _without_the_idle(search, explanation)
    doubtful = _doubtful(explanation)
    while doubtful:
        smaller = {explanation.names - {member}: member for member in sorted(doubtful)}
        limit = explanation.bic + margin(explanation)
        search.shrink(explanation, smaller)
        if all(search.tried[names].bic > limit for names in smaller):
            search.polish([names for names in smaller if search.tried[names].bic < limit + ROUGH])
        # What is clearly needed beside others is needed without them.
        doubtful = {smaller[names] for names in smaller if search.tried[names].bic < limit + ROUGH}
        best = min((search.tried[names] for names in smaller), key=lambda e: e.bic)
        if best.bic < explanation.bic and len(explanation.names) > LARGEST_SET:
            best = _without_the_willing(search, explanation, smaller) or best
        if best.bic > limit and len(explanation.names) > SMALL and len(doubtful) > 1:
            best = _without_two(search, explanation, sorted(doubtful))
        if best.bic > limit:
            break
        doubtful &= best.names
        explanation = best
    if explanation is not given:
        search.polish([explanation.names])
    return search.tried.get(explanation.names, explanation)


def _without_the_willing(
    search: "Search", explanation: Explanation, smaller: dict[Names, str]
) -> Explanation | None:
    """A large set less all, or the first half of all, that improve it by going alone.

    None where two of them do each other's work: without both more is lost than without the one and the other.
    """
    alone = {member: search.tried[names] for names, member in smaller.items()}
    willing = [name for name in alone if alone[name].bic < explanation.bic]
    willing.sort(key=lambda name: alone[name].bic)
    lost = {name: max(0.0, _lost(explanation, alone[name])) for name in willing}
    while len(willing) > 1:
        fewer = search.without_all(explanation, willing)
        if _lost(explanation, fewer) < sum(lost[name] for name in willing) + margin(explanation):
            return fewer
        del willing[(len(willing) + 1) // 2 :]
    return None


def _lost(explanation: Explanation, fewer: Explanation) -> float:
    return 2.0 * (explanation.fit.log_likelihood - fewer.fit.log_likelihood)


def leanest(search: "Search", explanation: Explanation) -> Explanation:
    """The set less what, all fits being at their end, does not pay after all."""
    while explanation.names:
        fewer = search.each_without(explanation, sorted(explanation.names))
        best = min(fewer, key=lambda e: e.bic)
        if best.bic > explanation.bic + margin(explanation):
            break
        explanation = best
    return explanation


def _without_two(search: "Search", explanation: Explanation, doubtful: list[str]) -> Explanation:
    """The best of the set less two: lags of both sensors together do what one of the plane does."""
    pairs = {explanation.names - {*pair}: pair for pair in combinations(doubtful, 2)}
    for names, (one, _) in pairs.items():
        search.shrink(search.tried[explanation.names - {one}], [names])
    search.polish([names for names in pairs if search.tried[names].bic < explanation.bic + ROUGH])
    return min((search.tried[names] for names in pairs), key=lambda e: e.bic)


def _without_the_idle(search: "Search", explanation: Explanation) -> Explanation:
    """A large set less those that, by its own fit, are idle together; less fewer, where a fit says no."""
    idle: list[str] = []
    saved = [0.0]  # of BIC, by how many go
    while rest := explanation.names - {*idle}:
        foretold = {name: _saved(search, explanation, [*idle, name]) for name in sorted(rest)}
        best = max(foretold, key=lambda name: foretold[name])
        if foretold[best] < saved[-1] + IDLE:
            break
        idle.append(best)
        saved.append(foretold[best])
    while len(idle) > 1:
        smaller = search.without_all(explanation, idle)
        if smaller.bic < explanation.bic - saved[len(idle)] + margin(explanation):
            return smaller
        del idle[len(idle) // 2 :]  # those that came last are the least idle
    return explanation


def _saved(search: "Search", explanation: Explanation, members: list[str]) -> float:
    """What the BIC falls by without these members, one step ahead; -inf where one cannot be absent."""
    ahead = one_step_without(explanation.fit, *map(named, members))
    if ahead is None:
        return -inf
    return log(explanation.fit.samples) * search.fitter.free_parameters(frozenset(members)) - ahead[0]


def _doubtful(explanation: Explanation) -> set[str]:
    """The members worth trying without: of a large set, where each takes long, not the clearly needed."""
    if len(explanation.names) <= LARGEST_SET:
        return set(explanation.names)
    losses = {name: one_step_without(explanation.fit, named(name)) for name in explanation.names}
    enough = CLEARLY * margin(explanation)
    return {name for name, ahead in losses.items() if ahead is None or ahead[0] < enough}
