"""A set less the members that do not pay for themselves."""

from itertools import combinations
from typing import TYPE_CHECKING

from host.catalogue import named
from host.diagnosis.absence import one_step_without
from host.diagnosis.explanation import Explanation
from host.diagnosis.margins import LARGEST_SET, ROUGH, SMALL, margin

if TYPE_CHECKING:
    from host.diagnosis.search import Search

CLEARLY = 20.0  # times the margin: no doubt is left that a member is needed


def pruned(search: "Search", explanation: Explanation) -> Explanation:
    """The set less the members that do not pay for themselves, alone or two together."""
    given, doubtful = explanation, _doubtful(explanation)
    while doubtful:
        smaller = {explanation.names - {member}: member for member in sorted(doubtful)}
        limit = explanation.bic + margin(explanation)
        search.shrink(explanation, smaller)
        if all(search.tried[names].bic > limit for names in smaller):
            search.polish([names for names in smaller if search.tried[names].bic < limit + ROUGH])
        # What is clearly needed beside others is needed without them.
        doubtful = {smaller[names] for names in smaller if search.tried[names].bic < limit + ROUGH}
        best = min((search.tried[names] for names in smaller), key=lambda e: e.bic)
        if best.bic > limit and len(explanation.names) > SMALL and len(doubtful) > 1:
            best = _without_two(search, explanation, sorted(doubtful))
        if best.bic > limit:
            break
        doubtful &= best.names
        explanation = best
    if explanation is not given:
        search.polish([explanation.names])
    return search.tried.get(explanation.names, explanation)


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


def _doubtful(explanation: Explanation) -> set[str]:
    """The members worth trying without: of a large set, where each takes long, not the clearly needed."""
    if len(explanation.names) <= LARGEST_SET:
        return set(explanation.names)
    losses = {name: one_step_without(explanation.fit, named(name)) for name in explanation.names}
    enough = CLEARLY * margin(explanation)
    return {name for name, ahead in losses.items() if ahead is None or ahead[0] < enough}
