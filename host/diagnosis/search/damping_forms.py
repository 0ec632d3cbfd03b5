"""Damping that does not fall with the speed, in its other form.

That of a hull which meets the water sideways grows with how fast it does (drag in heave and pitch, and along
the hull); that of slow flow around it is there at any speed. In movements of one size either does the work of
the other, and one of them three effects in the place of one, which no exchange of single members finds.
"""

from typing import TYPE_CHECKING

from host.catalogue import ALONG_THE_HULL
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.margins import ROUGH
from host.diagnosis.fits.starts import begun_from
from host.diagnosis.search.pruning import pruned
from host.diagnosis.search.whole_vehicle import ended

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

STEADY = "speed_independent_damping"
DRAGS = ("heave_quadratic_drag", "pitch_quadratic_damping", ALONG_THE_HULL)


def with_drags_instead(search: "Search", best: Explanation) -> Explanation:
    """The set with all drags in the place of steady damping, or what of them pays, where that is likelier."""
    if STEADY not in best.names or best.fit.has_process_noise or best.names.issuperset(DRAGS):
        return best
    search.on_progress("drags in place of steady damping")
    names = best.names - {STEADY} | {*DRAGS}
    found = search.remember(ended(search.fitter, begun_from(search.fitter, best, names), names))
    if found.bic > best.bic + ROUGH:
        return best  # leaving out some of them does not save so much
    return min(best, pruned(search, found), key=lambda e: e.bic)
