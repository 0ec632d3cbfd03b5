"""The spectrum of the innovations, learnt along the way, and taken out of them.

A vector autoregression foretells each block from those before it; what it cannot foretell is white:

    v_k = L^-1 (e_k - sum_i C_i e_(k-i)),   L L' the covariance of the bracket

(T. Soderstrom, P. Stoica, System Identification, 1989, ch. 6). Waves and all that the reference lacks, as far
as they have a spectrum, set no alarm off then, and a change stands out by its likelihood ratio.
"""

from collections import deque

import numpy as np

from host.live.reference import Array

ORDER = 16  # blocks that foretell the next
LEAST = 120  # blocks of the past without which nothing is whitened
DOUBTED = 5.0  # spreads of the innovations: a block beyond that is not learnt from
RIDGE = 1.0  # blocks' worth of belief that nothing foretells the next
LEAST_VARIANCE = 1e-6  # of a channel that is not measured


class Whitening:
    """Learns from blocks, each `held_back` blocks after it came, and forgets in `memory` blocks."""

    def __init__(self, held_back: int, memory: int) -> None:
        self._newest: deque[tuple[Array, Array]] = deque()
        self._held_back = held_back
        self._keep = 1.0 - 1.0 / memory
        self.clear()

    def clear(self) -> None:
        """Knows nothing."""
        size = 2 * ORDER
        self._newest.clear()
        self._inner, self._cross, self._outer = np.zeros((size, size)), np.zeros((size, 2)), np.zeros((2, 2))
        self._count = self._learnt = 0.0

    def take(self, means: Array) -> None:
        """The means of the blocks so far, (N, 2), of which the last is new."""
        if len(means) <= ORDER:
            return
        self._newest.append((means[-ORDER - 1 : -1][::-1].reshape(-1), means[-1]))
        if len(self._newest) > self._held_back:
            self._learn(*self._newest.popleft())

    def _learn(self, before: Array, mean: Array) -> None:
        spread = np.sqrt(np.diag(self._outer) / max(self._count, 1.0))
        if self._learnt >= LEAST and (np.abs(mean) > DOUBTED * spread).any():
            return
        self._inner = self._keep * self._inner + np.outer(before, before)
        self._cross = self._keep * self._cross + np.outer(before, mean)
        self._outer = self._keep * self._outer + np.outer(mean, mean)
        self._count = self._keep * self._count + 1.0
        self._learnt += 1.0

    @property
    def has_begun(self) -> bool:
        """Whether anything was taken."""
        return bool(self._newest) or self._learnt > 0.0

    @property
    def is_known(self) -> bool:
        """Whether enough was learnt."""
        return self._learnt >= LEAST

    def filter(self) -> tuple[Array, Array]:
        """The coefficients (2 x `ORDER`, 2) and L^-1 (2, 2), of what is learnt so far."""
        belief = RIDGE / self._count * np.tile(np.diag(self._outer), ORDER) + LEAST_VARIANCE
        coefficients: Array = np.asarray(np.linalg.solve(self._inner + np.diag(belief), self._cross))
        foretold = coefficients.T @ self._cross
        left = self._outer - foretold - foretold.T + coefficients.T @ self._inner @ coefficients
        left = left / max(self._count - 2 * ORDER, 1.0) + LEAST_VARIANCE * np.eye(2)
        scale: Array = np.asarray(np.linalg.inv(np.linalg.cholesky(left)))
        return coefficients, scale


def whitened(series: Array, coefficients: Array, scale: Array) -> Array:
    """A series (N, 2, ...) with the filter of `Whitening` over it; before its beginning it was zero."""
    foretold = np.zeros_like(series)
    for lag in range(1, min(ORDER + 1, len(series))):
        part = coefficients[2 * (lag - 1) : 2 * lag].T
        foretold[lag:] += np.einsum("ab,nb...->na...", part, series[:-lag])
    white: Array = np.einsum("ab,nb...->na...", scale, series - foretold)
    return white
