"""A second, independent form of the estimator: Bierman's UD factors, P = U D U^T, one row at a time.

G. J. Bierman, "Factorization Methods for Discrete Sequential Estimation", 1977, chapter V. A block step over
p rows equals p scalar updates with unit weight on each row, then one division of D by the forgetting factor.
"""

import numpy as np


class UdReference:
    def __init__(self, n, p, forgetting, p0):
        self.p = p
        self.forgetting = forgetting
        self.theta = np.full(n, 1.0 / p0)
        self.U = np.eye(n)
        self.D = np.full(n, p0)
        self.window = []

    def update(self, phi, y):
        self.window = [(np.array(phi, dtype=float), float(y)), *self.window][: self.p]
        for row, output in self.window:
            self._scalar_update(row, output)
        self.D = self.D / self.forgetting

    def _scalar_update(self, phi, y):
        # The rows' noise has the variance `forgetting`, as in S = forgetting I + Phi^T P Phi.
        n = len(phi)
        f = phi @ self.U
        v = self.D * f
        alpha = self.forgetting
        gain = np.zeros(n)
        innovation = y - phi @ self.theta
        for j in range(n):
            before = alpha
            alpha = before + f[j] * v[j]
            column = self.U[:, j].copy()
            self.D[j] = self.D[j] * before / alpha
            self.U[:, j] = column - f[j] / before * gain
            gain = gain + v[j] * column
        self.theta = self.theta + gain / alpha * innovation

    @property
    def covariance(self):
        return (self.U * self.D) @ self.U.T
