"""The likelihood of readings that are rounded: each says in which interval the sensor's value lay, no more.

With e = y - yhat, the step h of the rounding and white noise of deviation s before it,

    P = Phi((e + h/2) / s) - Phi((e - h/2) / s)

While a reading stays the same it says little, however often it is repeated; where it changes it says as much
as the noise beneath lets it. A step that is small beside the noise leaves the normal density times h.
Source: Gustafsson and Karlsson, Automatica 45(12), 2009.
"""

import numpy as np
from scipy.special import log_ndtr

from host.recordings.recording import Array

LEAST_DEVIATION = 1.0 / 30.0  # of the step: no model is better than that within it
LEAST_INFORMATION = 1e-12  # of that without rounding
SURE = 8.3  # deviations from the nearer end of the interval, within which a reading says nothing
ACCURACY = 1e-4  # relative, of the deviation
MOST_STEPS = 60
TINY = 1e-2  # of the squared step: what is left where every reading fits


def log_probability(error: Array, step: float, deviation: float) -> Array:
    """log P of readings with errors (N,)."""
    off = np.abs(error)
    is_sure = off < 0.5 * step - SURE * deviation  # P is 1 to the last digit
    found = np.zeros_like(error)
    found[~is_sure] = _log_probability(*_ends(off[~is_sure], step, deviation))
    return found


def _ends(off: Array, step: float, deviation: float) -> tuple[Array, Array]:
    """The ends of the interval in the left tail, where the distribution function keeps its digits."""
    return (0.5 * step - off) / deviation, (-0.5 * step - off) / deviation


def _log_probability(near: Array, far: Array) -> Array:
    first = log_ndtr(near)
    found: Array = first + np.log(-np.expm1(np.minimum(log_ndtr(far) - first, -1e-300)))
    return found


def likeliest_deviation(errors: Array, step: float) -> tuple[float, float]:
    """The noise deviation under which errors (N,) are likeliest, and -log P of all of them there.

    By Newton's steps in log s, halving where these leave what is between a slope of either sign.
    """
    off = np.abs(errors)
    mean_square = float(np.mean(errors**2))
    low, high = np.log([LEAST_DEVIATION * step, 2.0 * (np.sqrt(mean_square) + step)])
    at = float(np.clip(0.5 * np.log(mean_square + TINY * step**2), low, high))
    for _ in range(MOST_STEPS):
        cost, slope, curvature = _cost_by_log_deviation(off, step, float(np.exp(at)))
        low, high = (low, at) if slope > 0.0 else (at, high)
        following = at - slope / curvature if curvature > 0.0 else high
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - at) < ACCURACY or slope == 0.0:
            break
        at = following
    return float(np.exp(at)), cost


def _cost_by_log_deviation(off: Array, step: float, deviation: float) -> tuple[float, float, float]:
    """-log P of all errors of these sizes, and its first and second derivative by log s.

    With a and b the ends of an interval over s, d log P / d log s = g = -(a phi(a) - b phi(b)) / P, and
    d g / d log s = (a (1 - a^2) phi(a) - b (1 - b^2) phi(b)) / P - g^2.
    """
    near, far = _ends(off[off >= 0.5 * step - SURE * deviation], step, deviation)
    log_p = _log_probability(near, far)
    at_near, at_far = (end * np.exp(-0.5 * end**2 - log_p) / np.sqrt(2.0 * np.pi) for end in (near, far))
    slope = at_far - at_near
    curvature = at_near * (1.0 - near**2) - at_far * (1.0 - far**2) - slope**2
    return -float(log_p.sum()), -float(slope.sum()), -float(curvature.sum())


def score_and_information(error: Array, step: float, deviation: float) -> tuple[Array, Array]:
    """First derivative of log P by the prediction yhat and minus its second, (N,) each.

    The second is never negative: log P is concave.
    """
    upper, lower = (error + 0.5 * step) / deviation, (error - 0.5 * step) / deviation
    log_p = log_probability(error, step, deviation) + 0.5 * np.log(2.0 * np.pi)
    at_upper, at_lower = np.exp(-0.5 * upper**2 - log_p), np.exp(-0.5 * lower**2 - log_p)
    score = (at_lower - at_upper) / deviation
    information = score**2 + (upper * at_upper - lower * at_lower) / deviation**2
    return score, np.clip(information, LEAST_INFORMATION / deviation**2, 1.0 / deviation**2)
