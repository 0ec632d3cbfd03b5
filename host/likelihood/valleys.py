"""Other valleys of the likelihood: heave damping and speed trade places, or a pole of pitch and another.

Depth follows from the plane by

    zeta/delta = [b1 (s^2 - a2 s - a3) - u0 b2 (s - a1)] / [s (s - a1) (s^2 - a2 s - a3)]

A pole a1 that nearly cancels a zero can sit at another zero nearly as well, with another u0 and b1: where the
speed is not measured, one recording may have two maxima with different heave. A search ends in that in which
it began; so the profile of the likelihood over a1 is walked on both sides, and every dip is entered. A lag in
series with the pitch is one pole more, and so is heave where it turns the hull: which of the poles is whose,
pitch alone does not say. Nor does it say which way the plane pushes a hull that its own heave turns. A lag of
the depth sensor is a pole in series with heave's, and pitch-rate coupling makes up for what else differs.
Where a plane stalls, reversals of one size hardly tell.
"""

from dataclasses import replace
from math import log

import numpy as np

from host.dynamics.equations import NAMES
from host.dynamics.propagate import Inputs
from host.likelihood.fit import Fit, Rival
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error
from host.likelihood.straightened import coefficients_beside
from host.noise.whiteness import correlation_factor

STRIDES = (0.12, 0.3, 0.55, 1.8, 3.3, 8.0)  # times a1
FEW_ITERATIONS, ROUGHLY = 6, 0.3
WORTH_ENTERING = 100.0  # of a log-likelihood below the best, that a point of the profile may lie
ALMOST_AS_LIKELY = 3.0  # of a log-likelihood: odds of 20 to 1 and less rule nothing out
USUAL_LEVER = 0.1  # m: b1/b2 of a plane at the stern of a small vehicle
NEARLY_REAL = 0.3  # of its real part, the imaginary part of a pole that may be two
APART = 4.0  # standard deviations between two modes
USUAL_SPEED, SPEED_FACTOR = 1.5, 3.0  # m/s; gliders make 0.3, torpedoes 10
USUAL_DAMPING, DAMPING_FACTOR = -1.0, 5.0  # 1/s, of a1; gliders 0.1, small quick hulls 6
# 1/s, of a1: a model that lacks an effect may follow its plane at once, or hardly at all.
INSTANT, IDLE = -10.0, -0.1
UNDAMPED = -1e-3  # 1/s, of a1 or a2: at its bound, or next to it
STANDING = 0.1  # m/s: no plane works at less
A1, A2, A3, B1, B2, U0 = (NAMES.index(name) for name in ("a1", "a2", "a3", "b1", "b2", "u0"))
LAGS, DEPTH_LAG, MUNK, COUPLING = ("lag_time", "pitch_lag_time"), "depth_lag_time", "c_qw", "c_wq"
STALL, STALL_LOSS, STALL_FACTORS = "stall_angle", "stall_loss", (0.6, 0.75, 1.35, 1.7)
SHARING_POLES = (*LAGS, DEPTH_LAG, MUNK)  # parameters of effects that bring a pole of their own


def other_valleys(fit: Fit, inputs: list[Inputs]) -> list[Fit]:
    """Ends of output-error searches that began with much the same motion, or with another heave damping.

    Among them may be a likelier one, and the one that the search began with again. Where the speed is held,
    heave damping has one valley.
    """
    here = fit.end
    starts = [(start, fit.free) for start in look_alikes(here)]
    if fit.free[A1] and fit.free[U0]:
        held = fit.free.copy()
        held[A1] = False
        starts += [(_with_damping(here, stride), held) for stride in STRIDES]
    ends = []
    for start, free in starts:
        walked = output_error(start, inputs, free, FEW_ITERATIONS, ROUGHLY)
        if walked.log_likelihood > fit.log_likelihood - WORTH_ENTERING:
            start = Point(fit.structure, walked.parameters, walked.initial, walked.noise)
            ends.append(output_error(start, inputs, fit.free))
    return ends


def _with_damping(point: Point, stride: float) -> Point:
    parameters = point.parameters.copy()
    parameters[[A1, B1]] *= stride  # the steady heave velocity stays
    return replace(point, parameters=point.structure.clipped(parameters))


