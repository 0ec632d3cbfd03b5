"""The depth channel's row in scaled delta coordinates.

Four consecutive depths are almost equal, so the paper's coordinates leave the information matrix with a
condition number of 1e10 to 1e12, and a prior of 1e-6 on the coefficients then outweighs the data: with little
noise the heave damping comes out several times too large. In backward differences, near SI units by powers
of two, the same model reads

    zeta(k) - zeta(k-1) = t1 (zeta(k-1) - ref) + t2 D1 zeta(k-1) + t3 D2 zeta(k-1) + t4 D3 zeta(k-1)
                        + t5 delta(k-2) + t6 D1 delta(k-2) + t7 D2 delta(k-2)          Di = s^i (1 - z^-1)^i

with s = 2^round(log2(1/h)); the condition number falls below 1e6. The reference is harmless because depth
integrates: the true t1 is zero.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

DEPTHS = 4
RUDDERS = 3


class DeltaCoordinates:
    """The map between the paper's depth row (n = 7) and the delta row, and back for the coefficients.

    step       h, s
    reference  depth that counts as zero, m
    """

    def __init__(self, step: float) -> None:
        self.scale = 2.0 ** round(math.log2(1.0 / step))
        self.reference = math.nan
        self.row = [0.0] * (DEPTHS + RUDDERS)
        """The delta row; written in place by `transform`."""
        # beta = slope @ theta + offset
        self._slope = np.zeros((DEPTHS + RUDDERS, DEPTHS + RUDDERS))
        for first, size, sign in ((0, DEPTHS, -1.0), (DEPTHS, RUDDERS, 1.0)):
            for i in range(size):
                for j in range(i + 1):
                    self._slope[first + j, first + i] = sign * (-1.0) ** j * math.comb(i, j) * self.scale**i
        self._offset = np.zeros(DEPTHS + RUDDERS)
        self._offset[0] = -1.0

    def transform(self, phi: Sequence[float]) -> None:
        """Writes the delta row of the paper's phi = [-zeta(k-1) ..., delta(k-2) ...]."""
        row = self.row
        for i in range(DEPTHS):
            row[i] = -phi[i]
        for i in range(RUDDERS):
            row[DEPTHS + i] = phi[DEPTHS + i]
        self._difference(0, DEPTHS)
        self._difference(DEPTHS, RUDDERS)
        row[0] -= self.reference

    def _difference(self, first: int, size: int) -> None:
        row = self.row
        for order in range(1, size):
            for i in range(first + size - 1, first + order - 1, -1):
                row[i] = (row[i - 1] - row[i]) * self.scale

    def beta(self, theta: Sequence[float]) -> tuple[float, ...]:
        """The paper's coefficients beta1..beta7 of the delta coefficients theta."""
        return tuple(float(value) for value in self._slope @ np.array(theta) + self._offset)

    def beta_covariance(self, covariance: NDArray[np.float64]) -> NDArray[np.float64]:
        """Covariance (7 x 7) of beta from that of theta."""
        moved: NDArray[np.float64] = self._slope @ covariance @ self._slope.T
        return moved
