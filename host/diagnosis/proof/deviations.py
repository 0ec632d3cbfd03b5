"""How well the coefficients of an explanation are known, by profiles of the likelihood.

Heave damping and speed, and coefficients along other curved valleys, may lie much further to one side than
the curvature at the maximum says. So each is moved there, the others following to where they are likeliest
beside it, until twice the log-likelihood has fallen by 1.96^2, and its deviation is told by the side on which
it gets further (Pawitan, In All Likelihood, 2001, ch. 3.4). The likelihood of a moment at which something
changed is no parabola at all: while the plane rests it is level, and where the plane moves there is a cliff.
There the others follow one Gauss-Newton step ahead. Correlated residuals repeat each other's evidence.
"""

import numpy as np

from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.prospects import whitened_at
from host.diagnosis.fits.workers import Task, Workers
from host.dynamics.equations import Effect
from host.identification.uncertainty import covariance, safe_inverse
from host.likelihood.gauss_newton import GaussNewton, Point
from host.likelihood.output_error import output_error
from host.likelihood.straightened import stepped
from host.noise.whiteness import correlation_factor
from host.recordings.recording import Array

HALF_WIDTH = 1.96  # deviations, of an interval that holds the truth 95 times in 100
BISECTIONS = 5
MOST_STRIDES, LONGEST_STRIDE = 6, 2.0  # of a profile; times what the last one came to
NEARLY_FALLEN = 0.95  # of what the log-likelihood is to fall by
FEW_ITERATIONS, TOLERANCE = 10, 0.005


def deviations(fitter: Fitter, explanation: Explanation, workers: Workers | None = None) -> dict[str, float]:
    """Standard deviations of all coefficients by name.

    A moment drawn anywhere in the recording would deviate by duration / sqrt(12), one drawn between two rows,
    of which no row tells more, by step / sqrt(12); a coefficient of which the recording tells nothing, drawn
    between its bounds, by their distance / sqrt(12).
    """
    structure = explanation.fit.structure
    widths = np.array([p.upper - p.lower for p in structure.parameters])
    found = np.minimum(np.sqrt(np.diag(covariance(explanation.fit))), widths / np.sqrt(12.0))
    std = dict(zip(structure.names, found.tolist(), strict=True))
    least = fitter.recordings[0].step / np.sqrt(12.0)
    most = max(recording.duration for recording in fitter.recordings) / np.sqrt(12.0)
    free = {name for name, is_free in zip(structure.names, explanation.fit.free, strict=True) if is_free}
    if not explanation.fit.has_process_noise:
        workers = workers or Workers(fitter, 1)
        std |= _profiled(workers, explanation, {name: std[name] for name in free - structure.moments})
    for name in structure.moments & free:
        reach = max(_reach(fitter, explanation, name, side) for side in (-1.0, 1.0))
        std[name] = float(np.clip(reach / HALF_WIDTH, least, most))
    return std


def interval(effect: Effect, name: str, value: float, std: float) -> tuple[float, float]:
    """Between which values a coefficient of the effect lies, 95 times in 100, its bounds known."""
    bounds = next((p.lower, p.upper) for p in effect.parameters if p.name == name)
    low, high = np.clip([value - HALF_WIDTH * std, value + HALF_WIDTH * std], *bounds)
    return float(low), float(high)


def _profiled(workers: Workers, explanation: Explanation, std: dict[str, float]) -> dict[str, float]:
    """The deviations, or larger ones where a profile of the likelihood is flatter than its curvature says."""
    fit, lean, tasks = explanation.fit, explanation.lean(), list[Task]()
    free = np.flatnonzero(fit.free)
    white = np.zeros((fit.free.size, fit.free.size))
    white[np.ix_(free, free)] = safe_inverse(fit.information[np.ix_(free, free)])
    told = []
    for name, known in std.items():
        k = fit.structure.names.index(name)
        bounds = fit.structure.parameters[k]
        if white[k, k] < (bounds.upper - bounds.lower) ** 2 / 12.0:  # else the recording tells nothing of it
            ahead = white[:, k] / white[k, k]
            limit = (HALF_WIDTH * known) ** 2 / white[k, k]
            told.append(name)
            tasks += [(_distance, (lean, k, side * ahead, known, limit)) for side in (-1.0, 1.0)]
    distances = np.reshape(workers.results(tasks), (-1, 2))
    farthest = {name: max(pair) / HALF_WIDTH for name, pair in zip(told, distances, strict=True)}
    return {name: max(known, farthest.get(name, 0.0)) for name, known in std.items()}


def _distance(
    fitter: Fitter, explanation: Explanation, k: int, ahead: Array, std: float, limit: float
) -> float:
    """How far coefficient k can be moved until twice the log-likelihood has fallen by the limit.

    ahead  (n,) by how much all coefficients move with it at first, its own by 1 or -1
    """
    fit, inputs = explanation.fit, fitter.inputs(explanation.names)
    point = fit.end
    others = fit.free & (np.arange(fit.free.size) != k)
    near, fallen_near, far = 0.0, 0.0, HALF_WIDTH * std
    for _ in range(MOST_STRIDES):
        moved = stepped(fit.structure.names, point.parameters, ahead * (far - near))
        moved[k] = fit.parameters[k] + ahead[k] * far
        clipped = fit.structure.clipped(moved)
        if clipped[k] != moved[k]:
            return abs(float(clipped[k] - fit.parameters[k]))  # its bound
        start = Point(fit.structure, clipped, point.initial, point.noise)
        beside = output_error(start, inputs, others, FEW_ITERATIONS, TOLERANCE)
        fallen = max(2.0 * (fit.log_likelihood - beside.log_likelihood), 0.0)
        if fallen > limit:
            share = (limit**0.5 - fallen_near**0.5) / (fallen**0.5 - fallen_near**0.5)
            return float(near + (far - near) * share)
        if fallen > NEARLY_FALLEN * limit:
            return far
        point = Point(fit.structure, beside.parameters, beside.initial, beside.noise)
        near, fallen_near = far, fallen
        far *= min(LONGEST_STRIDE, (limit / max(fallen, 1e-9)) ** 0.5)
    return near


def _reach(fitter: Fitter, explanation: Explanation, name: str, side: float) -> float:
    """How far, s, a moment can be moved to one side until that is too unlikely."""
    farthest = max(recording.duration for recording in fitter.recordings)
    near, far = 0.0, fitter.recordings[0].step
    while _may_be(fitter, explanation, name, side * far):
        if far > farthest:
            return farthest
        near, far = far, 2.0 * far
    for _ in range(BISECTIONS):
        middle = 0.5 * (near + far)
        near, far = (middle, far) if _may_be(fitter, explanation, name, side * middle) else (near, middle)
    return near


def _may_be(fitter: Fitter, explanation: Explanation, name: str, shift: float) -> bool:
    fit = explanation.fit
    own = np.array(fit.structure.names) == name
    moved = fit.parameters + shift * own
    if (fit.structure.clipped(moved) != moved)[own].any():
        return False
    point = Point(fit.structure, moved, fit.initial, fit.levels)
    inputs = fitter.inputs(explanation.names, fit.has_process_noise)
    white, cost = whitened_at(point, inputs, explanation)
    left = GaussNewton(white, point, fit.free & ~own).predicted_cost(cost) if np.isfinite(cost) else np.inf
    return left - fit.deviance < HALF_WIDTH**2 * correlation_factor(fit.whitened)