def look_alikes(point: Point) -> list[Point]:
    """Points whose pitch, or whose recorded depth, follows the plane like that of this one."""
    return [
        *with_poles_swapped(point),
        *with_force_mirrored(point),
        *with_depth_lag_swapped(point),
        *with_stall_moved(point),
    ]


def with_stall_moved(point: Point) -> list[Point]:
    """The point with a plane that stalls earlier or later, as strong at twice the angle at which it did.

    Reversals of one size tell that strength, and how the plane gets there only as it passes.
    """
    names, values = list(point.structure.names), point.parameters
    if STALL not in names:
        return []
    angle, loss = names.index(STALL), names.index(STALL_LOSS)
    moved = []
    for factor in STALL_FACTORS:
        kept = 2.0 - values[loss]  # lift at twice the angle, in units of that at the angle
        after = kept + values[loss] * (factor - 1.0)
        if min(kept, after) > 0.0:
            other = values.copy()
            other[angle] *= factor
            other[[B1, B2]] *= kept / after
            moved.append(replace(point, parameters=point.structure.clipped(other)))
    return moved


def with_depth_lag_swapped(point: Point) -> list[Point]:
    """The point with heave's pole in the place of the depth sensor's lag T, and the other way round.

    The depth reading follows the plane, and the pitch, by

        b1 delta / [(s - a1) (T s + 1)]        -[(u0 - c_wq) s - u0 a1] theta / [s (s - a1) (T s + 1)]
    """
    names, moved = list(point.structure.names), point.parameters.copy()
    if DEPTH_LAG not in names or moved[A1] >= 0.0:
        return []
    lag = names.index(DEPTH_LAG)
    ratio = -1.0 / (moved[A1] * moved[lag])  # of the new lag to the old
    moved[[A1, lag]] = -1.0 / moved[[lag, A1]]
    moved[B1] *= ratio
    if COUPLING in names:
        own = names.index(COUPLING)
        moved[own] = moved[U0] - (moved[U0] - moved[own]) * ratio
    return [replace(point, parameters=point.structure.clipped(moved))]


def with_force_mirrored(point: Point) -> list[Point]:
    """The point with a plane that pushes the other way, of a hull that is turned by its own heave (Munk).

    Pitch knows the product of b1 and c_qw only. A force near zero begins from a usual one.
    """
    names, moved = list(point.structure.names), point.parameters.copy()
    if MUNK not in names or moved[B1] == 0.0:
        return []
    least = USUAL_LEVER * abs(moved[B2])
    factor = -max(1.0, least / abs(moved[B1]))
    moved[B1] *= factor
    moved[names.index(MUNK)] /= factor
    return [replace(point, parameters=point.structure.clipped(moved))]


def with_poles_swapped(point: Point) -> list[Point]:
    """The point with a real pole of pitch in the place of a lag's or of heave's, and the other way round.

    A lag in series keeps the gain: the product of both is the same to the sensor of pitch, if all that turns
    the hull grows with its restoring. Where heave turns it (Munk), pitch follows from the plane by
    [b2 (s - a1) + c_qw b1] / [(s - a1) (s^2 - a2 s - a3)], and c_qw makes up for another a1. Only depth, or
    the plane's own motion, tells these apart.
    """
    return _with_lags_swapped(point) + _with_heave_swapped(point)


