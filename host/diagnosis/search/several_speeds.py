"""A thrust that is set anew under way, where no speed tells: a mission flown at two speeds, or at three.

Damping goes with the speed, the plane's force with its square: the coefficients of one speed are none of
another. From a hull that is bent to both nothing else shows, and of one change little where another follows.
"""

from host.catalogue.changes import SPEED_CHANGES
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter

HALF = 0.5  # of what is left, by each change: nothing else does that to all that a hull does


def at_several_speeds(fitter: Fitter, whole: Explanation) -> Explanation:
    """A set with one change of the speed, or two, where each halves what is left; itself if speed is told.

    Of two changes the first alone may do little.
    """
    if fitter.recordings[0].has_speed:
        return whole
    found, joined, most = whole, whole, fitter.excess(whole.fit)
    for change in SPEED_CHANGES:
        joined, most = fitter.polished(fitter.grown(joined, change, [])), HALF * most
        if fitter.excess(joined.fit) < most:
            found = joined
    return found
