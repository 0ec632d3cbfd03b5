"""Searches under random forces: where the sea moves the vehicle, and where it does so with a wave's swing."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from typing import NamedTuple

import numpy as np

from host.catalogue import BY_NAME, named
from host.catalogue.environment import WAVE_PERIODS
from host.catalogue.kin import OFFSETS, as_trim
from host.catalogue.nuisance import FREE_TRIM
from host.catalogue.unknown import SWINGING_MOMENT
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import Leftover, leftover
from host.diagnosis.fits.margins import LARGEST_SET, LITTLE, NAMING_MARGIN, ROUGH, margin
from host.diagnosis.fits.prospects import form_gains
from host.diagnosis.fits.sea_fits import (
    WAVES,
    again_under_forces,
    as_filtered,
    with_regular_waves,
    with_sea,
    with_waves,
)
from host.diagnosis.fits.speed_forces import are_by_speed
from host.diagnosis.fits.trims import retrimmed
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search.search import Search
from host.likelihood.waves import is_sea, mean_moment

DOUBTED = 100.0  # of BIC in the waves of a search, of which others may do a part
MEAN_MOMENTS = 2.0  # of what it may be: four seas came to 1.0 to 1.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Waves:
    """Surface waves that were named by their swing.

    delta_bic  what white random forces in their place lose, or nothing
    rivalled   of that, what a moment that swings as they do would take as well
    fitted     what was found beside them, their band and height estimated with it
    model      the same with the regular wave nearest to them, to be simulated
    theirs     offsets in it that are no larger than what waves do on the mean: no physics of the vehicle's
    """

    delta_bic: float
    fitted: Explanation
    model: Explanation
    theirs: Names
    rivalled: float = 0.0


class Explained(NamedTuple):
    """The best explanation, the search that found it, what it leaves, and the waves it was found among.

    is_of_all  it was found from all that every vehicle has, among waves or random forces at once
    """

    best: Explanation
    search: Search
    left: Leftover
    waves: Waves | None
    is_of_all: bool = False


def evidence(waves: Waves | None) -> float:
    """What speaks for the waves: nothing that doubts them where there are none."""
    return inf if waves is None else waves.delta_bic - waves.rivalled


def in_a_sea(calm: Search, best: Explanation) -> tuple[Search, Explanation]:
    """The search again with random forces, where these explain more than any set of effects alone.

    Each is charged for what it adds, so a set that leaves white noise needs no sea, and a sea needs no set.
    """
    calm.on_progress("random forces")
    return _rough(calm, best, _among_forces(calm, best)) or (calm, best)


def led_astray(calm: Search, best: Explanation) -> tuple[Search, Explanation] | None:
    """The same where the forces are no more than what errors of the measured speed do, or a model is off.

    No effect, and no form of unknown physics, is to stand for these.
    """
    if not (calm.follows_no_free_run or any(are_by_speed(calm.fitter, e.fit) for e in _in_seas(calm, best))):
        return None
    return _rough(calm, best, _among_forces(calm, best))


def again_astray(
    fitter: Fitter, workers: Workers, on_progress: Callable[[str], None], part: Explained
) -> Explained:
    """What was found so on a part of the recordings, on the whole of them."""
    base, root = with_sea(fitter, fitter.base), with_sea(fitter, fitter.root)
    search = Search(fitter, workers, on_progress, base, root, part.search)
    best = search.run([again_under_forces(fitter, part.best)])
    left = leftover(fitter, best)
    if part.is_of_all:  # what it was doubted for was asked there
        left = replace(left, is_smooth=left.is_smooth or part.left.is_smooth)
    return Explained(best, search, left, None)


def _in_seas(calm: Search, best: Explanation) -> list[Explanation]:
    """The best set without random forces, among those that are likeliest beside it.

    And what a continuation found before it let go of the forces, as no free run tells of a hull that is
    unstable.
    """
    also = with_sea(calm.fitter, best)
    if calm.pushed is not None:
        calm.at_sea = calm.pushed
        return [also, calm.pushed]
    if calm.steered is None or calm.steered.bic > also.bic + ROUGH:
        return [also]
    if calm.at_sea is None:
        calm.at_sea = with_sea(calm.fitter, calm.steered)
    return [also, calm.at_sea]


def _among_forces(calm: Search, best: Explanation) -> list[Explanation]:
    """The same, a free trim explained by as few offsets as will do."""
    also, *others = _in_seas(calm, best)
    for sea in others:
        if FREE_TRIM.name in sea.names:
            one = _retrimmed(calm, sea, [frozenset(), *(frozenset({name}) for name in OFFSETS)])
            for name in one.names & {*OFFSETS}:
                pairs = [frozenset({name, other}) for other in OFFSETS if other != name]
                one = min(one, _retrimmed(calm, sea, pairs), key=lambda e: e.bic)
            calm.at_sea = one
    return [also] if not others or calm.at_sea is None else [also, calm.at_sea]


def _retrimmed(calm: Search, sea: Explanation, ways: list[Names]) -> Explanation:
    """The likeliest of the set with these offsets, or those, in place of its free trim."""
    found: list[Explanation] = calm.workers.results([(retrimmed, (sea, way)) for way in ways])
    return min(found, key=lambda e: e.bic)


def _rough(calm: Search, best: Explanation, sets: list[Explanation]) -> tuple[Search, Explanation] | None:
    """The search with random forces from these sets; None where they explain no more than `best` without.

    Of many effects that leave little without them, each was exchanged there.
    """
    fitter, root = calm.fitter, with_sea(calm.fitter, calm.root)
    is_settled = len(best.names) > LARGEST_SET and fitter.excess(best.fit) < LITTLE
    before = calm if is_settled else calm.part
    least = as_filtered(fitter, best).bic
    if min(one.bic for one in (root, *sets)) > least - NAMING_MARGIN:
        return None
    rough = Search(fitter, calm.workers, calm.on_progress, with_sea(fitter, calm.base), root, before)
    found = rough.run(sets)
    return (rough, found) if found.bic < least else None


def in_plain_waves(calm: Search, waves: Explanation) -> Explained:
    """The search among waves that were plain to see.

    Where something is left then, what is hidden may only pass for waves.
    """
    search, found, told = searched_among(calm, waves, as_filtered(calm.fitter, calm.root).bic)
    return Explained(found, search, left_among(calm.fitter, told), told)


def against(plain: Explained, waves: Explanation, best: Explanation) -> Explained | None:
    """What was found among plain waves, where these alone explain more than the best without them."""
    least = as_filtered(plain.search.fitter, best).bic
    if plain.waves is None or waves.bic > least - NAMING_MARGIN:
        return None
    return plain._replace(waves=replace(plain.waves, delta_bic=least - waves.bic))


def explains_more(plain: Explained, best: Explanation) -> bool:
    """Whether what was found among plain waves is clearly likelier than the best without them."""
    fitted = best if plain.waves is None else plain.waves.fitted
    return fitted.bic < as_filtered(plain.search.fitter, best).bic - NAMING_MARGIN


def among_waves(
    rough: Search, best: Explanation, calm: Explanation
) -> tuple[Search, Explanation, Waves | None]:
    """Where random forces that swing with a wave's period beat white ones: the search again among them.

    A filter that takes waves for white forces follows the measurements in the wrong band, and so hides what
    acts beside them. While sets are compared the waves stay as they were first found: beside the best set,
    or beside the named effects of that found without random forces, whichever is likelier.

    A moment that swings as they do is physics of no catalogue: like any such it has to be clearly likelier.
    """
    fitter, swing = rough.fitter, _swinging_as_waves_do(best)
    if WAVES in best.names and not best.fit.has_process_noise:
        return rough, best, None  # regular ones
    if not (best.fit.has_process_noise or swing) or are_by_speed(fitter, best.fit):
        return rough, best, None
    rough.on_progress("waves")
    plain = best  # what swings in the band of waves may be the waves
    for name in sorted(swing):
        plain = rough.without(plain, name)
    white = plain if plain.fit.has_process_noise else with_sea(fitter, plain)
    named = calm.names & BY_NAME.keys() - {WAVES}
    beside = [with_sea(fitter, fitter.reduced(calm, named))] if named - white.names else []
    first = min(_in_own_waves(rough, [white, *beside]), key=lambda e: e.bic)
    if not is_sea(first.fit):
        return rough, best, None
    first, least = _lean(rough, first), as_filtered(fitter, best).bic
    enough = NAMING_MARGIN if SWINGING_MOMENT.name in swing else -NAMING_MARGIN
    if first.bic > least + enough or not is_sea(first.fit):
        return rough, best, None
    without = min(as_filtered(fitter, plain).bic, white.bic) if swing else least
    search, found, told = searched_among(rough, first, without)
    return search, found, replace(told, rivalled=without - least)


def _swinging_as_waves_do(best: Explanation) -> Names:
    """The members that swing with a period of surface waves."""
    swings = {SWINGING_MOMENT.name: SWINGING_MOMENT, WAVES: named(WAVES)}
    known = dict(zip(best.fit.structure.names, best.fit.parameters.tolist(), strict=True))
    periods = {name: known[swings[name].parameters[-1].name] for name in best.names & swings.keys()}
    shortest, longest = WAVE_PERIODS
    return frozenset(name for name, period in periods.items() if shortest <= period <= longest)


def _in_own_waves(search: Search, sets: list[Explanation]) -> list[Explanation]:
    """Each set among the waves that are likeliest beside it."""
    return search.workers.results([(with_waves, (one,)) for one in sets])


def _lean(search: Search, among: Explanation) -> Explanation:
    """The set less what does not pay once the waves are estimated without it: they may do its work."""
    while names := _doubted(search, among):
        fewer = [search.fitter.reduced(among, among.names - {name}) for name in names]
        best = min(_in_own_waves(search, fewer), key=lambda e: e.bic)
        if best.bic > among.bic + margin(among):
            break
        among = best
    return among


def _doubted(search: Search, among: Explanation) -> list[str]:
    """The members that waves may do without; of a large set not those that are clearly needed in any."""
    if len(among.names) <= LARGEST_SET or among.names not in search.tried:
        return sorted(among.names)
    found = search.tried[among.names]
    fewer = zip(sorted(found.names), search.each_without(found, sorted(found.names)), strict=True)
    return [name for name, one in fewer if one.bic < found.bic + DOUBTED]


def _in_waves_of(fitter: Fitter, first: Explanation, names: Names) -> Explanation:
    """The base, or the root, in the waves of another explanation and from its parameters."""
    if names == first.names:
        return first
    added = next(iter(names - first.names), None)
    start = fitter.point(names, first, added, np.zeros(len(FREE_TRIM.parameters)))
    return fitter.explained(names, fitter.carried_on(start))


def searched_among(known: Search, first: Explanation, least: float) -> tuple[Search, Explanation, Waves]:
    """The search in the waves of `first`; `least` is the BIC of the best without them."""
    search = search_among(known, first)
    found, fitted = beside_own_waves(search, first, search.run([first]))
    return search, found, told_waves(known.fitter, fitted, least - first.bic)


def search_among(known: Search, first: Explanation) -> Search:
    """A search in the waves of `first`."""
    known.on_progress("in the waves")
    base, root = (_in_waves_of(known.fitter, first, one.names) for one in (known.base, known.root))
    return Search(known.fitter, known.workers, known.on_progress, base, root, known.part)


def beside_own_waves(
    search: Search, first: Explanation, found: Explanation
) -> tuple[Explanation, Explanation]:
    """What was found in the waves of `first`, without what those beside it do, there and among its own."""
    fitted = first if found.names == first.names else _lean(search, with_waves(search.fitter, found))
    for name in sorted(found.names - fitted.names):
        found = search.without(found, name)
    return found, fitted


def left_among(fitter: Fitter, waves: Waves) -> Leftover:
    """What is left among waves: smooth as well where a form of unknown physics gains beside them.

    Waves large enough for it take anything for chance. What swings as they do is no sign.
    """
    left = leftover(fitter, waves.fitted)
    gains = form_gains(fitter, waves.fitted)
    gains.pop(SWINGING_MOMENT.name, None)
    return replace(left, is_smooth=left.is_smooth or max(gains.values()) > margin(waves.fitted))


def told_waves(fitter: Fitter, fitted: Explanation, worth: float) -> Waves:
    """The waves that a set was found among, with what they are worth."""
    model, theirs = with_regular_waves(fitter, fitted), _of_the_waves(fitted)
    return Waves(delta_bic=worth, fitted=fitted, model=model, theirs=theirs)


def _of_the_waves(fitted: Explanation) -> Names:
    """The offsets whose moment the waves themselves may be."""
    fit, moments = fitted.fit, {}
    known = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    for name in fitted.names & {*OFFSETS}:
        _, moments[name] = as_trim(known, name) @ [known[each.name] for each in named(name).parameters]
    most = MEAN_MOMENTS * mean_moment(fit)
    return frozenset(name for name, moment in moments.items() if 0.0 < abs(moment) < most)
