"""All that every vehicle has, fitted before any effect is tried alone.

The base equations bend so far to what a real vehicle has beside them that of its effects none alone says
much, and the search that begins with each takes longest. All at once take no longer than two of them: where
they leave nothing, it only has to be found which of them pay; where next to nothing, what acts beside them.
What they hardly touch is no hull's: then something may have changed under way, go with time or keep the plane
back.
"""

from collections.abc import Iterable, Iterator
from itertools import combinations
from math import inf, log
from typing import TYPE_CHECKING

import numpy as np

from host.catalogue import ALONG_THE_HULL, DRIVE, FAINT, NEAR_THE_SURFACE, ORDINARY, UNKNOWN
from host.catalogue.kin import OFFSETS
from host.catalogue.moments import SCANS
from host.catalogue.nuisance import FREE_TRIM
from host.catalogue.unknown import IN_LAYERS, LEADING_FORMS, WANDERING
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import ROUGHLY, Fitter
from host.diagnosis.fits.margins import LITTLE, MUCH, ROUGH, margin
from host.diagnosis.fits.patience import is_over
from host.diagnosis.fits.prospects import form_gains
from host.diagnosis.fits.sea_fits import as_filtered, with_sea
from host.diagnosis.fits.speed_forces import are_by_speed
from host.diagnosis.fits.starts import begun_from, guess
from host.diagnosis.fits.trims import retrimmed
from host.diagnosis.fits.workers import Workers
from host.diagnosis.recordings.spans import led_excerpt
from host.diagnosis.search.lone_form import likely_forms
from host.diagnosis.search.pruning import pruned
from host.diagnosis.search.together import with_more
from host.diagnosis.search.whole_vehicle import all_beside, ended, is_real
from host.likelihood.fit import Fit
from host.likelihood.gauss_newton import Point
from host.likelihood.valleys import A1, A2, has_damped_pitch, has_usual_heave, look_alikes

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

FAR_LESS = 0.2  # of what the root leaves
HALF = 0.5  # of what is left: a fault of the drive is no small part of it where it leads
LOST = 20.0  # times the noise floor: no hull leaves so much by what it is, but by what happens to it
MOST_FORCES = 0.1  # of the variance of all force: what acts is known but for a tenth
FAR_LIKELIER = 0.1  # of BIC a sample, under random forces
FAIR_PART = 0.02  # of what these explain, that what is missing should gain even beside them
TURNING = ("munk_moment", "heave_pitch_rate_coupling")
TRADED, TINY = 2.0, 1e-6  # times a damping: it is a pole of something else
LEADING = 3  # of what may lead, beside which all the rest is tried
IN_TIME = ("surface_waves", "internal_wave", "unknown_swinging_moment", *sorted(WANDERING))
"""What swings with one period, or wanders. Of a sea it follows a part: little must be left beside it."""
NO_HULL = ("depth_dependent_buoyancy", "depth_sensor_lag", "depth_sensor_lever_arm", "pitch_sensor_lag")
"""Of the water or of a sensor, for which no hull does."""


def at_the_outset(fitter: Fitter) -> Explanation | None:
    """The root with all that every vehicle has, where the root leaves much; None where it does not."""
    if fitter.excess(fitter.root.fit) < MUCH:
        return None
    best, names = fitter.root, names_of_all(fitter)
    told = _as_a_part_tells(fitter, names)
    for found in ends_of(fitter, names) if told is None else [told]:
        if says_all(fitter, found):
            return found
        best = min(best, found, key=lambda e: e.bic)
        if fitter.excess(best.fit) > LOST:
            break
    return best


def beside_what_leads(fitter: Fitter, best: Explanation, jobs: int = 1) -> Explanation:
    """The same beside what changes at a moment, goes with time or keeps the plane back, if that leaves less.

    Or, if that promises most, goes with the depth. Where it leads nowhere; where it leaves much, beside all
    these but what changes. With two offsets in the place of a free trim, where that is likelier.
    """
    names = _what_may_lead(fitter, best)
    if fitter.excess(best.fit) < LOST:
        best = _with_two_offsets(fitter, best, jobs)
        if says_all(fitter, best):
            return best
        fewer = _by_fewer(fitter, fitter.root, best, jobs)
        if says_all(fitter, fewer) or _keeps_heave(fewer, best):
            best = min(best, fewer, key=lambda e: e.bic)
    if fitter.excess(best.fit) < MUCH:
        return best
    layers = _layers(fitter, best)
    led = _beside_what_leads(fitter, best, (*names, *layers), jobs)
    return min([best, *led, *_joined_by(fitter, best, layers, jobs)], key=lambda e: e.bic)


