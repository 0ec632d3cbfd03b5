"""What the best explanation leaves: nothing, or something systematic that no entry of the catalogue is."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import periodogram
from scipy.stats import chi2

from host.catalogue.nuisance import ANY_SMOOTH_FORCE
from host.diagnosis.fitter import Explanation, Fitter
from host.diagnosis.noise_floor import is_quantised
from host.recording import Array
from host.whiteness import is_white

SIGNIFICANCE = 1e-4
FLOOR_DOUBT = 1.3  # times the noise floor, which is itself estimated
SLOW_SPREAD = 2.3  # of the cumulative periodogram (Kolmogorov's distribution at 5e-5)


@dataclass(frozen=True, slots=True, kw_only=True)
class Leftover:
    """Signs that something is left.

    is_coloured     the innovations are not white, fast or slow
    is_above_floor  the sensor noise of the fit exceeds what the sensors themselves show
    smooth_gain     twice the log-likelihood that any smooth force of the motion would gain
    is_smooth       whether that is more than chance gives
    """

    is_coloured: bool
    is_above_floor: bool
    smooth_gain: float
    is_smooth: bool

    @property
    def is_nothing(self) -> bool:
        return not (self.is_coloured or self.is_above_floor or self.is_smooth)


def leftover(fitter: Fitter, best: Explanation) -> Leftover:
    """Tests the innovations of an explanation, but for quantised channels: rounding is no white noise."""
    tested = ~is_quantised(fitter.recordings)
    innovations = [e[tested] for e in best.fit.whitened]
    gain = fitter.gain(best, ANY_SMOOTH_FORCE.name, [])
    terms = len(ANY_SMOOTH_FORCE.parameters)
    return Leftover(
        is_coloured=not all(is_white(e, significance=SIGNIFICANCE) and _is_even(e) for e in innovations),
        is_above_floor=fitter.excess(best.fit) > FLOOR_DOUBT,
        smooth_gain=gain,
        is_smooth=bool(gain > chi2.isf(SIGNIFICANCE, terms)),
    )


def _is_even(innovations: Array) -> bool:
    """Bartlett's test: the power of white noise grows evenly over the frequencies."""
    for values in innovations:
        known = np.isfinite(values)
        if known.sum() < 100:
            continue
        _, power = periodogram(np.where(known, values - values[known].mean(), 0.0))
        cumulated = np.cumsum(power[1:]) / power[1:].sum()
        even = np.arange(1, cumulated.size + 1) / cumulated.size
        if np.max(np.abs(cumulated - even)) * np.sqrt(cumulated.size) > SLOW_SPREAD:
            return False
    return True
