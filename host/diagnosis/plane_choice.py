"""Whether a plane held its angles between rows or moved on (host.recordings.plane_between_rows)."""

from collections.abc import Callable
from functools import partial
from math import inf
from typing import NamedTuple

from host.catalogue import DRIVE
from host.catalogue.moments import SCANS
from host.catalogue.nuisance import FREE_TRIM
from host.catalogue.unknown import LEADING_FORMS
from host.diagnosis.disturbances.plain_waves import plain_waves, whole_in_waves
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import LARGEST_SET, LITTLE, MUCH, NAMING_MARGIN, margin
from host.diagnosis.fits.patience import is_over
from host.diagnosis.fits.sea_fits import as_filtered, lead_away, with_sea, with_waves
from host.diagnosis.fits.workers import Workers
from host.diagnosis.plane_astray import astray_share, whole_astray
from host.diagnosis.recordings.spans import divide, excerpt
from host.diagnosis.search.apart import BENT, stretches_apart
from host.diagnosis.search.led_by_filter import led_by_a_filter
from host.diagnosis.search.outset import (
    LOST,
    at_the_outset,
    beside_what_leads,
    leads_on,
    one_says_most,
    one_that_says_all,
    pushed_by_forces,
    says_all,
)
from host.diagnosis.search.search import Search
from host.diagnosis.search.several_speeds import at_several_speeds
from host.diagnosis.search.short_runs import followed_shortly, short_runs
from host.diagnosis.search.whole_vehicle import is_real, with_all_ordinary
from host.likelihood.valleys import look_alikes
from host.recordings.left_out import Span, without
from host.recordings.plane_between_rows import ways_between, with_plane_astray
from host.recordings.recording import Recording

FAR_LIKELIER = 1.0  # of BIC a sample: what no search without waves makes up for
FORCED = 0.5  # the same, of random forces: so much leads any free run away
CONTENDERS = 10  # sets that are tried with the plane the other way
MOST_WAYS = 2  # that are searched: the base equations tell a third from these
APART = "other physics acts, and left out"
LEADING = 3  # single effects, of which the likeliest often is a part of the truth


class Way(NamedTuple):
    """The recordings with the plane taken one way, and the base fitted to what a search begins with.

    waves  the root among waves, where these are plain to see
    outset  the root with all that every vehicle has, where that leaves nothing, or next to nothing
    swell  the same among waves that are estimated beside it, where that leaves nothing
    calm    the same without waves or random forces, where these explain far more
    pushed  the same under random forces, where nothing in the catalogue gains beside these
    alone  each effect alone, where these were fitted
    apart  stretches of the recording, s, in which other physics acts, and which were left out
    is_astray  the plane moved between rows as they do not show, and `pushed` is beside that
    """

    recordings: list[Recording]
    fitter: Fitter
    waves: Explanation | None = None
    outset: Explanation | None = None
    swell: Explanation | None = None
    calm: Explanation | None = None
    pushed: Explanation | None = None
    alone: tuple[Explanation, ...] = ()
    apart: tuple[Span, ...] = ()
    is_astray: bool = False


def ways(recordings: list[Recording]) -> list[Way]:
    """The recordings with a plane that held its angles and with one that moved, the likeliest two.

    As the base equations see them: what is left out may favour the other.
    """
    tried = ways_between(recordings)
    teaching = [divide(each).teaching for each in tried]
    parts = [excerpt(runs, like=teaching[0]) for runs in teaching]
    fitted = [Way(each, Fitter(part)) for each, part in zip(tried, parts, strict=True)]
    return sorted(fitted, key=lambda way: way.fitter.base.bic)[:MOST_WAYS]


