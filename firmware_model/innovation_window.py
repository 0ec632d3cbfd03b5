"""The last samples, each used in p steps: the multi-innovation part of the noise-proof estimator.

A sample y(j) measured h x(j). At a later instant the same sample is a measurement of the present state
through the row h F^-1, with the noise of the way added to its own. Each use carries 1/p of the sample's
information (variance times p), so p uses say exactly as much as the sample does: deviations stay honest.
"""

from collections.abc import Sequence

from firmware_model.propagation import COUNT, ZETA, Q, W
from firmware_model.ud_factors import UdFactors

PARAMETERS = W
"""Entries before the states."""


class InnovationWindow:
    """Up to 2 p samples: pitch and depth of p instants. p = 1 holds none and costs nothing."""

    def __init__(self, p: int) -> None:
        self.p = p
        size = 2 * p if p > 1 else 0
        self._rows = [[0.0] * COUNT for _ in range(size)]
        self._residuals = [0.0] * size
        self._variances = [0.0] * size
        self._uses = [0] * size  # 0: the place is free
        self._before = [0.0] * COUNT

    def clear(self) -> None:
        """Forgets the samples."""
        for k in range(len(self._uses)):
            self._uses[k] = 0

    def carry(self, F: Sequence[Sequence[float]], noise: Sequence[float]) -> None:
        """Takes the rows over one interval: h <- h F^-1; `noise` are the variances added to w and q."""
        w, q, theta, zeta = F
        turn = q[Q] * theta[Q + 1] - q[Q + 1] * theta[Q]
        for k in range(len(self._uses)):
            if self._uses[k] == 0:
                continue
            row = self._rows[k]
            # y [F_states] = row_states, with zeta' = ... + 1 zeta, w' free of zeta, (q, theta) a block of its
            # own
            y_zeta = row[ZETA]
            y_w = (row[W] - y_zeta * zeta[W]) / w[W]
            rest_q = row[Q] - y_w * w[Q] - y_zeta * zeta[Q]
            rest_theta = row[Q + 1] - y_w * w[Q + 1] - y_zeta * zeta[Q + 1]
            y_q = (rest_q * theta[Q + 1] - rest_theta * theta[Q]) / turn
            y_theta = (rest_theta * q[Q] - rest_q * q[Q + 1]) / turn
            for j in range(PARAMETERS):
                row[j] -= y_w * w[j] + y_q * q[j] + y_theta * theta[j] + y_zeta * zeta[j]
            row[W] = y_w
            row[Q] = y_q
            row[Q + 1] = y_theta
            self._variances[k] += y_w * y_w * noise[0] + y_q * y_q * noise[1]

    def learn(self, ud: UdFactors) -> None:
        """Uses every earlier sample once more. Comes before the samples of this instant."""
        self._before[:] = ud.x
        for k in range(len(self._uses)):
            if self._uses[k] > 0:
                ud.observe(self._rows[k], self._residual(k, ud), self._variances[k] * self.p)
                self._uses[k] += 1

    def add(self, index: int, residual: float, variance: float) -> None:
        """Takes a sample of x[index], used once; `residual` against x as it was when `learn` was called."""
        for k in range(len(self._uses)):
            if self._uses[k] == 0:
                row = self._rows[k]
                for j in range(COUNT):
                    row[j] = 0.0
                row[index] = 1.0
                self._residuals[k] = residual
                self._variances[k] = variance
                self._uses[k] = 1
                return

    def settle(self, ud: UdFactors) -> None:
        """Ends the instant: residuals against x as it is now; samples used p times leave."""
        for k in range(len(self._uses)):
            if self._uses[k] > 0:
                self._residuals[k] = self._residual(k, ud)
                if self._uses[k] >= self.p:
                    self._uses[k] = 0

    def before(self, index: int) -> float:
        """x[index] as it was when `learn` was called."""
        return self._before[index]

    def _residual(self, k: int, ud: UdFactors) -> float:
        total = self._residuals[k]
        row = self._rows[k]
        for i in range(COUNT):
            total -= row[i] * (ud.x[i] - self._before[i])
        return total
