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


def correlation_factor(innovations: list[Array], lags: int = 100) -> float:
    """By how much correlated innovations count for fewer: samples over independent samples, at least 1.

    Each of (outputs, N) innovations: 1 + 2 sum w_k rho_k with Parzen's window w over `lags`, or a tenth of
    the rows; the largest over the outputs, averaged over the recordings by their length.
    """
    total, rows = 0.0, 0
    for e in innovations:
        count = min(lags, e.shape[1] // 10)
        if count < 2:
            continue
        x = np.arange(1, count + 1) / count
        window = np.where(x <= 0.5, 1.0 - 6.0 * x**2 * (1.0 - x), 2.0 * (1.0 - x) ** 3)
        factors = [1.0]
        for values in e:
            if np.isfinite(values).sum() > 3 * count and np.nanstd(values) > 0.0:
                covariance, _ = autocovariance(values, count)
                factors.append(1.0 + 2.0 * float(window @ covariance[1:]) / float(covariance[0]))
        total += e.shape[1] * max(factors)
        rows += e.shape[1]
    return total / rows if rows else 1.0
