"""How much evidence counts, by the Bayesian information criterion, and which sets are small or large."""

from host.diagnosis.fits.explanation import Explanation
from host.noise.whiteness import correlation_factor

NAMING_MARGIN = 6.0  # beyond which an effect pays; holds false naming down over the whole catalogue
TWIN_MARGIN = 8.0  # odds of 50 to 1: explanations closer than this cannot be told apart
ROUGH = 60.0  # that a fit of the search may gain by polishing
LITTLE = 1.15  # times the noise floor: little is left, and gains are well predicted
MUCH = 2.0  # times the noise floor: more acts than a few effects
SMALL = 3  # members; the fits of larger sets cost most, and an exchange of one says least
LARGEST_SET = 4
FEW = 3  # of the most promising effects, tried beside all but the smallest sets


def margin(explanation: Explanation) -> float:
    """What a member must gain beside this set: correlated residuals repeat each other's evidence."""
    return NAMING_MARGIN * correlation_factor(explanation.fit.whitened)
