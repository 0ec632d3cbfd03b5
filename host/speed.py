"""The speed through the water behind a noisy sensor: the depth integrates its errors."""

import numpy as np
from scipy.fft import dct, idct
from scipy.optimize import minimize_scalar

from host.recording import Array


def smoothed_speed(measured: Array) -> Array:
    """Most likely speed (N,) when it wanders at random (variance q a row) under white noise (variance r).

    In cosine transforms both are independent: y_k ~ r + q / d_k, d_k = 2 - 2 cos(pi k / N), and the mean
    square optimum is y_k / (1 + r d_k / q). The ratio r / q is the likeliest; of a constant speed the mean
    is left.
    """
    rows = measured.size
    if rows < 8 or np.ptp(measured) == 0.0:
        return measured
    transform = dct(measured, norm="ortho")
    power, stiffness = transform[1:] ** 2, 2.0 - 2.0 * np.cos(np.pi * np.arange(1, rows) / rows)

    def cost(log_ratio: float) -> float:
        shape = 1.0 + np.exp(-log_ratio) / stiffness
        return float((rows - 1) * np.log(np.mean(power / shape)) + np.sum(np.log(shape)))

    # From hardly any noise to hardly any change over the whole recording.
    found = minimize_scalar(cost, bounds=(-25.0, 2.0 * np.log(rows) + 7.0), method="bounded")
    kept = 1.0 / (1.0 + np.exp(found.x) * stiffness)
    return np.asarray(idct(np.concatenate([transform[:1], kept * transform[1:]]), norm="ortho"))
