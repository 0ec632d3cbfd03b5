"""Whiteness of innovations: what remains after a model that leaves nothing out is white."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from host.recording import Array


def autocovariance(values: Array, lags: int) -> tuple[Array, Array]:
    """Autocovariance of (N,) values at lags 0..lags over the pairs in which neither is NaN, and the pairs."""
    present = np.isfinite(values)
    centred = np.where(present, values - values[present].mean(), 0.0)
    transform = 2 * values.size
    pairs = np.fft.irfft(np.abs(np.fft.rfft(present.astype(float), transform)) ** 2, transform)[: lags + 1]
    sums = np.fft.irfft(np.abs(np.fft.rfft(centred, transform)) ** 2, transform)[: lags + 1]
    pairs = np.rint(pairs)
    return sums / np.maximum(pairs, 1.0), pairs


def crosscovariance(first: Array, second: Array, lags: int) -> Array:
    """Covariance of first(k + l) with second(k), l = 0..lags, over the pairs in which neither is NaN."""
    length = 2 * first.size

    def transforms(values: Array) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        present = np.isfinite(values)
        mean = values[present].mean() if present.any() else 0.0
        return np.fft.rfft(np.where(present, values - mean, 0.0), length), np.fft.rfft(present * 1.0, length)

    (one, seen), (other, both) = transforms(first), transforms(second)
    sums = np.fft.irfft(one * other.conj(), length)[: lags + 1]
    pairs = np.rint(np.fft.irfft(seen * both.conj(), length)[: lags + 1])
    return np.asarray(sums / np.maximum(pairs, 1.0))


def is_white(innovations: Array, lags: int = 20, significance: float = 0.001) -> bool:
    """Box-Pierce test on each row of (outputs, N) innovations, each lag weighted by its number of pairs.

    A row of few values, or that never changes, tells nothing against it.
    """
    for values in innovations:
        present = values[np.isfinite(values)]
        if present.size < 3 * lags or np.ptp(present) == 0.0:
            continue
        covariance, pairs = autocovariance(values, lags)
        statistic = np.sum(pairs[1:] * (covariance[1:] / covariance[0]) ** 2)
        if statistic > chi2.ppf(1.0 - significance, lags):
            return False
    return True