def one_that_says_all(fitter: Fitter, whole: Explanation, jobs: int) -> Explanation | None:
    """The likeliest of what may lead, alone, if it leaves nothing: no turn is explained so, but by a form.

    What keeps the plane back also where all that every vehicle has does most of its work: but for a little,
    which random forces would explain. And forms that go with the motion as no turn does, dry friction, say,
    for which many entries may stand.
    """
    left = fitter.excess(whole.fit)
    if left < LITTLE:
        return None
    likely = (*DRIVE, *LEADING_FORMS)
    alone = _each_alone(fitter, (*SCANS, *likely, *IN_TIME) if left > MUCH else likely, jobs)
    best = min(alone, key=lambda e: e.bic)
    is_told = best.names.isdisjoint(UNKNOWN.keys() - {*LEADING_FORMS})
    return best if is_told and says_all(fitter, best) and best.bic < whole.bic else None


def one_says_most(fitter: Fitter, whole: Explanation, jobs: int) -> bool:
    """Whether one of the catalogue, asked alone, leaves little where all that every vehicle has does not.

    Then few effects act on a textbook's hull, whose free run can be followed.
    """
    if fitter.excess(whole.fit) < MUCH:
        return False
    _each_alone(fitter, NO_HULL, jobs)
    alone = (one for one in fitter.at_first.values() if one.names.isdisjoint(UNKNOWN))
    best = min(alone, key=lambda e: e.bic, default=whole)
    return best.bic < whole.bic and fitter.excess(best.fit) < MUCH


def _what_may_lead(fitter: Fitter, whole: Explanation) -> tuple[str, ...]:
    is_lost = fitter.excess(whole.fit) > LOST
    likely = (*DRIVE, *LEADING_FORMS, *IN_TIME)
    return (*SCANS, *likely) if is_lost else likely


def _each_alone(fitter: Fitter, names: Iterable[str], jobs: int) -> list[Explanation]:
    """Each of these beside the root, fitted once."""
    sets = {name: fitter.root.names | {name} for name in names}
    asked = [name for name, own in sets.items() if own not in fitter.at_first]
    with Workers(fitter, jobs) as workers:
        found = workers.results([(Fitter.grown, (fitter.root, name, [])) for name in asked])
    fitter.at_first |= {one.names: one.lean() for one in found}
    return [fitter.at_first[own] for own in sets.values()]


def _layers(fitter: Fitter, whole: Explanation) -> list[str]:
    """The forms that go with the depth, if one of them promises most of all forms."""
    asked = sorted(form.name for form in fitter.forms if form.name in IN_LAYERS)
    gains = form_gains(fitter, whole) if asked else {}
    leading = max(gains, key=lambda name: gains[name], default="")
    return asked if leading in asked and gains[leading] > margin(whole) else []


def _joined_by(fitter: Fitter, whole: Explanation, names: list[str], jobs: int) -> list[Explanation]:
    """The same with one of these, where that leaves less than half."""
    with Workers(fitter, jobs) as workers:
        joined = workers.results([(Fitter.grown, (whole, name, [])) for name in names])
        joined = workers.results([(Fitter.polished, (one,)) for one in joined])
    return [one for one in joined if fitter.excess(one.fit) < HALF * fitter.excess(whole.fit)]


def _as_a_part_tells(fitter: Fitter, names: Names) -> Explanation | None:
    """The set from where it leaves next to nothing of an excerpt; None where it leaves more there.

    A free run over a long recording has many maxima; over short pieces, each with a start of its own, few.
    """
    pieces = led_excerpt(fitter.recordings)
    if pieces is fitter.recordings or fitter.wander.any():
        return None
    part = Fitter(pieces)
    for found in ends_of(part, names):
        if says_all(part, found) or part.excess(found.fit) < LITTLE:
            return fitter.refitted(found)
    return None


def _with_two_offsets(fitter: Fitter, whole: Explanation, jobs: int) -> Explanation:
    """The same with two offsets in the place of the free trim, where that is likelier.

    A plane's zero error grows with the square of the speed, a weight beside it does not, and a free trim does
    as neither. One alone may be far worse than that.
    """
    if FREE_TRIM.name not in whole.names:
        return whole
    pairs = [frozenset(pair) for pair in combinations(OFFSETS, 2)]
    with Workers(fitter, jobs) as workers:
        found: list[Explanation] = workers.results([(retrimmed, (whole, pair)) for pair in pairs])
    best = min(found, key=lambda e: e.bic)
    return fitter.polished(best) if best.bic < whole.bic else whole


