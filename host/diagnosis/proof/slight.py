"""What is left of a vehicle whose physics is all but told: too little for the verdict to hang on.

A hull as they are built does many small things that no catalogue holds, and a long recording with sensors
that are quiet shows some of them beyond chance. Where a thousandth of what the base lacked is left, and no
more than the sensors' own noise, that is worth a sentence.
"""

from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.proof.scoring import Misfit
from host.diagnosis.proof.verdict import rare_in
from host.diagnosis.search.whole_vehicle import is_real

LEFT = 1e-3  # of the held-out squared error beyond the noise, both channels
NOISE = 2.0  # times the sensors' variance, each channel
FEW_RARE = 1  # effects that not every vehicle has: several may stand for something else


def is_slight(best: Explanation, before: Misfit, after: Misfit) -> bool:
    """Whether all but a trace is explained, by what every vehicle has and an effect or offsets beside it.

    before, after  what the base, and `best` less all unknown physics, leave of what was held out
    """
    if not is_real(best.names) or len(rare_in(best)) > FEW_RARE:
        return False
    is_near = max(after.chi2_depth, after.chi2_pitch) < NOISE
    return is_near and after.chi2 - 1.0 < LEFT * (before.chi2 - 1.0)