def likelier_first(
    found: list[Way], on_progress: Callable[[str], None], jobs: int, may_leave_out: bool = False
) -> list[Way]:
    """The ways, the likelier first, as what tells more than the base equations do sees them.

    That is all that every vehicle has, where nothing is left beside it; else plain waves, where there are
    any, with all that where it is likelier; else single effects, where one says most; else all that every
    vehicle has, where random forces account for what is left, or next to nothing is; else single effects.
    Where these forces explain far more without accounting for it all, they tell which way. A plane that moved
    more often than its rows show leaves one. Where what may lead leaves something, a filter that leads
    the hull where no free run does is asked, without that and beside it.

    may_leave_out  whether stretches may be left out without which nothing is left beside it
    """
    leading, *others = sorted(found, key=lambda way: way.fitter.root.bic)
    on_progress("what every vehicle has")
    whole = at_the_outset(leading.fitter)
    if whole is not None and says_all(leading.fitter, whole):
        return _begun_with([leading, *others], whole)
    one = None if whole is None else one_that_says_all(leading.fitter, whole, jobs)
    seen, asked = _among_waves(found), None
    if whole is not None and one is None and not seen and one_says_most(leading.fitter, whole, jobs):
        return by_single_effects(found, on_progress, jobs)
    beside = None if whole is None or one or is_over() else beside_what_leads(leading.fitter, whole, jobs)
    if whole is not None and beside is not None and not says_all(leading.fitter, beside) and not is_over():
        asked = whole
        if not seen and (led := _led_by_a_filter([leading, *others], whole, whole, on_progress, jobs)):
            return led
        told, whole = _at_speeds_or_in_short_runs([leading, *others], whole, on_progress, jobs, may_leave_out)
        if told:
            return told
        if whole is not asked:
            beside = None if is_over() else beside_what_leads(leading.fitter, whole, jobs)
    plain = whole
    whole = one or beside or whole
    if seen:
        on_progress("what every vehicle has, in the waves")
        return _in_a_swell(seen, whole)
    if whole is not None and is_over():
        return _begun_with([leading, *others], whole)
    if whole is not None and (astray := _astray([leading, *others], whole, on_progress)):
        return astray
    if may_leave_out and whole is not None and leading.fitter.excess(whole.fit) > BENT:
        on_progress("stretches of other physics, as most tell")
        short = short_runs(leading.recordings, whole)
        if short is not None and (apart := stretches_apart(short, jobs, as_most_tell=True).spans):
            return _without(leading, apart, on_progress, jobs)
        if is_over():
            return _begun_with([leading, *others], whole)
    if plain is not None and whole is not None and whole is not asked and not is_over():
        # What goes with time or depth may follow what water does at random: then it leads nowhere.
        hull = plain if whole.names.isdisjoint({*SCANS, *DRIVE, *LEADING_FORMS}) else whole
        if led := _led_by_a_filter([leading, *others], hull, whole, on_progress, jobs):
            return led
    begun, leads = [leading, *others], whole is not None and leads_on(leading.fitter, whole)
    if whole is not None and leads:
        seen_by_all = _as_seen_by(begun, leading.fitter.polished(whole))
        begun = [way._replace(outset=own) for way, own in seen_by_all]
        whole = begun[0].outset
    if whole is not None and (forced := _as_seen_under_forces(begun, whole)):
        begun, whole = [way for way, _ in forced], forced[0][1]
        leads = True
    pushed = [] if whole is None else _pushed_about(begun, whole, on_progress, jobs)
    return pushed or (begun if leads else by_single_effects(found, on_progress, jobs))


def _led_by_a_filter(
    found: list[Way], hull: Explanation, free: Explanation, on_progress: Callable[[str], None], jobs: int
) -> list[Way]:
    """The ways as a filter sees them that leads the hull, where no free run of all that is known does."""
    return _led(found, free, partial(led_by_a_filter, whole=hull, free=free), on_progress, jobs)


def _at_speeds_or_in_short_runs(
    found: list[Way], whole: Explanation, on_progress: Callable[[str], None], jobs: int, may_leave_out: bool
) -> tuple[list[Way], Explanation]:
    """The ways at several speeds, or as short runs tell them, none where neither does; and the whole."""
    fitter = found[0].fitter
    if fitter.excess(whole.fit) > LOST:
        whole = at_several_speeds(fitter, whole)
    if says_all(fitter, whole):
        return _begun_with(found, whole), whole
    if not may_leave_out or fitter.excess(whole.fit) < MUCH:
        return [], whole
    return _in_short_runs(found, whole, on_progress, jobs)


def _in_short_runs(
    found: list[Way], whole: Explanation, on_progress: Callable[[str], None], jobs: int
) -> tuple[list[Way], Explanation]:
    """The ways as short runs tell them, none where these tell nothing; and the whole with what they add.

    Without stretches that are apart, with what explains these, or led by what short runs teach.
    """
    leading = found[0]
    on_progress("stretches of other physics")
    if (short := short_runs(leading.recordings, whole)) is None:
        return [], whole
    apart, instead = stretches_apart(short, jobs)
    if apart:
        return _without(leading, apart, on_progress, jobs), whole
    if instead is not None:
        whole = min(whole, leading.fitter.refitted(instead), key=lambda e: e.bic)
        if says_all(leading.fitter, whole):
            return _begun_with(found, whole), whole
    taught = partial(followed_shortly, whole=whole, short=short)
    return _led(found, whole, taught, on_progress, jobs), whole


