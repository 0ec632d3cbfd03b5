"""Fits of a set under random forces or waves, by a Kalman filter."""

from typing import TYPE_CHECKING

import numpy as np

from host.likelihood.ascent import SETTLED
from host.likelihood.filter_error import filter_error_from, likelihood_under_forces
from host.likelihood.fit import Fit
from host.likelihood.gauss_newton import Point
from host.likelihood.waves import in_waves_from, likelihood_in_waves

if TYPE_CHECKING:
    from host.diagnosis.fits.fitter import Fitter


def climbed(
    fitter: "Fitter", start: Point, holds_noise: bool, least: float = -np.inf, settled: float = SETTLED
) -> Fit:
    """The likeliest parameters of the start's set, from there.

    While sets are compared, forces stay as they were first found (`holds_noise`), and waves to the end. Their
    levels take most of the time, and a set that is better than another is so at any of them.

    least    a log-likelihood: given up where it would not get there
    settled  of the log-likelihood: a step that gains less is the last
    """
    names = start.structure.effect_names
    inputs, free = fitter.inputs(names, for_filter=True), fitter.free(names)
    if start.noise.size > 4:
        return in_waves_from(start, inputs, free, holds_noise=True, least=least, settled=settled)
    gain_held = not fitter.are_slight(start.noise)
    return filter_error_from(
        start, inputs, free, holds_noise=holds_noise, holds_gain=gain_held, least=least, settled=settled
    )


def likelihood(fitter: "Fitter", point: Point) -> float:
    """The log-likelihood of the filter at a point; -inf where it leaves the numbers."""
    names = point.structure.effect_names
    under = likelihood_in_waves if point.noise.size > 4 else likelihood_under_forces
    return under(point, fitter.inputs(names, for_filter=True))
