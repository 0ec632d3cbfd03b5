"""The likelihood of readings that are rounded: each says in which interval the sensor's value lay, no more.

With e = y - yhat, the step h of the rounding and white noise of deviation s before it,

    P = Phi((e + h/2) / s) - Phi((e - h/2) / s)

While a reading stays the same it says little, however often it is repeated; where it changes it says as much
as the noise beneath lets it. A step that is small beside the noise leaves the normal density times h.
Source: Gustafsson and Karlsson, Automatica 45(12), 2009.
"""

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import log_ndtr

from host.recordings.recording import Array

LEAST_DEVIATION = 1.0 / 30.0  # of the step: no model is better than that within it
LEAST_INFORMATION = 1e-12  # of that without rounding
SURE = 8.3  # deviations from the nearer end of the interval, within which a reading says nothing
ACCURACY = 1e-4  # relative, of the deviation


def log_probability(error: Array, step: float, deviation: float) -> Array:
    """log P of readings with errors (N,)."""
    off = np.abs(error)
    is_sure = off < 0.5 * step - SURE * deviation  # P is 1 to the last digit
    off = off[~is_sure]
    # In the left tail, where the distribution function keeps its digits.
    first = log_ndtr((0.5 * step - off) / deviation)
    other = log_ndtr((-0.5 * step - off) / deviation)
    found = np.zeros_like(error)
    found[~is_sure] = first + np.log(-np.expm1(np.minimum(other - first, -1e-300)))
    return found


def likeliest_deviation(errors: Array, step: float) -> tuple[float, float]:
    """The noise deviation under which errors (N,) are likeliest, and -log P of all of them there."""

    def cost(log_deviation: float) -> float:
        return -float(log_probability(errors, step, float(np.exp(log_deviation))).sum())

    largest = float(np.sqrt(np.mean(errors**2))) + step
    limits = np.log([LEAST_DEVIATION * step, 2.0 * largest])
    found = minimize_scalar(cost, bounds=limits, method="bounded", options={"xatol": ACCURACY})
    return float(np.exp(found.x)), float(found.fun)


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