def _by_fewer(fitter: Fitter, leading: Explanation, whole: Explanation, jobs: int) -> Explanation:
    """The same from where all but the faint ends, which leads some fits elsewhere, with the likeliest offset.

    That of the plane grows with the square of the speed, and a free trim, which does its work, does not.

    leading  the root, or with what leads: where all of it begins
    """
    few = whole.names - {*FAINT, ALONG_THE_HULL}
    lean = ended(fitter, begun_from(fitter, leading, few), few)
    with Workers(fitter, jobs) as workers:
        others = workers.results([(retrimmed, (lean, frozenset({name}))) for name in OFFSETS])
    best: Explanation = min([lean, *others], key=lambda e: e.bic)
    names = best.names | whole.names - {FREE_TRIM.name}
    all_of_it = ended(fitter, begun_from(fitter, best, names), names)
    return all_of_it if all_of_it.fit.log_likelihood > best.fit.log_likelihood - ROUGHLY else best


def says_all(fitter: Fitter, whole: Explanation) -> bool:
    """Whether it leaves white noise, as sensors have it."""
    return whole.leaves_white and fitter.excess(whole.fit) < MUCH


def leads_on(fitter: Fitter, whole: Explanation) -> bool:
    """Whether all that every vehicle has leaves far less than the root, or beside a change not much."""
    most = MUCH if whole.names & {*SCANS} else FAR_LESS * fitter.excess(fitter.root.fit)
    return fitter.excess(whole.fit) < most


def _beside_what_leads(
    fitter: Fitter, whole: Explanation, names: Iterable[str], jobs: int
) -> list[Explanation]:
    """The likeliest of these, each with all that every vehicle has and alone, where the rest does not pay.

    The likeliest of all once more from where all but the faint ends, if something is left. Where one alone
    leaves nothing, it alone.

    whole  all that every vehicle has without these
    """
    leading = sorted(_each_alone(fitter, names, jobs), key=lambda e: e.bic)[:LEADING]
    if says_all(fitter, leading[0]):
        return leading[:1]
    with Workers(fitter, jobs) as workers:
        beside: list[Explanation] = workers.results([(all_beside, (one,)) for one in leading])
    best, begun = min(zip(beside, leading, strict=True), key=lambda pair: pair[0].bic)
    found = [*leading, *beside]
    if fitter.excess(best.fit) > LITTLE:
        found.append(_by_fewer(fitter, begun, best, jobs))
    return [e for e in found if _is_no_chance(fitter, e, whole)]


def _is_no_chance(fitter: Fitter, led: Explanation, whole: Explanation) -> bool:
    """Whether what leads does more than follow a part of a sea, as many may a little.

    Not where it takes the hull from its heave for that.
    """
    left = fitter.excess(led.fit)
    if left < LITTLE or says_all(fitter, led):
        return True
    if not _keeps_heave(led, whole):
        return False
    if led.names & {*SCANS}:
        return True
    return led.names.isdisjoint(IN_TIME) and left < HALF * fitter.excess(whole.fit)


def _keeps_heave(found: Explanation, whole: Explanation) -> bool:
    """Whether a set has a hull that heaves as usual, if the whole has: else it heaves to do others' work."""
    return has_usual_heave(found.fit.end) or not has_usual_heave(whole.fit.end)


def pushed_by_forces(search: "Search", whole: Explanation) -> Explanation | None:
    """The same under random forces, where these explain the rest and nothing gains beside them; else None.

    Then the vehicle is as the equations have it but for what pushes it about and is in no catalogue, as turns
    do; of something in the catalogue, or with a form, those forces would be the worse half. What is left
    beside a change or a fault of the plane's drive may be another of these.
    """
    fitter = search.fitter
    is_described = bool(whole.names & {*SCANS, *DRIVE, *IN_TIME, *IN_LAYERS})
    if is_described or not LITTLE < fitter.excess(whole.fit) < LOST:
        return None
    sea = with_sea(fitter, whole)
    explained = as_filtered(fitter, whole).bic - sea.bic
    are_many = (sea.fit.noise[2:] > MOST_FORCES * np.square(fitter.accelerations)).any()
    if are_many or explained < FAR_LIKELIER * sea.fit.samples or are_by_speed(fitter, sea.fit):
        return None
    return sea if is_enough_beside(search, sea, whole) else None