def _without(leading: Way, apart: list[Span], on_progress: Callable[[str], None], jobs: int) -> list[Way]:
    """The ways without these stretches, the likelier first."""
    rest = likelier_first(ways(without(leading.recordings, apart, APART)), on_progress, jobs)
    return [way._replace(apart=tuple(apart)) for way in rest]


def _begun_with(found: list[Way], whole: Explanation) -> list[Way]:
    """The ways, the likelier first, to begin with this set."""
    return [way._replace(outset=own) for way, own in _as_seen_by(found, whole)]


def _as_seen_by(found: list[Way], one: Explanation) -> list[tuple[Way, Explanation]]:
    """The ways, the likelier first, as a set sees them that was fitted to the first; with each its own."""
    sets = [one, *(_taken_so(way.fitter, one) for way in found[1:])]
    return sorted(zip(found, sets, strict=True), key=lambda pair: pair[1].bic)


def _taken_so(fitter: Fitter, one: Explanation) -> Explanation:
    """A set that was fitted to the plane taken another way, in the likelier valley: a lag may do for that."""
    here = fitter.reduced(one, one.names)
    if one.fit.has_process_noise:
        return here
    others = (fitter.entered(start, here) for start in look_alikes(here.fit.end))
    return min([here, *others], key=lambda e: e.bic)


def _among_waves(found: list[Way]) -> list[Way]:
    """The ways among waves, where these are plain to see in the first; else none."""
    leading, *rest = found
    if (waves := plain_waves(leading.fitter)) is None:
        return []
    seen = [leading._replace(waves=waves), *(way._replace(waves=plain_waves(way.fitter)) for way in rest)]
    return sorted(seen, key=lambda way: inf if way.waves is None else way.waves.bic)


def _in_a_swell(seen: list[Way], whole: Explanation | None) -> list[Way]:
    """The ways among waves as all that every vehicle has beside these sees them, where it says more."""
    leading, *others = seen
    if whole is None or leading.waves is None:
        return seen
    fitter, waves = leading.fitter, leading.waves
    lost = as_filtered(fitter, whole).bic - waves.bic
    if lost > FAR_LIKELIER * whole.fit.samples and fitter.excess(waves.fit) < LITTLE:
        leading = leading._replace(calm=whole)
    swell = whole_in_waves(fitter, waves, whole)
    begun = [leading, *others]
    if swell is None:
        return begun
    return [way._replace(swell=own) for way, own in _as_seen_by(begun, swell)]


def _astray(found: list[Way], whole: Explanation, on_progress: Callable[[str], None]) -> list[Way]:
    """The way whose plane moved on, if more often than its rows show, as all that every vehicle has sees it.

    Under random forces, and where these explain far more than it does alone; else none.
    """
    moving = [way for way in found if any(one.plane_moved is not None for one in way.recordings)]
    if not moving or found[0].fitter.excess(whole.fit) < MUCH:
        return []
    on_progress("a plane that moved more often than it was recorded")
    fitter = moving[0].fitter
    if not (share := astray_share(fitter)):
        return []
    calm = whole if moving[0] is found[0] else _taken_so(fitter, whole)
    sea = with_sea(fitter, calm)
    if not lead_away(fitter, calm, sea, FORCED):
        return []
    recordings = [with_plane_astray(one, share) for one in moving[0].recordings]
    fitter = Fitter(excerpt(divide(recordings).teaching))
    return [Way(recordings, fitter, pushed=whole_astray(fitter), calm=calm, is_astray=True)]


def _led(
    found: list[Way],
    whole: Explanation,
    lead: Callable[[Search], Explanation | None],
    on_progress: Callable[[str], None],
    jobs: int,
) -> list[Way]:
    """The ways as what leads a vehicle sees them that no free run follows; none where it leads nowhere."""
    fitter = found[0].fitter
    with Workers(fitter, jobs) as workers:
        pushed = lead(Search(fitter, workers, on_progress, fitter.base, fitter.root))
    if pushed is None:
        return []
    return [way._replace(pushed=own, calm=whole) for way, own in _as_seen_by(found, pushed)]


