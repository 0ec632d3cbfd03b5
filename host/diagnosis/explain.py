"""From the recordings to the explanation: the search, then the doubt about what it found."""

from collections.abc import Callable, Iterable
from functools import cached_property

from host.catalogue import UNKNOWN
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.disturbances.all_at_sea import again_in_a_swell, among_forces, in_a_swell, pushed_about
from host.diagnosis.disturbances.drifts import again_in_drift, among_drift, in_drift
from host.diagnosis.disturbances.seas import (
    Explained,
    again_astray,
    against,
    among_waves,
    explains_more,
    in_a_sea,
    in_plain_waves,
    led_astray,
    left_among,
)
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import leftover
from host.diagnosis.fits.margins import LARGEST_SET, LITTLE, NAMING_MARGIN
from host.diagnosis.fits.patience import is_over
from host.diagnosis.fits.sea_fits import as_filtered
from host.diagnosis.fits.workers import Workers
from host.diagnosis.plane_choice import Way
from host.diagnosis.search.damping_forms import with_drags_instead
from host.diagnosis.search.pruning import leanest
from host.diagnosis.search.rarity import told_by_the_usual
from host.diagnosis.search.search import Search
from host.diagnosis.search.unknown_physics import unknown_in, with_unknown
from host.identification.stability import is_stable


def explain(
    fitter: Fitter,
    workers: Workers,
    on_progress: Callable[[str], None],
    way: Way,
    part: Explained | None = None,
    like: Explanation | None = None,
    is_second: bool = False,
) -> Explained:
    """Searches for the best explanation, or goes on from that of a part, where most has been settled.

    is_second  the plane was taken the other way before, and all searched so
    """
    if part is not None and (settled := _of_a_part(fitter, workers, on_progress, part)) is not None:
        return settled
    before = None if part is None else part.search
    search = Search(fitter, workers, on_progress, fitter.base, fitter.root, before, way.alone)
    waves = way.waves if part is None else None
    search.asks_drift, search.is_second = waves is None, is_second
    if part is None and (whole := _begun_with_all(search, way)) is not None:
        return whole
    plain = None if waves is None else _PlainWaves(search, waves)
    if plain is not None:
        search.instead = plain.leave_nothing
    again = [fitter.refitted(one) for one in _found_in(part)] if part else _alike(fitter, like)
    search.outset = way.outset if not again else None
    best, drift = search.run(again), None
    if is_over():
        return _so_far(search, best)
    if search.adrift is not None:
        drift = in_drift(search, search.adrift)
        if drift is not None and drift.left.is_nothing:
            return drift
        if search.is_pushed_about:  # then no free run will tell more
            best = min(search.untrimmed, key=lambda e: e.bic)
        else:
            again = again or _many_in(fitter, search.tried.values())
            alone = search.alone_so_far()
            search = Search(fitter, workers, on_progress, fitter.base, fitter.root, alone=alone)
            search.is_second = is_second
            best = search.run(again)
    if is_over():
        return _so_far(search, best)
    may_be_sea = part is None or part.best.fit.has_process_noise
    if may_be_sea and (led := _led_astray(search, best)) is not None:
        return led
    if plain is not None and not leftover(fitter, best).is_nothing:
        swung = plain.instead_of(best)
        if swung is not None and swung.left.is_nothing:
            return swung
    known = best
    if not way.apart or fitter.excess(best.fit) > LITTLE:  # a turn dies away beyond what was left out of it
        best = _beside_what_is_unknown(search, best)
    if is_over():
        return _so_far(search, best)
    if may_be_sea and (unknown_in(best) or not leftover(fitter, best).is_nothing):
        may_swing = part is None or part.waves is not None
        return _in_disturbed_water(search, known, best, plain, drift, may_swing)
    return _leanest(search, best)


def _so_far(search: Search, best: Explanation) -> Explained:
    """What a search has found that ends before it has asked all."""
    return Explained(best, search, leftover(search.fitter, best), None)


def _of_a_part(
    fitter: Fitter, workers: Workers, on_progress: Callable[[str], None], part: Explained
) -> Explained | None:
    """All of it under the waves, the forces or the drift that a part was found beside; None beside none."""
    if part.is_of_all and part.waves is not None:
        return again_in_a_swell(fitter, workers, on_progress, part, part.waves)
    if part.is_of_all or part.left.is_by_speed:
        return again_astray(fitter, workers, on_progress, part)
    if part.best.fit.has_coloured_noise:
        return again_in_drift(fitter, workers, on_progress, part)
    return None


def _begun_with_all(search: Search, way: Way) -> Explained | None:
    """What is found from all that every vehicle has among waves or random forces, where these were told.

    And among waves without which all of it is far from the recording.
    """
    if way.pushed is not None:
        if way.is_astray and way.calm is not None:
            return among_forces(search, way.pushed, way.calm)
        return pushed_about(search, way.pushed, are_far_likelier=way.calm is not None)
    found = None if way.swell is None else in_a_swell(search, way.swell)
    if found is None and way.waves is not None and way.calm is not None:
        return against(in_plain_waves(search, way.waves), way.waves, way.calm)
    return found


