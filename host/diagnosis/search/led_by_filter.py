"""Vehicles that a filter follows and no free run does: hulls that are unstable, or that water moves about.

Most torpedoes are unstable with their planes at rest, a little: what an autopilot holds within a degree a
free run leaves within half a minute, whatever its coefficients, and what fits free runs is no hull. And
turbulence of a few mm/s carries any hull off by decimetres. Under random forces that are let go in stages
(host.diagnosis.search.continuation) the likeliest stage tells the coefficients, and whether more acts.
"""

from math import log
from typing import TYPE_CHECKING

import numpy as np

from host.catalogue import DRIVE, ORDINARY, named
from host.catalogue.moments import SCANS
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.absence import one_step_without
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import MUCH, margin
from host.diagnosis.fits.prospects import form_gains
from host.diagnosis.fits.sea_fits import lead_away, with_sea
from host.diagnosis.fits.starts import scanned
from host.diagnosis.fits.workers import Task, Workers
from host.diagnosis.recordings.spans import led_excerpt
from host.diagnosis.search.continuation import continued
from host.diagnosis.search.outset import IN_TIME, LOST
from host.diagnosis.search.whole_vehicle import is_real
from host.likelihood.gauss_newton import Point
from host.likelihood.valleys import has_damped_pitch, has_usual_heave, look_alikes

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

MOST_FORCES = 0.2  # of the variance of all force: turbulence of 5 mm/s made an eighth of it on a small hull
MOST_LEFT = 3.0  # times the noise floor: a sensor that is read between its readings looks smoother than it is
NOTHING_ELSE = 0.03  # of BIC a sample, that anything may gain beside the forces: what a free run lost is more
FORCED = 0.25  # of BIC a sample, by which forces lead a free run away, whatever goes with time or depth
MOST_MORE, MOST_LARGE = 4, 2  # effects that join beside the forces, and those of them that gain so much
PROMISING = 2  # that are tried for each
PLACE = "depth_sensor_lever_arm"  # of the depth sensor, which hardly any vehicle has at its centre
SLOW = -0.03  # 1/s, of a1: the heave damping of ten metres of hull at half a metre a second
PASSING = frozenset({*SCANS, *DRIVE, *IN_TIME, "fin_stall"})
"""Of these each may follow a little of what forces do."""


def led_by_a_filter(
    search: "Search", whole: Explanation, free: Explanation | None = None
) -> Explanation | None:
    """All that every vehicle has under the forces beside which it is likeliest, with what gains beside these.

    None where a free run comes near, where the forces are large or leave much, and where more gains beside
    them than may join, or a form of unknown physics does: then more acts than a hull. What they leave is no
    white noise where the logger has read its sensors between their readings.

    whole  all that every vehicle has, as free runs tell it; `free` with what may lead, if anything
    """
    fitter, free = search.fitter, free or whole
    if fitter.excess(free.fit) < MUCH:
        return None
    sea = with_sea(fitter, whole) if fitter.excess(whole.fit) < LOST else _continued(search)
    if sea is None or not lead_away(fitter, free, sea, FORCED):
        return None
    usual = whole.names | {*ORDINARY}
    lean = _among_look_alikes(search, _without_what_joined_too_soon(search, sea, usual))
    grown = _with_what_gains(search, lean)
    if grown is None:
        return None
    sea = _without_what_joined_too_soon(search, grown, usual)
    if (sea.fit.noise[2:4] > MOST_FORCES * np.square(fitter.accelerations)).any():
        return None
    if not _are_needed(search, sea, [name for name in sea.names - whole.names if name in DRIVE]):
        return None
    is_damped = has_usual_heave(sea.fit.end, SLOW) and has_damped_pitch(sea.fit.end)
    is_hull = is_damped and _shows_a_hull(fitter, sea)
    return sea if is_hull and fitter.excess(sea.fit) < MOST_LEFT and _needs_forces(fitter, sea) else None


def _continued(search: "Search") -> Explanation | None:
    """All that is ordinary, from the likeliest stage of a continuation through an excerpt."""
    fitter = search.fitter
    part = Fitter(led_excerpt(fitter.recordings))
    names = frozenset({*ORDINARY, FREE_TRIM.name})
    names |= {*part.tools_beside(names)}
    with Workers(part, search.workers.jobs) as workers:
        led = search.elsewhere(part, workers)
        continued(led, names, most_beside=0)
    if (found := led.steered) is None:
        return None
    start = fitter.carried_over(found).with_noise(found.fit.noise)
    return _followed(fitter, found.names, scanned(fitter, start))


