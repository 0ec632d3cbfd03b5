"""What the data really say of the parameters: their covariance, for coloured residuals too."""

import numpy as np

from host.likelihood.fit import Fit
from host.noise.whiteness import crosscovariance, is_white
from host.recordings.recording import Array

LONGEST_CORRELATION = 0.1  # of a recording's rows: beyond it autocovariances are mostly noise


def covariance(fit: Fit) -> Array:
    """Mean square error (n, n) of the parameters as far as the recording tells; zero for held ones.

    The covariance about the maximum, and where others are almost as likely, p_i d_i d_i^T for the distance
    d_i of each and its probability p_i.
    """
    odds = [np.exp(rival.log_odds) for rival in fit.rivals]
    total = covariance_within(fit)
    for rival, chance in zip(fit.rivals, odds, strict=True):
        away = rival.parameters - fit.parameters
        total = total + chance / (1.0 + sum(odds)) * np.outer(away, away)
    return total


def covariance_within(fit: Fit) -> Array:
    """Covariance (n, n) of the parameters about this maximum; zero for held ones.

    White innovations: the inverse Fisher information M^-1. Coloured ones: M^-1 B M^-1 with
    B = sum_k sum_l s_k R(k - l) s_l^T from the innovations' own auto- and crosscovariances R (Grauer and
    Morelli, J. Aircraft 52(3), 2015), without which deviations come out several times too small.
    """
    free = fit.free
    M = fit.information[np.ix_(free, free)]
    inverse = safe_inverse(M)
    if not all(is_white(e) for e in fit.whitened):
        half = inverse @ _root(_coloured_information(fit))
        blind = np.diag(np.where(np.diag(M) > 0.0, 0.0, np.diag(inverse)))  # what is not seen has no colour
        inverse = half @ half.T + blind  # no variance is negative, however little the recording tells
    full = np.zeros((free.size, free.size))
    full[np.ix_(free, free)] = inverse
    return full


def safe_inverse(M: Array) -> Array:
    """Inverse by scaled eigenvectors; directions without information get a huge but finite variance."""
    M = np.nan_to_num(M, nan=0.0, posinf=1e100, neginf=-1e100)
    scale = np.sqrt(np.clip(np.diag(M), 1e-100, None))
    values, vectors = np.linalg.eigh(M / np.outer(scale, scale))
    values = np.maximum(values, 1e-14)
    return np.asarray((vectors / values) @ vectors.T / np.outer(scale, scale))


def _root(B: Array) -> Array:
    """R with R R^T = B, what is negative in B by rounding left out."""
    scale = np.sqrt(np.clip(np.diag(B), 1e-100, None))
    values, vectors = np.linalg.eigh(B / np.outer(scale, scale))
    return np.asarray(scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def _coloured_information(fit: Fit) -> Array:
    """B, by the 2 x 2 spectrum of each recording's innovations, smoothed by Parzen's window."""
    count = int(fit.free.sum())
    B = np.zeros((count, count))
    for white, scores in zip(fit.whitened, fit.scores, strict=True):
        rows = white.shape[1]
        lags = max(1, int(LONGEST_CORRELATION * rows))
        x = np.arange(lags + 1) / lags
        window = np.where(x <= 0.5, 1.0 - 6.0 * x**2 * (1.0 - x), 2.0 * (1.0 - x) ** 3)
        length = 2 * rows
        spectrum = np.empty((length // 2 + 1, 2, 2), dtype=complex)
        for i in range(2):
            for j in range(2):
                ahead, behind = (
                    crosscovariance(white[a], white[b], lags) * window for a, b in ((i, j), (j, i))
                )
                kernel = np.concatenate([ahead, np.zeros(length - 2 * lags - 1), behind[:0:-1]])
                spectrum[:, i, j] = np.fft.rfft(kernel)
        # Samples that are missing can leave a spectrum that is not positive: such a part is no noise.
        values, vectors = np.linalg.eigh(0.5 * (spectrum + spectrum.conj().transpose(0, 2, 1)))
        spectrum = (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.conj().transpose(0, 2, 1)
        transform = np.fft.rfft(scores, length, axis=2)
        smoothed = np.fft.irfft(np.einsum("fij,jpf->ipf", spectrum, transform), length, axis=2)
        B += np.einsum("ipk,iqk->pq", smoothed[:, :, :rows], scores)
    return 0.5 * (B + B.T)
