"""Vehicles that a filter follows and no free run does: hulls that are unstable with their planes at rest.

Most torpedoes are, a little: what an autopilot holds within a degree a free run leaves within half a minute,
whatever its coefficients, and what fits free runs is no hull. Under random forces that are let go in stages
(host.diagnosis.search.continuation) the likeliest stage tells the coefficients, and whether more acts.
"""

from typing import TYPE_CHECKING

import numpy as np

from host.catalogue import ORDINARY
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import LITTLE, margin
from host.diagnosis.fits.prospects import form_gains
from host.diagnosis.fits.workers import Workers
from host.diagnosis.recordings.spans import led_excerpt
from host.diagnosis.search.continuation import continued
from host.diagnosis.search.outset import LOST, MOST_FORCES

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

NOTHING_ELSE = 0.03  # of BIC a sample, that anything may gain beside the forces: what a free run lost is more


def led_by_a_filter(search: "Search", whole: Explanation) -> Explanation | None:
    """All that every vehicle has under the forces beside which it is likeliest, where nothing else gains.

    None where a free run comes near, where the forces are large or leave something, and where an effect or
    a form of unknown physics gains beside them: then more acts than a hull.

    whole  all that every vehicle has, as free runs tell it
    """
    fitter = search.fitter
    if fitter.excess(whole.fit) < LOST:
        return None
    part = Fitter(led_excerpt(fitter.recordings))
    names = frozenset({*ORDINARY, FREE_TRIM.name})
    names |= {*part.tools_beside(names)}
    with Workers(part, search.workers.jobs) as workers:
        led = search.elsewhere(part, workers)
        end = continued(led, names, most_beside=0)
    found = led.steered
    if found is None or (end is not None and part.excess(end.fit) < LOST):
        return None
    start = fitter.carried_over(found).with_noise(found.fit.noise)
    sea = fitter.explained(found.names, fitter.carried_on(start))
    are_many = (sea.fit.noise[2:4] > MOST_FORCES * np.square(fitter.accelerations)).any()
    if are_many or not sea.leaves_white or fitter.excess(sea.fit) > LITTLE:
        return None
    least = max(margin(sea), NOTHING_ELSE * sea.fit.samples)
    gains = (*search.gains(sea).values(), *form_gains(fitter, sea).values())
    return sea if max(gains) < least else None
