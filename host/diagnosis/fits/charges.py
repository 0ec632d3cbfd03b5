"""What an explanation is charged, so that sets of different sizes compare."""

from math import log

import numpy as np

from host.catalogue import CHANGES, UNKNOWN, named
from host.diagnosis.fits.explanation import Names
from host.likelihood.fit import Fit
from host.likelihood.valleys import log_prior
from host.recordings.recording import Recording

RARITY = 1.0  # of BIC, against what not every vehicle has: decides between exact twins
FOREIGN = 8.0  # of BIC, against each form of unknown physics: odds of 50 to 1 for an entry as likely
LONELY = 8.0  # of BIC, against what seldom acts without another effect that is not there: odds of 50 to 1
UNNOTED = 6.0  # of BIC, against each change that nobody noted, but of the two that most often come
AT_AN_END, HARDLY_CHANGES = 2.0, 8.0  # s; of BIC: what changed there all but acts always, or never
LEAST_COUPLING, MOST_COUPLING, COUPLING_SPREAD = 0.0, 0.8, 0.2  # of the forward speed


def charged_bic(fit: Fit, names: Names, coefficients: int, longest: Recording) -> float:
    """Bayesian information criterion of a fit with so many free coefficients of effects; lower is better.

    Charged as well: a speed, a damping or a coupling that is hardly likely, what not every vehicle has, or
    not by itself, or what the catalogue does not hold, a change as the recording begins or ends, or of what
    seldom changes and nobody noted, and the choice among all the periods that an oscillation could have had.
    Not charged: what beside an effect's other coefficients makes no difference on this recording.

    longest  of the recordings, which tells most periods apart
    """
    rare = sum(not named(name).is_common for name in names)
    unlikely = -2.0 * log_prior(fit) + _strange_coupling(fit) + FOREIGN * len(names & UNKNOWN.keys())
    chosen = sum(2.0 * log(_periods_within(named(name).periods, longest)) for name in names)
    lonely = sum(not {named(name).beside} <= names | {None} for name in names)
    unnoted = 0 if longest.alarms else len(names & {change.name for change in CHANGES})
    seldom = RARITY * rare + LONELY * lonely + UNNOTED * unnoted
    seldom += HARDLY_CHANGES * _changes_at_an_end(fit, longest)
    told = coefficients - _untold(fit, names)
    return fit.bic + told * log(fit.samples) + seldom + unlikely + chosen


def _changes_at_an_end(fit: Fit, longest: Recording) -> int:
    """How many moments lie so near to where the recording begins or ends that hardly anything is changed."""
    own = zip(fit.structure.names, fit.parameters, fit.free, strict=True)
    moments = [time for name, time, is_free in own if is_free and name in fit.structure.moments]
    first, last = longest.time[0] + AT_AN_END, longest.time[-1] - AT_AN_END
    return sum(not first < time < last for time in moments)


def _untold(fit: Fit, names: Names) -> int:
    """How many coefficients lack information, as the lift that a plane keeps in a stall it did not reach."""
    is_told = dict(zip(fit.structure.names, np.diag(fit.information) > 0.0, strict=True))
    free = {name for name, is_free in zip(fit.structure.names, fit.free, strict=True) if is_free}
    own = [[is_told[p.name] for p in named(name).parameters if p.name in free] for name in names]
    return sum(told.count(False) for told in own if any(told))


def _strange_coupling(fit: Fit) -> float:
    """Squared deviation of the coupling of pitch rate into heave from what masses allow; 0 within that.

    c_wq / u0 = (m - Xu' + Zq) / (m - Zw'), where Xu' > Zw', as a hull carries more water along sideways than
    ahead, and Zq < 0 of a tail (Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, ch. 8).
    """
    values = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    if "c_wq" not in values:
        return 0.0
    share = values["c_wq"] / max(values["u0"], 1e-3)
    return float((share - np.clip(share, LEAST_COUPLING, MOST_COUPLING)) / COUPLING_SPREAD) ** 2


def _periods_within(limits: tuple[float, float] | None, longest: Recording) -> float:
    """How many oscillations within these limits, s, a recording tells apart; at least 1."""
    if limits is None:
        return 1.0
    shortest = max(limits[0], 2.0 * longest.step)
    return max(1.0, longest.duration * (1.0 / shortest - 1.0 / limits[1]))
