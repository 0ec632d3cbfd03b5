"""Whiteness of innovations: what remains after a model that leaves nothing out is white."""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import periodogram
from scipy.stats import chi2

from host.recordings.recording import Array

SLOWER = 0.6  # of the rows with a reading: fewer are those of a sensor that is slower
SLOW_SPREAD = 2.3  # of the cumulative periodogram (Kolmogorov's distribution at 5e-5)


def autocovariance(values: Array, lags: int) -> tuple[Array, Array]:
    """Autocovariance of (N,) values at lags 0..lags over the pairs in which neither is NaN, and the pairs."""
    pairs = np.rint(_lagged_sums(np.isfinite(values).astype(float), lags))
    return _lagged_sums(_centred(values), lags) / np.maximum(pairs, 1.0), pairs


def _centred(values: Array) -> Array:
    """The values (N,) less their mean, 0 where NaN."""
    present = np.isfinite(values)
    return np.where(present, values - values[present].mean(), 0.0)


def _readings(values: Array) -> Array:
    """The values (N,) of a sensor slower than the rows one after the other, else as they are.

    Of every other row, say, odd lags have no pairs, and the power repeats itself along the spectrum.
    """
    known = values[np.isfinite(values)]
    return known if known.size < SLOWER * values.size else values


def _lagged_sums(values: Array, lags: int) -> Array:
    """Sums of x_t x_(t+k), k = 0..lags."""
    length = 2 * values.size
    return np.asarray(np.fft.irfft(np.abs(np.fft.rfft(values, length)) ** 2, length)[: lags + 1])


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


def is_white(innovations: Array, lags: int = 20, significance: float = 0.001, slack: float = 0.0) -> bool:
    """Box-Pierce test on each row of (outputs, N) innovations, whatever their variances.

        sum_k (sum_t e_t e_(t+k))^2 / sum_t e_t^2 e_(t+k)^2  ~  chi2(lags),   k = 1..lags

    (Lobato, Nankervis and Savin, Int. Econ. Rev. 42(3), 2001). A rounded reading tells much near the edge of
    its step and next to nothing inside; of equal variances such innovations would look coloured.
    A row of few values, or that never changes, tells nothing against it, nor do correlations up to `slack`.
    """
    for values in map(_readings, innovations):
        present = values[np.isfinite(values)]
        if present.size < 3 * lags or np.ptp(present) == 0.0:
            continue
        centred = _centred(values)
        products, scatter = _lagged_sums(centred, lags)[1:], _lagged_sums(centred**2, lags)[1:]
        products = np.maximum(np.abs(products) - slack * np.sum(centred**2), 0.0)
        statistic = np.sum(products**2 / np.maximum(scatter, np.finfo(float).tiny))
        if statistic > chi2.ppf(1.0 - significance, lags):
            return False
    return True


def is_even(innovations: Array, slack: float = 0.0) -> bool:
    """Bartlett's test on each row of (outputs, N): the power of white noise grows evenly with frequency.

    Kolmogorov's distance of the cumulative periodogram from a straight line, whatever the variances. A
    correlation r_k at lag k adds 2 / pi r_k sin(omega k) / k; one of `slack` at a single lag is no sign.
    """
    for values in map(_readings, innovations):
        known = np.isfinite(values)
        if known.sum() < 100 or np.ptp(values[known]) == 0.0:
            continue
        _, power = periodogram(_centred(values))
        cumulated = np.cumsum(power[1:]) / power[1:].sum()
        even = np.arange(1, cumulated.size + 1) / cumulated.size
        spread = np.sqrt(max(1.0, clustering(values)) / cumulated.size)
        if np.max(np.abs(cumulated - even)) > SLOW_SPREAD * spread + 2.0 / np.pi * slack:
            return False
    return True


def clustering(values: Array, lags: int = 20) -> float:
    """By how much autocorrelations of independent (N,) values scatter more than equal variances let them.

    N sum_t e_t^2 e_(t+k)^2 / (sum_t e_t^2)^2, the mean over k = 1..lags; 1 where all variances are equal.
    """
    present = np.isfinite(values)
    squares = _centred(values) ** 2
    pairs = _lagged_sums(present.astype(float), lags)[1:]
    scatter = _lagged_sums(squares, lags)[1:] / np.maximum(pairs, 1.0)
    return float(np.mean(scatter) / squares[present].mean() ** 2)


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
