"""Fits of sets among random forces: white ones, or such as swing with a wave's period."""

import numpy as np

from host.diagnosis.explanation import Explanation
from host.diagnosis.fitter import Fitter
from host.filter_error import filter_error
from host.fit import Fit
from host.gauss_newton import Point
from host.output_error import output_error
from host.wave_forces import wave_forces, wave_forces_from


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


def with_waves(fitter: Fitter, explanation: Explanation, waves: Fit | None = None) -> Explanation:
    """The same set among waves: the likeliest ones, or those of another fit, held.

    Whatever grows from it is fitted in these waves.
    """
    free, fit = fitter.free(explanation.names), explanation.fit
    inputs = fitter.inputs(explanation.names, for_filter=True)
    if waves is None and not fit.waves.any():
        return fitter.explained(explanation.names, wave_forces(fit, inputs))
    start = Point(fit.structure, fit.parameters, fit.initial, (fit if waves is None else waves).levels)
    climbed = wave_forces_from(start, inputs, free, holds_noise=waves is not None)
    return fitter.explained(explanation.names, climbed)


def with_regular_waves(fitter: Fitter, explanation: Explanation, white: Fit) -> Explanation:
    """A set found among waves with the regular wave nearest to them, and the white forces of a fit."""
    fit = explanation.fit
    start = Point(fit.structure, fit.parameters, fit.initial, white.levels)
    plain = fitter.explained(explanation.names, fitter.carried_on(start))
    if "surface_waves" in plain.names:
        return plain
    return fitter.grown(plain, "surface_waves", [np.array([0.0, 0.0, 2.0 * np.pi / fit.waves[0]])])
