"""Fits of sets among random forces: white ones, or such as swing with a wave's period."""

from dataclasses import replace

import numpy as np

from host.diagnosis.explanation import Explanation
from host.diagnosis.fitter import Fitter
from host.filter_error import filter_error
from host.fit import Fit
from host.gauss_newton import Point
from host.output_error import output_error
from host.waves import in_waves, in_waves_from

FEW_STEPS = 4


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
    start = Point(fit.structure, fit.parameters, fit.initial, fit.noise)
    inputs = fitter.inputs(explanation.names, for_filter=True)
    return fitter.explained(explanation.names, output_error(start, inputs, fit.free))


def roughly_with_waves(fitter: Fitter, explanation: Explanation) -> Explanation:
    """A set among white forces, among waves in their place: a few steps, to see whether that is likelier."""
    inputs = fitter.inputs(explanation.names, for_filter=True)
    return fitter.explained(explanation.names, in_waves(explanation.fit, inputs, FEW_STEPS))


def with_waves(fitter: Fitter, explanation: Explanation, waves: Fit | None = None) -> Explanation:
    """The same set among waves: the likeliest ones, or those of another fit, held.

    Whatever grows from it is fitted in these waves.
    """
    free, fit = fitter.free(explanation.names), explanation.fit
    inputs = fitter.inputs(explanation.names, for_filter=True)
    if waves is None and not fit.waves.any():
        return fitter.explained(explanation.names, in_waves(fit, inputs))
    start = Point(fit.structure, fit.parameters, fit.initial, (fit if waves is None else waves).levels)
    climbed = in_waves_from(start, inputs, free, holds_noise=waves is not None)
    return fitter.explained(explanation.names, climbed)


def with_regular_waves(fitter: Fitter, explanation: Explanation) -> Explanation:
    """A set found among waves with the regular wave nearest to them, and white forces."""
    fit = explanation.fit
    calm = replace(fit, noise=np.array([*fit.noise[:2], 0.0, 0.0]), waves=np.zeros(5))
    plain = with_sea(fitter, fitter.explained(explanation.names, calm))
    if "surface_waves" in plain.names:
        return plain
    return fitter.grown(plain, "surface_waves", [np.array([0.0, 0.0, 2.0 * np.pi / fit.waves[0]])])