def is_enough_beside(search: "Search", sea: Explanation, whole: Explanation) -> bool:
    """Whether beside random forces nothing in the catalogue gains, nor any form of unknown physics.

    Not of a hull that hardly heaves, which these forces carry in its place.

    whole  without forces: of what these explain more than it does, what gains must gain a fair part
    """
    fitter = search.fitter
    if not has_usual_heave(sea.fit.end):
        return False
    explained = as_filtered(fitter, whole).bic - sea.bic
    least = max(margin(sea) + log(sea.fit.samples), FAIR_PART * explained)
    return max(*search.gains(sea).values(), *form_gains(fitter, sea).values()) < least


def goes_on_from(search: "Search", joint: Explanation) -> bool:
    """Whether many of a set of many pay, or of what else promises to beside them: then no search need begin.

    Nor where there is no time for one, nor beside a form of unknown physics, where what promises most leaves
    something and that form white noise. What pays is remembered. Of few, each alone tells more; and where
    something is left, a leading effect may.
    """
    search.on_progress("what every vehicle has")
    search.joint.add(joint.names)
    more = with_more(search, search.remember(joint), least=0.0)
    if is_over():
        return True
    if (other := _in_another_valley(search, joint)) is not None:
        more = min(more, with_more(search, other, least=0.0), key=lambda e: e.bic)
    if not (more.leaves_white or search.fitter.excess(more.fit) < LITTLE):
        more = min(more, _with_a_form(search, joint), key=lambda e: e.bic)
    is_all = more.leaves_white or search.fitter.excess(more.fit) < LITTLE
    if is_all and _is_of_a_hull(pruned(search, more)):
        return True
    search.joint.clear()  # beside what the search finds they are tried again
    return False


def _in_another_valley(search: "Search", whole: Explanation) -> Explanation | None:
    """The same where a lag and a pole of the hull have traded places, if about as likely; else None.

    What is still lacking may be all that makes the wrong one likelier, and from there no exchange comes back.
    """
    known = whole.lean()
    found = search.workers.results([(Fitter.entered, (at, known)) for at in look_alikes(whole.fit.end)])
    near = [one for one in found if one.bic < whole.bic + 2.0 * ROUGH and _have_traded(one.fit, whole.fit)]
    return search.fitter.polished(min(near, key=lambda e: e.bic)) if near else None


def _have_traded(one: Fit, other: Fit) -> bool:
    """Whether a damping of the one hull is another than that of the other: ends along a ridge share it."""
    ratios = one.parameters[[A1, A2]] / other.parameters[[A1, A2]]
    return bool((np.abs(np.log(np.maximum(ratios, TINY))) > np.log(TRADED)).any())


def _is_of_a_hull(found: Explanation) -> bool:
    """Whether a set shows a vehicle as they are built, damped as theirs are."""
    end = found.fit.end
    return is_real(found.names) and has_usual_heave(end) and has_damped_pitch(end)


def _with_a_form(search: "Search", whole: Explanation) -> Explanation:
    """The same with the likeliest form of unknown physics, where that leaves white noise; else itself.

    What promised most of the catalogue may have been taken for it, so it is asked for without that.
    """
    likely = likely_forms(form_gains(search.fitter, whole), margin(whole))
    grown: list[Explanation] = search.workers.results([search.growth(whole, name) for name in likely])
    polished = search.polished_near(grown, min((e.bic for e in grown), default=inf))
    best = min((e for e in polished if e.leaves_white), key=lambda e: e.bic, default=whole)
    search.joint.add(best.names)
    return best


def names_of_all(fitter: Fitter) -> Names:
    """All that every vehicle has beside a free trim, and what that needs on these recordings."""
    names = frozenset({FREE_TRIM.name, *ORDINARY, *FAINT, ALONG_THE_HULL})
    names |= {effect.name for effect in NEAR_THE_SURFACE if effect in fitter.candidates}
    return names | {*fitter.tools_beside(names)}


def ends_of(fitter: Fitter, names: Names) -> Iterator[Explanation]:
    """The set from where it may begin: each is fitted when it is asked for."""
    return (ended(fitter, start, names) for start in _starts(fitter, names))


def _starts(fitter: Fitter, names: Names) -> Iterator[Point]:
    """Beside the root and a hull that turns, where what joins hardly acts, and by what a regression says.

    Without a servo's lag, which alone takes a pole of the hull and leads elsewhere.
    """
    hull = fitter.root
    yield (root := begun_from(fitter, hull, names))
    for name in TURNING:
        hull = fitter.grown(hull, name, [])
    yield begun_from(fitter, hull, names)
    yield guess(fitter, root, names)