class _PlainWaves:
    """The search among waves that were plain to see, which takes long: begun when it is first asked for."""

    def __init__(self, calm: Search, waves: Explanation) -> None:
        self._calm, self._waves = calm, waves

    @cached_property
    def _found(self) -> Explained:
        return in_plain_waves(self._calm, self._waves)

    def leave_nothing(self) -> bool:
        """Whether waves and a few effects explain it all: then it needs no dozen effects without waves."""
        return self._found.left.is_nothing

    def instead_of(self, best: Explanation) -> Explained | None:
        """What was found among them, where they alone explain more than the best set without them."""
        return against(self._found, self._waves, best)


def _led_astray(search: Search, best: Explanation) -> Explained | None:
    """The same under slight forces, where these lead every free run away and no form does more; else None."""
    if best.fit.has_process_noise or leftover(search.fitter, best).is_nothing:
        return None
    if (led := led_astray(search, best)) is None:
        return None
    left = leftover(search.fitter, led[1])
    is_led = search.follows_no_free_run or left.is_nothing
    if not is_led or _does_a_form_more(search, best, led[1]):
        return None
    return Explained(led[1], led[0], left, None)


def _does_a_form_more(search: Search, best: Explanation, led: Explanation) -> bool:
    """Whether forms of unknown physics are likelier than forces that may be errors of the measured speed.

    What wanders in a vehicle leads a free run away as well, and such forces follow it; from a hull that does
    not hold its course by itself it cannot be told.
    """
    if not is_stable(led.fit):
        return False
    grown = with_unknown(search, best)
    return bool(unknown_in(grown)) and as_filtered(search.fitter, grown).bic < led.bic - NAMING_MARGIN


def _beside_what_is_unknown(search: Search, best: Explanation) -> Explanation:
    """The set with forms of unknown physics, or effects that joined beside them, where these pay.

    Where no free run comes near, none tells one form from another.
    """
    is_all = not best.names and leftover(search.fitter, best).is_nothing
    if search.is_pushed_about or is_all:
        return best
    grown = with_unknown(search, best)
    if grown is not best and not unknown_in(grown):
        return told_by_the_usual(search, grown)  # what joined late has not been asked yet
    return grown


def _in_disturbed_water(
    search: Search,
    known: Explanation,
    best: Explanation,
    plain: "_PlainWaves | None",
    drift: Explained | None,
    may_swing: bool,
) -> Explained:
    """The same in waves, under random forces or beside what drifts, whichever explains most.

    known      what was found without forms of unknown physics
    drift      what was found beside what drifts, where that was plain
    may_swing  whether forces may swing as waves do
    """
    fitter = search.fitter
    swung = None if plain is None else plain.instead_of(known)
    if swung is not None and swung.left.is_nothing:
        return swung
    calm = best
    search, best = in_a_sea(search, best)
    if is_over():
        return _so_far(search, best)
    if swung is not None and explains_more(swung, best):
        return swung
    if may_swing:
        search, best, told = among_waves(search, best, calm)
        if told is not None:
            return Explained(best, search, left_among(fitter, told), told)
    if not leftover(fitter, best).is_by_speed:
        drift = drift or among_drift(search, best)
        if drift is not None and drift.best.bic < as_filtered(fitter, best).bic - NAMING_MARGIN:
            return drift
    return _leanest(search, best)


def _leanest(search: Search, best: Explanation) -> Explained:
    """The set less what does not pay after all, and what unknown physics gains even under random forces."""
    best = leanest(search, with_drags_instead(search, best))
    left = leftover(search.fitter, best)
    if best.fit.has_process_noise and left.is_nothing and not left.is_by_speed:
        grown = with_unknown(search, best)  # forces large enough for it take anything for noise
        if unknown_in(grown):
            best, left = grown, leftover(search.fitter, grown)
    return Explained(best, search, left, None)


def _alike(fitter: Fitter, like: Explanation | None) -> list[Explanation]:
    """The set of a similar vehicle, where it is one of many effects and leaves little: a long search less."""
    if like is None or len(like.names) <= LARGEST_SET or like.fit.has_process_noise:
        return []
    again = fitter.refitted(like)
    return [again] if fitter.excess(again.fit) < LITTLE else []


def _many_in(fitter: Fitter, tried: Iterable[Explanation]) -> list[Explanation]:
    """The likeliest set of all that were tried, where it is one of many effects and little is left."""
    best = min(tried, key=lambda e: e.bic)
    leaves_little = best.leaves_white or fitter.excess(best.fit) < LITTLE
    return [best] if len(best.names) > LARGEST_SET and leaves_little else []


def _found_in(part: Explained) -> list[Explanation]:
    """What explains a part best; and with names alone: a form fitted to a part may run away on the whole."""
    names_only = (e for e in part.search.tried.values() if not e.names & {FREE_TRIM.name, *UNKNOWN})
    return [part.best, min(names_only, key=lambda e: e.bic)] if unknown_in(part.best) else [part.best]