def _as_seen_under_forces(found: list[Way], whole: Explanation) -> list[tuple[Way, Explanation]]:
    """The ways, the likelier first, as all that every vehicle has sees them under random forces.

    With each that set without these. None where they explain little: where they do, what leads a free run
    away decides which way that follows better.
    """
    leading, *others = found
    if not others or leading.fitter.excess(whole.fit) < LITTLE:
        return []
    sea = with_sea(leading.fitter, whole)
    if not lead_away(leading.fitter, whole, sea, FORCED):
        return []
    sets = [whole, *(way.outset or _taken_so(way.fitter, whole) for way in others)]
    seas = [sea, *(with_sea(way.fitter, own) for way, own in zip(others, sets[1:], strict=True))]
    order = sorted(range(len(found)), key=lambda i: seas[i].bic)
    return [(found[i], sets[i]) for i in order]


def _pushed_about(
    found: list[Way], whole: Explanation, on_progress: Callable[[str], None], jobs: int
) -> list[Way]:
    """The ways as all that every vehicle has under random forces sees them, where these explain the rest."""
    fitter = found[0].fitter
    with Workers(fitter, jobs) as workers:
        pushed = pushed_by_forces(Search(fitter, workers, on_progress, fitter.base, fitter.root), whole)
    if pushed is None:
        return []
    is_far = as_filtered(fitter, whole).bic > pushed.bic + FAR_LIKELIER * pushed.fit.samples
    calm = whole if is_far else None
    return [way._replace(pushed=own, calm=calm) for way, own in _as_seen_by(found, pushed)]


def by_single_effects(found: list[Way], on_progress: Callable[[str], None], jobs: int) -> list[Way]:
    """The ways, the likelier first, as the effects see them that explain most alone, or a linear hull.

    The base equations bend towards what they lack, and may follow the wrong way better by chance.
    """
    if len(found) == 1:
        return found
    leading, other = sorted(found, key=lambda way: min(way.fitter.root.bic, way.fitter.linear.bic))
    with Workers(leading.fitter, jobs) as workers:
        search = Search(leading.fitter, workers, on_progress, leading.fitter.base, leading.fitter.root)
        leading = leading._replace(alone=tuple(search.singles()))
    best = sorted(leading.alone, key=lambda e: e.bic)[:LEADING]
    least = min(leading.fitter.root.bic, best[0].bic, leading.fitter.linear.bic) - NAMING_MARGIN
    alone = (other.fitter.reduced(e, e.names).bic for e in best)
    if min(other.fitter.root.bic, *alone, other.fitter.linear.bic) >= least:
        return [leading, other]
    with Workers(other.fitter, jobs) as workers:
        there = workers.results([(Fitter.reduced, (e, e.names)) for e in leading.alone])
    return [other._replace(alone=tuple(there)), leading]


def is_likelier(
    other: Way, search: Search, best: Explanation, in_own_waves: Explanation | None = None
) -> bool:
    """Whether what was searched is explained clearly better with the plane the other way.

    By the same set, by one less of its members, by another that came close, or by the best with all that
    every vehicle has: taken the wrong way, the plane is made up for by what is not there, and what is there
    falls behind.

    in_own_waves  the best set among waves that were estimated beside it, if any: the search compared sets in
                  waves as they were first found, from which others may part for better ones
    """
    fitter = Fitter(other.fitter.recordings, known=best)
    if in_own_waves is not None:
        # Each takes waves of its own to estimate: of many too long.
        fewer = _leaner(in_own_waves) if len(in_own_waves.names) <= LARGEST_SET else []
        sets = [in_own_waves, *(fitter.reduced(in_own_waves, names) for names in fewer)]
        return min(with_waves(fitter, one).bic for one in sets) < in_own_waves.bic - margin(in_own_waves)
    bare = [(e.names - {FREE_TRIM.name}, e) for e in sorted(search.tried.values(), key=lambda e: e.bic)]
    close = {best.names: best} | {names: e for names, e in bare[::-1] if names in _leaner(best)}
    for names, explanation in bare:
        if len(close) < CONTENDERS:
            close.setdefault(names, explanation)
    least = best.bic - margin(best)
    if any(fitter.reduced(explanation, names).bic < least for names, explanation in close.items()):
        return True
    return is_real(best.names) and not best.fit.has_process_noise and _is_whole_likelier(fitter, search, best)


def _is_whole_likelier(fitter: Fitter, search: Search, best: Explanation) -> bool:
    """Whether the vehicle is likelier so with all that it has: among that is what the wrong way lacks."""
    other = with_all_ordinary(fitter, fitter.reduced(best, best.names))
    return other.bic < search.completion(best).bic - margin(best)


def _leaner(explanation: Explanation) -> list[Names]:
    return [explanation.names - {name} for name in explanation.names]
