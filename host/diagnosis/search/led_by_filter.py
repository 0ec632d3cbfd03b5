"""Vehicles that a filter follows and no free run does: hulls that are unstable, or that water moves about.

Most torpedoes are unstable with their planes at rest, a little: what an autopilot holds within a degree a
free run leaves within half a minute, whatever its coefficients, and what fits free runs is no hull. And
turbulence of a few mm/s carries any hull off by decimetres. Under random forces that are let go in stages
(host.diagnosis.search.continuation) the likeliest stage tells the coefficients, and whether more acts.
"""

from math import log
from typing import TYPE_CHECKING

import numpy as np

from host.catalogue import ORDINARY, named
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import MUCH, margin
from host.diagnosis.fits.prospects import form_gains
from host.diagnosis.fits.sea_fits import lead_away, with_sea
from host.diagnosis.fits.workers import Task, Workers
from host.diagnosis.recordings.spans import led_excerpt
from host.diagnosis.search.continuation import continued
from host.diagnosis.search.outset import LOST, MOST_FORCES
from host.likelihood.gauss_newton import Point
from host.likelihood.valleys import has_damped_pitch, has_usual_heave, look_alikes

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

MOST_LEFT = 3.0  # times the noise floor: a sensor that is read between its readings looks smoother than it is
NOTHING_ELSE = 0.03  # of BIC a sample, that anything may gain beside the forces: what a free run lost is more
FORCED = 0.25  # of BIC a sample, by which forces lead a free run away, whatever goes with time or depth
MOST_MORE, PROMISING = 2, 2  # effects that join beside the forces, and those that are tried for each


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
    sea = _with_what_gains(search, _among_look_alikes(search, sea))
    if sea is None or (sea.fit.noise[2:4] > MOST_FORCES * np.square(fitter.accelerations)).any():
        return None
    # What keeps a plane back is told by white noise alone: of several each does a part of another's work.
    of_plane = [name for name in sea.names - whole.names if named(name).slot == "actuator"]
    if of_plane and not sea.leaves_white:
        return None
    is_hull = has_usual_heave(sea.fit.end) and has_damped_pitch(sea.fit.end)
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
    return _followed(fitter, found.names, start)


def _among_look_alikes(search: "Search", sea: Explanation) -> Explanation:
    """The same in the likeliest valley of the points that move much as it does, under its forces."""
    points = (at.with_noise(sea.fit.noise) for at in look_alikes(sea.fit.end))
    tasks: list[Task] = [(_followed, (sea.names, at)) for at in points]
    found: list[Explanation] = search.workers.results(tasks)
    return min([sea, *found], key=lambda e: e.bic)


def _followed(fitter: Fitter, names: Names, start: Point) -> Explanation:
    return fitter.explained(names, fitter.carried_on(start))


def _with_what_gains(search: "Search", sea: Explanation) -> Explanation | None:
    """The same with what gains beside the forces; None where more does, or a form gains most."""
    least = max(margin(sea) + log(sea.fit.samples), NOTHING_ELSE * sea.fit.samples)
    for _ in range(MOST_MORE + 1):
        gains = search.gains(sea)
        likely = sorted((name for name in gains if gains[name] > least), key=lambda name: -gains[name])
        if max(form_gains(search.fitter, sea).values()) > max(least, *gains.values()):
            return None
        if not likely:
            return sea
        grown = search.workers.results([search.growth(sea, name) for name in likely[:PROMISING]])
        best: Explanation = min(grown, key=lambda e: e.bic)
        if best.bic > sea.bic - least:
            return sea  # what a step foretold was not there
        sea = _among_look_alikes(search, best)
    return None


def _needs_forces(fitter: Fitter, sea: Explanation) -> bool:
    """Whether the set is led away without its forces, also from where these have led it."""
    point = sea.fit.end.with_noise(np.array([*fitter.floor, 0.0, 0.0]))
    return lead_away(fitter, _followed(fitter, sea.names, point), sea, FORCED)
