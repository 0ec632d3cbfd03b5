"""Fits of sets among random forces: white ones, or such as swing with a wave's period."""

from dataclasses import replace

import numpy as np

from host.catalogue import named
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.likelihood.filter_error import filter_error
from host.likelihood.fit import Fit
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error
from host.likelihood.waves import MOST_STEPS, in_waves, in_waves_from
from host.recordings.recording import Array

WAVES = "surface_waves"
FEW_STEPS = 4
BAND, LINES = 2.0, 21  # half-widths of the waves' band, and regular waves tried in it


def with_sea(fitter: Fitter, explanation: Explanation) -> Explanation:
    """The same set when random forces act as well; whatever grows from it is fitted with them, too."""
    fit = filter_error(explanation.fit, fitter.inputs(explanation.names, for_filter=True))
    return fitter.explained(explanation.names, fit)


def as_filtered(fitter: Fitter, explanation: Explanation) -> Explanation:
    """The same set with the errors of rounded readings taken for normal, as a filter does.

    Only then its likelihood compares with that of a set among random forces.
    """
    fit = explanation.fit
    if fit.has_process_noise or not fitter.steps.any():
        return explanation
    inputs = fitter.inputs(explanation.names, for_filter=True)
    return fitter.explained(explanation.names, output_error(fit.end, inputs, fit.free))


def lead_away(fitter: Fitter, free: Explanation, sea: Explanation, by: float) -> bool:
    """Whether random forces explain so much of BIC a sample more than a set does without."""
    return bool(as_filtered(fitter, free).bic > sea.bic + by * sea.fit.samples)


def roughly_with_waves(fitter: Fitter, explanation: Explanation) -> Explanation:
    """A set among white forces, among waves in their place: a few steps, to see whether that is likelier."""
    return with_waves(fitter, explanation, most_steps=FEW_STEPS)


def with_waves(
    fitter: Fitter, explanation: Explanation, waves: Fit | None = None, most_steps: int = MOST_STEPS
) -> Explanation:
    """The same set among waves: the likeliest ones, or those of another fit, held.

    Whatever grows from it is fitted in these waves.
    """
    free, fit = fitter.free(explanation.names), explanation.fit
    inputs = fitter.inputs(explanation.names, for_filter=True)
    if waves is None and not fit.waves.any():
        return fitter.explained(explanation.names, in_waves(fit, inputs, most_steps))
    start = Point(fit.structure, fit.parameters, fit.initial, (fit if waves is None else waves).levels)
    climbed = in_waves_from(start, inputs, free, holds_noise=waves is not None)
    return fitter.explained(explanation.names, climbed)


def again_in_waves(fitter: Fitter, explanation: Explanation) -> Explanation:
    """A set that was fitted among waves to other stretches, fitted to these in the same waves."""
    start = fitter.begun(explanation).with_noise(explanation.fit.levels)
    return fitter.explained(explanation.names, fitter.carried_on(start))


def again_under_forces(fitter: Fitter, explanation: Explanation) -> Explanation:
    """A set that was fitted under random forces to other stretches, fitted to these under such forces.

    No free run is asked first: it may soon have nothing to do with the recording, and lead elsewhere.
    """
    start = fitter.carried_over(explanation).with_noise(explanation.fit.noise)
    return fitter.explained(explanation.names, fitter.carried_on(start))


def with_regular_waves(fitter: Fitter, explanation: Explanation) -> Explanation:
    """A set found among waves with the regular wave nearest to them, and white forces, to be simulated.

    A free run tells its size, phase and period, all else held: fitted with the rest, one regular wave would
    bend the vehicle to what the other waves do.
    """
    frequency, damping = explanation.fit.waves[:2]
    names = explanation.names | {WAVES}
    inputs = fitter.inputs(names)
    periods = 2.0 * np.pi / (frequency * np.linspace(1.0 - BAND * damping, 1.0 + BAND * damping, LINES))
    probes = [np.array([0.0, 0.0, period]) for period in periods]
    starts = [fitter.point(names, explanation, WAVES, probe) for probe in probes]
    own = np.isin(starts[0].structure.names, [each.name for each in named(WAVES).parameters])
    fits = [output_error(start, inputs, own, FEW_STEPS) for start in starts]
    best = max(fits, key=lambda fit: fit.log_likelihood)
    point = Point(best.structure, best.parameters, best.initial, best.noise)
    regular = output_error(point, inputs, own)
    return fitter.explained(names, replace(regular, noise=levels(fitter, names, regular)))


def levels(fitter: Fitter, names: Names, fit: Fit) -> Array:
    """The noise of a predictor with these parameters under white forces."""
    held = replace(fit, free=np.zeros_like(fit.free))
    return filter_error(held, fitter.inputs(names, for_filter=True)).noise
