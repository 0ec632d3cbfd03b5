"""Which sets grow from which: single effects, pairs, and on to four, a few carried side by side.

Where far too much is left what every vehicle has joins at once (host.diagnosis.search.together), unless two
effects leave far less than that; and one form of unknown physics (host.diagnosis.search.lone_form) may leave
less than many.
"""

from typing import TYPE_CHECKING

from host.catalogue import UNKNOWN, named
from host.catalogue.kin import is_time
from host.catalogue.nuisance import FREE_TRIM
from host.catalogue.unknown import WANDERING
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.margins import FEW, LARGEST_SET, LITTLE, MUCH, NAMING_MARGIN, SMALL, margin
from host.diagnosis.fits.patience import is_over
from host.diagnosis.fits.workers import Task
from host.diagnosis.search.candidates import candidates, eligible
from host.diagnosis.search.lone_form import lone_form
from host.diagnosis.search.offset_choice import with_offset
from host.diagnosis.search.together import at_once, together
from host.likelihood.valleys import has_usual_heave

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

BEAM = 4  # single effects carried on
FAIR_PART = 0.3  # of what the best set gains: what explains less is no parent
NARROW = 2  # of larger sets, which cost most and of which there are most
PROMISING = 6
FAR_LESS = 0.5  # of what a dozen effects leave: two that come so near are the way to go on


def beam_search(search: "Search") -> None:
    """Sets of up to four effects, carried side by side, and what joins at once; all are remembered."""
    beam = [search.remember(search.root)]
    foreign, leading, enough, postponed = None, search.root, None, None
    for size in range(1, LARGEST_SET + 1):
        if size > 1 and is_over():
            return
        if size == 2 and _needs_many(search, beam[0], size):
            beam = _with_best_pair(search, beam)
        if foreign is None and _needs_many(search, beam[0], size):
            joint = at_once(search, beam)
            pair = _pair_instead(search, beam[0], joint) if size == 2 else None
            if pair is not None:
                beam, postponed = [pair], joint
            elif (
                _is_explained_otherwise(search, joint)
                or together(search, beam[0], joint) is not None
                or search.is_led_elsewhere
            ):
                break
        found = search.singles() if size == 1 else grown(search, beam, size)
        best_before = min(e.bic for e in beam)
        beam = _parents(search, found)[: BEAM if size == 1 else NARROW]
        if size == 1 and beam and search.fitter.excess(beam[0].fit) > LITTLE:
            beam = [*with_offset(search, beam[:NARROW]), *beam[NARROW:]][:BEAM]
        if beam and beam[0].leaves_white and search.fitter.excess(beam[0].fit) < LITTLE:
            del beam[1:]  # whatever grows from the others is not likelier
        if foreign is not None and (not beam or foreign.bic < beam[0].bic - margin(foreign)):
            search.remember(foreign)  # no pair of the catalogue does as well
            break
        if not beam or beam[0].bic > best_before - margin(beam[0]):
            break
        if size == 1:
            leading, enough = beam[0], _most_without_form(search, beam[0])
        if size == enough:
            foreign = lone_form(search, leading)
            if foreign is not None and foreign.names & WANDERING:
                joint = at_once(search, [leading])
                pair = _pair_instead(search, leading, joint)
                if pair is not None:
                    beam, postponed = [pair], joint
                elif _is_only_flexible(search, foreign, leading, joint):
                    if search.fitter.excess(leading.fit) > MUCH:
                        break
                    foreign = None  # one effect more may do as well as all these
    if postponed is not None and not is_over() and _leave_something(search) and not search.instead():
        together(search, leading, postponed)


def _leave_something(search: "Search") -> bool:
    """Whether more than a little is left by the catalogue alone: a form that wanders follows anything."""
    known = (e for names, e in search.tried.items() if not names & UNKNOWN.keys())
    return search.fitter.excess(min(known, key=lambda e: e.bic).fit) > LITTLE


def _needs_many(search: "Search", leading: Explanation, size: int) -> bool:
    """Whether it is time, once, to try all that every vehicle has: far too much is left, or too much."""
    if size == 1 or search.joint or search.root.fit.has_process_noise:
        return False
    return search.fitter.excess(leading.fit) > (MUCH if size <= SMALL else LITTLE)


def _is_explained_otherwise(search: "Search", joint: Explanation) -> bool:
    """Whether all that every vehicle has leaves much, and waves, whose search takes longer, nothing."""
    search.is_needless = search.fitter.excess(joint.fit) > MUCH and search.instead()
    return search.is_needless


