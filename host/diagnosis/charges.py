"""What an explanation is charged, so that sets of different sizes compare."""

from math import log

from host.catalogue import named
from host.diagnosis.explanation import Names
from host.fit import Fit
from host.recording import Recording
from host.valleys import log_prior

RARITY = 1.0  # of BIC, against what not every vehicle has: decides between exact twins
LONELY = 8.0  # of BIC, against what seldom acts without another effect that is not there: odds of 50 to 1


def charged_bic(fit: Fit, names: Names, coefficients: int, longest: Recording) -> float:
    """Bayesian information criterion of a fit with so many free coefficients of effects; lower is better.

    Charged as well: a speed that is hardly likely, what not every vehicle has, or not by itself, and the
    choice among all the periods that an oscillation could have had.

    longest  of the recordings, which tells most periods apart
    """
    rare = sum(not named(name).is_common for name in names)
    unlikely = -2.0 * log_prior(fit)
    chosen = sum(2.0 * log(_periods_within(named(name).periods, longest)) for name in names)
    lonely = sum(not {named(name).beside} <= names | {None} for name in names)
    return fit.bic + coefficients * log(fit.samples) + RARITY * rare + LONELY * lonely + unlikely + chosen


def _periods_within(limits: tuple[float, float] | None, longest: Recording) -> float:
    """How many oscillations within these limits, s, a recording tells apart; at least 1."""
    if limits is None:
        return 1.0
    shortest = max(limits[0], 2.0 * longest.step)
    return max(1.0, longest.duration * (1.0 / shortest - 1.0 / limits[1]))