def _among_look_alikes(search: "Search", sea: Explanation) -> Explanation:
    """The same in the likeliest valley of the points that move much as it does, under its forces."""
    points = (at.with_noise(sea.fit.noise) for at in look_alikes(sea.fit.end))
    tasks: list[Task] = [(_followed, (sea.names, at)) for at in points]
    found: list[Explanation] = search.workers.results(tasks)
    return min([sea, *found], key=lambda e: e.bic)


def _followed(fitter: Fitter, names: Names, start: Point) -> Explanation:
    return fitter.explained(names, fitter.carried_on(start))


def _without_what_joined_too_soon(search: "Search", sea: Explanation, usual: Names) -> Explanation:
    """The same less what is not usual and does not pay: it joined before what it did the work of."""
    while more := sorted(sea.names - usual):
        best = min(_each_without(search, sea, more), key=lambda e: e.bic)
        if best.bic > sea.bic:
            break
        sea = best
    return sea


def _each_without(search: "Search", sea: Explanation, members: list[str]) -> list[Explanation]:
    """The set less each of these, fitted to the end, forces and all: held, these lead elsewhere."""
    tasks: list[Task] = [(Fitter.reduced, (sea, sea.names - {name})) for name in members]
    found: list[Explanation] = search.workers.results(tasks)
    return found


def _with_the_place(search: "Search", sea: Explanation) -> Explanation:
    """The same with a depth sensor off the centre, if that pays: a hull bent without it foretells nothing."""
    if PLACE in sea.names:
        return sea
    names = sea.names | {PLACE}
    points = [search.fitter.point(names, sea, PLACE, np.array(probe)) for probe in named(PLACE).probes]
    found: list[Explanation] = search.workers.results([(_followed, (names, at)) for at in points])
    best = min(found, key=lambda e: e.bic)
    return best if best.bic < sea.bic - margin(sea) - log(sea.fit.samples) else sea


def _with_what_gains(search: "Search", sea: Explanation) -> Explanation | None:
    """The same with what gains beside the forces; None where much does, or a form gains most.

    What passes, or keeps a plane back, must gain as much as no free run lost, unless another keeps it back;
    what a vehicle has throughout as much as anywhere. Where its depth sensor sits is asked once nothing else
    gains: a hull bent by what does is moved by a sensor that is not there.
    """
    least = margin(sea) + log(sea.fit.samples)
    much = max(least, NOTHING_ELSE * sea.fit.samples)
    large, is_placed = 0, False
    for _ in range(MOST_MORE):
        gains = search.gains(sea)
        if max(form_gains(search.fitter, sea).values()) > max(much, *gains.values()):
            return None
        large += max(gains.values()) > much
        if large > MOST_LARGE:
            return None
        dear = PASSING - {*DRIVE} if sea.names & {*DRIVE} else PASSING
        likely = [name for name in gains if gains[name] > (much if name in dear else least)]
        likely = sorted(likely, key=lambda name: -gains[name])[:PROMISING]
        grown = search.workers.results([search.growth(sea, name) for name in likely])
        best: Explanation = min(grown, key=lambda e: e.bic, default=sea)
        if best.bic > sea.bic - least:  # what a step foretold was not there
            best = sea if is_placed else _with_the_place(search, sea)
            is_placed = True
        if best is sea:
            break
        sea = _among_look_alikes(search, best)
    return sea


def _are_needed(search: "Search", sea: Explanation, drive: list[str]) -> bool:
    """Whether of what keeps the plane back one is worth as much as no free run lost.

    Under forces, each does a part of another's work: a second beside it may do less.
    """
    if sea.leaves_white:
        return True
    much = NOTHING_ELSE * sea.fit.samples
    lost = [fewer.bic - sea.bic for fewer in _each_without(search, sea, drive)]
    return not lost or max(lost) > much


def _shows_a_hull(fitter: Fitter, sea: Explanation) -> bool:
    """Whether some of what every vehicle has would be missed: else what pushes it may be few effects."""
    least, charge = margin(sea), log(sea.fit.samples)
    ahead = {name: one_step_without(sea.fit, named(name)) for name in sorted(sea.names & {*ORDINARY})}
    shown = [
        name
        for name, lost in ahead.items()
        if lost and lost[0] > least + charge * fitter.free_parameters(frozenset({name}))
    ]
    return is_real(frozenset(shown))


def _needs_forces(fitter: Fitter, sea: Explanation) -> bool:
    """Whether the set is led away without its forces, also from where these have led it."""
    point = sea.fit.end.with_noise(np.array([*fitter.floor, 0.0, 0.0]))
    return lead_away(fitter, _followed(fitter, sea.names, point), sea, FORCED)
