"""What is likelier than not by the stretches that were fitted, and misleads on those held out.

Where something is left that nothing explains, an effect may follow a part of it: a turn passes for a plane
that turns the vehicle less from then on. Of what every vehicle has this says little, as a free run is carried
off by whatever is left; what few vehicles have is not looked for on one that is foretold better without it.
"""

from collections.abc import Mapping

from host.catalogue import ALONG_THE_HULL, FAINT, ORDINARY
from host.diagnosis.fits.explanation import Names
from host.diagnosis.proof.scoring import FORETOLD

USUAL = frozenset({*ORDINARY, *FAINT, ALONG_THE_HULL})


def unproven_in(gains: Mapping[str, float]) -> Names:
    """The effects without which the squared error of what was held out falls clearly, by more than a tenth.

    gains  share of that error that returns without each: less than zero where some of it goes
    """
    ratios = {name: 1.0 - gain for name, gain in gains.items() if name not in USUAL}  # with it to without
    return frozenset(name for name, ratio in ratios.items() if FORETOLD * ratio > 1.0)
