"""The speed through the water behind a noisy sensor, and what errors are left in it."""

from typing import NamedTuple

import numpy as np
from scipy.fft import dct, idct
from scipy.optimize import minimize_scalar

from host.noise.noise_floor import white_noise
from host.recordings.recording import Array


class SmoothedSpeed(NamedTuple):
    """The most likely speed, and its error, a first-order random process v' = decay v + ...

    speed     (N,) m/s
    variance  of the error, (m/s)^2
    decay     of the error from row to row
    """

    speed: Array
    variance: float
    decay: float


def smoothed_speed(measured: Array) -> SmoothedSpeed:
    """Most likely speed at N rows, of which it was measured at some, NaN at the others.

    A sensor slower than the rows has samples of its own: they are smoothed as evenly spaced, and what lies
    between two of them is on the straight line.
    """
    known = np.flatnonzero(np.isfinite(measured))
    found = _smoothed(measured[known])
    if known.size == measured.size:
        return found
    speed = np.interp(np.arange(measured.size), known, found.speed)
    spacing = (known[-1] - known[0]) / max(known.size - 1, 1)
    return SmoothedSpeed(speed, found.variance, found.decay ** (1.0 / max(spacing, 1.0)))


def _smoothed(measured: Array) -> SmoothedSpeed:
    """Most likely speed (N,) when its slope wanders at random (variance q a row), under white noise of r.

    In cosine transforms both are independent: y_k ~ r + q / d_k^2, d_k = 2 - 2 cos(pi k / N), and the mean
    square optimum is y_k / (1 + r d_k^2 / q). The noise is that of the sensor's fast differences: thrust and
    plane change by steps, of which the likeliest pair r, q would make a speed without noise. The likeliest q
    given r is found; of a constant speed the mean is left. The error has the density r where it is slow, and
    the variance v left over all k: that of a process with the decay a for which v = r (1 - a) / (1 + a).
    """
    rows = measured.size
    if rows < 8 or np.ptp(measured) == 0.0:
        return SmoothedSpeed(measured, 0.0, 0.0)
    noise = white_noise([measured])
    transform = dct(measured, norm="ortho")
    stiffness = (2.0 - 2.0 * np.cos(np.pi * np.arange(1, rows) / rows)) ** 2
    power = transform[1:] ** 2 / noise

    def cost(log_ratio: float) -> float:
        shape = 1.0 + np.exp(-log_ratio) / stiffness
        return float(np.sum(power / shape + np.log(shape)))

    # From hardly any noise to hardly any change over the whole recording.
    found = minimize_scalar(cost, bounds=(-25.0, 4.0 * np.log(rows) + 7.0), method="bounded")
    kept = 1.0 / (1.0 + np.exp(found.x) * stiffness)
    speed = np.asarray(idct(np.concatenate([transform[:1], kept * transform[1:]]), norm="ortho"))
    left = float(np.mean(kept))
    return SmoothedSpeed(speed, noise * left, (1.0 - left) / (1.0 + left))
