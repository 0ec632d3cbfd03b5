"""Other valleys of the likelihood: heave damping and speed trade places, or a lag and a pole of pitch.

Depth follows from the plane by

    zeta/delta = [b1 (s^2 - a2 s - a3) - u0 b2 (s - a1)] / [s (s - a1) (s^2 - a2 s - a3)]

A pole a1 that nearly cancels a zero can sit at another zero nearly as well, with another u0 and b1: where the
speed is not measured, one recording may have two maxima with different heave. A search ends in that in which
it began; so the profile of the likelihood over a1 is walked on both sides, and every dip is entered. A lag in
series with the pitch is one pole more: which of the poles is the lag's, pitch alone does not say.
"""

from dataclasses import replace
from math import log

import numpy as np

from host.equations import NAMES
from host.fit import Fit, Rival
from host.gauss_newton import Point
from host.output_error import output_error
from host.propagate import Inputs
from host.whiteness import correlation_factor

STRIDES = (0.12, 0.3, 0.55, 1.8, 3.3, 8.0)  # times a1
FEW_ITERATIONS, ROUGHLY = 6, 0.3
WORTH_ENTERING = 40.0  # of a log-likelihood below the best, that a point of the profile may lie
ALMOST_AS_LIKELY = 3.0  # of a log-likelihood: odds of 20 to 1 and less rule nothing out
APART = 4.0  # standard deviations between two modes
USUAL_SPEED, SPEED_FACTOR = 1.5, 3.0  # m/s; gliders make 0.3, torpedoes 10
A1, A2, A3, B1, B2, U0 = (NAMES.index(name) for name in ("a1", "a2", "a3", "b1", "b2", "u0"))
LAGS = ("lag_time", "pitch_lag_time")


def other_valleys(fit: Fit, inputs: list[Inputs]) -> list[Fit]:
    """Ends of output-error searches that began with lag and pole swapped, or with another heave damping.

    Among them may be a likelier one, and the one that the search began with again. Where the speed is held,
    heave damping has one valley.
    """
    here = Point(fit.structure, fit.parameters, fit.initial, fit.noise)
    ends = [output_error(start, inputs, fit.free) for start in with_poles_swapped(here)]
    if not (fit.free[A1] and fit.free[U0]):
        return ends
    held = fit.free.copy()
    held[A1] = False
    for stride in STRIDES:
        parameters = fit.parameters.copy()
        parameters[[A1, B1]] *= stride  # the steady heave velocity stays
        start = Point(fit.structure, fit.structure.clipped(parameters), fit.initial, fit.noise)
        walked = output_error(start, inputs, held, FEW_ITERATIONS, ROUGHLY)
        if walked.log_likelihood > fit.log_likelihood - WORTH_ENTERING:
            start = Point(fit.structure, walked.parameters, walked.initial, walked.noise)
            ends.append(output_error(start, inputs, fit.free))
    return ends


def with_poles_swapped(point: Point) -> list[Point]:
    """The point with a lag in series and a real pole of pitch in each other's place, the gain as it was.

    Their product is the same to the sensor of pitch; only depth, or the plane's own motion, tells them apart.
    """
    names, values = list(point.structure.names), point.parameters
    a2, a3, b2 = values[[A2, A3, B2]]
    poles = np.roots([1.0, -a2, -a3])
    swapped = []
    for lag in (names.index(name) for name in LAGS if name in names):
        if np.iscomplex(poles).any() or poles.real.max() >= 0.0:
            break
        for pole, other in (poles.real, poles.real[::-1]):
            moved = values.copy()
            moved[lag] = -1.0 / pole
            stays, comes = other, -1.0 / values[lag]
            moved[[A2, A3]] = stays + comes, -stays * comes
            moved[B2] = b2 * moved[A3] / a3
            swapped.append(replace(point, parameters=point.structure.clipped(moved)))
    return swapped


def plausibility(fit: Fit) -> float:
    """By what ends of searches are compared: log-likelihood, and the log of the prior of its speed."""
    return fit.log_likelihood + log_prior(fit)


def log_prior(fit: Fit) -> float:
    """Of a speed that is not held: log-normal about 1.5 m/s with a factor of 3.

    Whatever the data say decides, but that the vehicle hardly moves forward.
    """
    if not fit.free[U0]:
        return 0.0
    factors = log(max(fit.parameters[U0], 1e-3) / USUAL_SPEED) / log(SPEED_FACTOR)
    return -0.5 * factors**2


def with_rivals(fit: Fit, others: list[Fit]) -> Fit:
    """The best of all, with the other ends that the recording cannot rule out.

    Odds are those of as many independent samples as the innovations are worth.
    """
    ends = sorted([fit, *others], key=lambda end: -plausibility(end))
    best, samples_each = ends[0], correlation_factor(ends[0].whitened)
    known, rivals = [best], []
    for other in ends[1:]:
        log_odds = (plausibility(other) - plausibility(best)) / samples_each
        if log_odds > -ALMOST_AS_LIKELY and all(are_apart(other, one) for one in known):
            known.append(other)
            rivals.append(Rival(other.parameters, log_odds))
    return replace(best, rivals=tuple(rivals))


def are_apart(one: Fit, other: Fit) -> bool:
    """Whether two ends are two modes: further apart than the deviations of either."""
    apart = one.parameters - other.parameters
    return min(float(apart @ fit.information @ apart) for fit in (one, other)) > APART**2