def _with_best_pair(search: "Search", singles: list[Explanation]) -> list[Explanation]:
    """The sets led by the likeliest pair of the first and another of them, if that leaves less than much.

    Two that each explain much may be all that acts: then a dozen need not join. Of two that both come late
    the one has done the other's work as well, up to its bound, and left little to tell of it: so those pair
    with each other, and are begun from both.
    """
    first, *others = singles
    names = [name for one in others for name in one.names - first.names]
    times = [effect.name for effect in eligible(search) if is_time(effect)]
    own = [name for name in times if name in first.names]
    late = [name for name in times if name not in first.names] if own else []
    tasks = [search.growth(first, name) for name in dict.fromkeys([*names, *late])]
    alone = [search.tried.get(search.root.names | {name}) for name in late]
    tasks += [search.growth(one, name) for one in alone if one is not None for name in own]
    pairs = [search.remember(e) for e in search.workers.results(tasks)]
    best = min(pairs, key=lambda e: e.bic, default=first)
    return [best, *singles] if search.fitter.excess(best.fit) < MUCH else singles


def _pair_instead(search: "Search", leading: Explanation, joint: Explanation) -> Explanation | None:
    """The likeliest set of the leading one and one effect, where that leaves far less than a dozen do."""
    if search.fitter.excess(joint.fit) < LITTLE:
        return None
    pair = min(grown(search, [leading], 2), key=lambda e: e.bic, default=leading)
    return pair if search.fitter.excess(pair.fit) < FAR_LESS * search.fitter.excess(joint.fit) else None


def _most_without_form(search: "Search", leading: Explanation) -> int | None:
    """So many effects need no look at forms of unknown physics, more do; None among forces.

    Of one that leaves much, one form may do the work at once.
    """
    if search.root.fit.has_process_noise:
        return None
    return 1 if search.fitter.excess(leading.fit) > LITTLE else SMALL


def _is_only_flexible(
    search: "Search", foreign: Explanation, leading: Explanation, joint: Explanation
) -> bool:
    """Whether what wanders with time only stands for what every vehicle has, which moves as slowly."""
    if _is_explained_otherwise(search, joint):
        return False
    settled = together(search, leading, joint)
    return settled is not None and settled.bic < foreign.bic


def _parents(search: "Search", found: list[Explanation]) -> list[Explanation]:
    """The best sets, as far as they explain a fair part of what the very best does."""
    ordered = sorted(found, key=lambda e: e.bic)[:BEAM]
    gains = [search.root.bic - e.bic for e in ordered]
    return [e for e, gain in zip(ordered, gains, strict=True) if gain > FAIR_PART * gains[0]]


def grown(search: "Search", parents: list[Explanation], size: int) -> list[Explanation]:
    """Each parent with each promising effect more."""
    tasks: dict[Names, Task] = {}
    for parent in parents:
        for name in _promising(search, parent, size, parent is parents[0]):
            tasks.setdefault(parent.names | {name}, search.growth(parent, name))
    sets = list(tasks)

    def say(number: int) -> None:
        names = sets[number]
        count, label = len(names - {FREE_TRIM.name}), " + ".join(sorted(names))
        search.on_progress(f"{count} effect{'s' * (count > 1)}, {number + 1}/{len(sets)}: {label}")

    found = search.workers.results(list(tasks.values()), say)
    return [search.remember(explanation) for explanation in found]


def _promising(search: "Search", parent: Explanation, size: int, is_leading: bool) -> list[str]:
    """Effects to fit in earnest: all at first, later those predicted to gain most.

    The prediction is local. A base bent far from the truth hides what the common effects, which trade
    against its own coefficients, would gain once all of them are free; so until little is left these
    are always tried, unless all at once. Of a base whose heave is none of a hull, twice as many.
    """
    others = candidates(search, parent)
    if size == 1 and not search.root.fit.has_process_noise:
        return others
    gains = search.gains(parent, is_leading)
    many = PROMISING if has_usual_heave(parent.fit.end) else 2 * PROMISING
    best = sorted(gains, key=lambda name: -gains[name])[: many if size == 2 else FEW]
    worth = {name for name in best if gains[name] > NAMING_MARGIN}
    is_far = size <= 2 and search.fitter.excess(parent.fit) > LITTLE
    # What every vehicle has was tried at once and leads nowhere, if it was.
    is_far &= not search.root.fit.has_process_noise and not search.joint
    return [name for name in others if name in worth or (is_far and named(name).is_common)]
