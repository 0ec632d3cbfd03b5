"""A plane that moved more often than it was recorded, as that of an autopilot with a slow logger.

What it did between two rows is known in part, and the more it moved the less. Taken for known, what it did
not do is made up for by hulls that answer at once. So its mean angle in a row is off by a share of how far it
moved in that, and what the filter does not foresee of it counts as noise (host.likelihood.kalman). The share
is estimated with the base equations under random forces, which run away from nothing.
"""

from dataclasses import replace

from host.catalogue import ORDINARY
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.sea_fits import with_sea
from host.diagnosis.fits.starts import begun_from
from host.dynamics.propagate import astray
from host.likelihood.filter_error import filter_error

SHARES = (0.05, 0.1, 0.2, 0.4)  # of how far it moved; 0.29 is that of a step anywhere in the row
LIKELIER = 0.05  # of BIC a sample: chance does nothing of the kind


def astray_share(fitter: Fitter) -> float:
    """How far the plane's mean angle in a row is off, of how far it moved; 0 where that is no likelier.

    fitter  of recordings whose plane is taken as moving on evenly
    """
    sea = with_sea(fitter, fitter.root)
    inputs = fitter.inputs(sea.names, for_filter=True)
    rows = list(zip(inputs, fitter.thinned, strict=True))
    best, share, fit = sea.fit, 0.0, sea.fit
    for each in SHARES:
        fit = filter_error(fit, [replace(one, astray=astray(told, each)) for one, told in rows])
        if fit.log_likelihood < best.log_likelihood:
            break
        best, share = fit, each
    gain = 2.0 * (best.log_likelihood - sea.fit.log_likelihood)
    return share if gain > LIKELIER * sea.fit.samples else 0.0


def whole_astray(fitter: Fitter) -> Explanation:
    """All that every vehicle has under random forces, from the base equations under these."""
    root = with_sea(fitter, fitter.root)
    names = frozenset({*ORDINARY, FREE_TRIM.name})
    names |= {*fitter.tools_beside(names)}
    begun = begun_from(fitter, root, names).with_noise(root.fit.noise)
    return fitter.explained(names, fitter.carried_on(begun))