def _with_lags_swapped(point: Point) -> list[Point]:
    """A lag's pole -1/T and a real one of the pitch in each other's place: one of its own, or of the hull's.

    Of a hull on which heave and pitch rate turn each other the poles are the zeros of

        (s - a1) (s^2 - a2 s - a3) - c_qw c_wq s

    and with heave as it was, c_wq makes up for the rest.
    """
    names, values = point.structure.names, point.parameters
    a1, a2, a3 = values[[A1, A2, A3]]
    turned = [names.index(name) for name in (MUNK, COUPLING) if name in names]
    product = float(np.prod(values[turned])) if len(turned) == 2 else 0.0
    middle = a1 * a2 - a3 - product
    own = [(pole, False) for pole in _real_poles(1.0, -a2, -a3)]
    if product != 0.0:
        own += [(pole, True) for pole in _real_poles(1.0, -a1 - a2, middle, a1 * a3)]
    beside = [k for k in coefficients_beside(names, "a2") if k != A3]
    swapped = []
    for pole, is_shared in own:
        for lag in (names.index(name) for name in LAGS if name in names):
            moved = values.copy()
            ratio = -1.0 / (pole * values[lag])  # of the new lag to the old
            moved[lag] *= ratio
            moved[A2] = a2 - pole - 1.0 / values[lag]
            moved[A3] *= ratio
            moved[beside] *= ratio
            if is_shared:
                others, total = middle + pole * (pole - a1 - a2), a1 + a2 - pole  # their product and sum
                new = others - total / values[lag]
                moved[turned[1]] = (a1 * moved[A2] - moved[A3] - new) / moved[turned[0]]
            swapped.append(moved)
    return [replace(point, parameters=point.structure.clipped(moved)) for moved in swapped]


def _real_poles(*polynomial: float) -> list[float]:
    """Those of a polynomial that damp and hardly swing."""
    poles = np.roots(polynomial)
    return [float(p.real) for p in poles if p.real < 0.0 and abs(p.imag) <= NEARLY_REAL * abs(p.real)]


def _with_heave_swapped(point: Point) -> list[Point]:
    """Heave's pole and one of the pitch in each other's place, where heave turns the hull."""
    names, values = point.structure.names, point.parameters
    a1, a2, a3, b1, b2 = values[[A1, A2, A3, B1, B2]]
    poles = _real_poles(1.0, -a2, -a3)
    if MUNK not in names or len(poles) < 2 or a1 >= 0.0 or b1 == 0.0:
        return []
    swapped = []
    for pole, stays in (poles, poles[::-1]):
        moved = values.copy()
        moved[[A2, A3]] = stays + a1, -stays * a1
        moved[A1] = pole
        moved[names.index(MUNK)] += b2 * (pole - a1) / b1
        swapped.append(moved)
    return [replace(point, parameters=point.structure.clipped(moved)) for moved in swapped]


def has_usual_heave(point: Point, slowest: float = IDLE) -> bool:
    """Whether heave neither follows the plane at once nor hardly moves, and does not do the speed's work."""
    return bool(INSTANT < point.parameters[A1] < slowest and point.parameters[U0] > STANDING)


def has_damped_pitch(point: Point) -> bool:
    """Whether the hull damps its own pitching, as water does: else something else does that, or undoes it."""
    return bool(point.parameters[A2] < UNDAMPED)


def with_usual_heave(start: Point) -> list[Point]:
    """Starts with the heave damping of a usual vehicle.

    If heave was fast, with the same steady velocity; if it hardly moved, with a plane that pushes either way.
    A vehicle that stood still gets a usual speed, too.
    """
    a1, b1, b2 = start.parameters[[A1, B1, B2]]
    usual = USUAL_LEVER * b2
    forces = [b1 * USUAL_DAMPING / a1] if a1 < INSTANT else [usual, -usual]
    starts = []
    for force in forces:
        parameters = start.parameters.copy()
        parameters[[A1, B1]] = USUAL_DAMPING, force
        if parameters[U0] < STANDING:
            parameters[U0] = USUAL_SPEED
        starts.append(replace(start, parameters=parameters))
    return starts


def plausibility(fit: Fit) -> float:
    """By what ends of searches are compared: log-likelihood, and the log of the prior."""
    return fit.log_likelihood + log_prior(fit)


def log_prior(fit: Fit) -> float:
    """Of a speed and a heave damping that are not held: log-normal about 1.5 m/s and 1/s, factors of 3 and 5.

    Whatever the data say decides, but that the vehicle hardly moves forward; or that its heave follows every
    force at once, or none, where that is as likely as an ordinary hull.
    """
    known = ((U0, USUAL_SPEED, SPEED_FACTOR), (A1, USUAL_DAMPING, DAMPING_FACTOR))
    return -0.5 * sum(
        (log(max(fit.parameters[index] / usual, 1e-4)) / log(factor)) ** 2
        for index, usual, factor in known
        if fit.free[index]
    )


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
