"""How well the coefficients of an explanation are known, its moments by their profile.

The likelihood of a moment at which something changed is no parabola: while the plane rests it is level, and
where the plane moves there is a cliff. So a moment's deviation is told by how far it can be moved to either
side, all else following one Gauss-Newton step ahead, until twice the log-likelihood has fallen by 1.96^2;
correlated residuals repeat each other's evidence.
"""

import numpy as np

from host.diagnosis.explanation import Explanation
from host.diagnosis.fitter import Fitter
from host.diagnosis.prospects import whitened_at
from host.equations import Effect
from host.gauss_newton import GaussNewton, Point
from host.uncertainty import covariance
from host.whiteness import correlation_factor

HALF_WIDTH = 1.96  # deviations, of an interval that holds the truth 95 times in 100
BISECTIONS = 5


def deviations(fitter: Fitter, explanation: Explanation) -> dict[str, float]:
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
    for name in structure.moments & free:
        reach = max(_reach(fitter, explanation, name, side) for side in (-1.0, 1.0))
        std[name] = float(np.clip(reach / HALF_WIDTH, least, most))
    return std


def interval(effect: Effect, name: str, value: float, std: float) -> tuple[float, float]:
    """Between which values a coefficient of the effect lies, 95 times in 100, its bounds known."""
    bounds = next((p.lower, p.upper) for p in effect.parameters if p.name == name)
    low, high = np.clip([value - HALF_WIDTH * std, value + HALF_WIDTH * std], *bounds)
    return float(low), float(high)


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
