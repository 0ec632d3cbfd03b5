"""One block step of least squares on a square root of the covariance, as plain scalar loops.

The loops run in a fixed order over lists that the constructor allocates, so the same loops in C, with fused
multiply-add switched off, give the same bits.
"""

import math
from collections.abc import Callable
from typing import Any


class SquareRootStep:
    """theta and G with P = G G^T, and the step that takes in a block of rows.

    With Phi the n x m matrix of the rows, E their innovations and f the forgetting factor:

        F = G^T Phi        S = f I + F^T F = C C^T  (Cholesky in place, m x m)
        theta <- theta + G F S^-1 E
        G <- G [I - F C^-T (C + sqrt(f) I)^-1 F^T] / sqrt(f)

    which is P <- (P - P Phi S^-1 Phi^T P)/f (Andrews, "A square root formulation of the Kalman covariance
    equations", AIAA J. 6, 1968). P is a square by construction and cannot lose its sign by rounding.

    `propose` computes a step into scratch, `commit` makes it the state.

    n     parameters
    p     rows in a step, at most
    real  the type of every number
    """

    def __init__(self, n: int, p: int, real: Callable[[float], Any]) -> None:
        self._n = n
        self._p = p
        self._real = real
        self._zero = real(0.0)
        self.theta: list[float] = [self._zero] * n
        self.G: list[float] = [self._zero] * (n * n)
        """Row-major."""
        self.largest: float = self._zero
        """The largest P_ii."""
        self.innovation: float = self._zero
        """y - phi^T theta of the newest row of the step proposed."""
        self.spread: float = self._zero
        """phi^T P phi of the newest row of the step proposed."""
        self._next_theta: list[float] = [self._zero] * n
        self._next_G: list[float] = [self._zero] * (n * n)
        self._next_largest: float = self._zero
        self._E: list[float] = [self._zero] * p
        self._F: list[float] = [self._zero] * (p * n)  # column j of the n x m matrices lies at j n
        self._K: list[float] = [self._zero] * (p * n)
        self._B: list[float] = [self._zero] * (p * n)
        self._C: list[float] = [self._zero] * (p * p)

    def set_prior(self, p0: float) -> None:
        """theta = 1/p0, P = p0 I."""
        n = self._n
        for i in range(n):
            self.theta[i] = self._real(1.0 / p0)
            for k in range(n):
                self.G[i * n + k] = self._real(math.sqrt(p0)) if i == k else self._zero
        self.refresh()

    def refresh(self) -> None:
        """Recomputes `largest` after a change of G."""
        self.largest = self._largest_variance(self.G)

    def propose(
        self, rows: list[float], outputs: list[float], slots: list[int], count: int, forgetting: float
    ) -> bool:
        """Computes the step; False if any number of it is not finite.

        rows, outputs  phi (n numbers a slot) and y by slot
        slots, count   the slots of the rows to use, newest first, and their number m
        """
        root = self._real(math.sqrt(forgetting))
        self._project(rows, outputs, slots, count)
        if not self._factor(count, forgetting):
            return False
        self._solve(count, root)
        self._combine(count, root)
        self._next_largest = self._largest_variance(self._next_G)
        check = self._next_largest
        for i in range(self._n):
            check = check + abs(self._next_theta[i])
        return check < math.inf

    def commit(self) -> None:
        """Makes the step proposed the state."""
        for i in range(self._n):
            self.theta[i] = self._next_theta[i]
        for i in range(self._n * self._n):
            self.G[i] = self._next_G[i]
        self.largest = self._next_largest

    def _project(self, rows: list[float], outputs: list[float], slots: list[int], count: int) -> None:
        """E, F = G^T Phi and K = G F."""
        n, zero = self._n, self._zero
        G, F, K, theta = self.G, self._F, self._K, self.theta
        size = range(n)
        for j in range(count):
            row = slots[j] * n
            col = j * n
            total = outputs[slots[j]]
            for i in size:
                total = total - rows[row + i] * theta[i]
            self._E[j] = total
            for i in size:
                total = zero
                at = i
                for k in size:
                    total = total + G[at] * rows[row + k]
                    at += n
                F[col + i] = total
            for i in size:
                total = zero
                at = i * n
                for k in size:
                    total = total + G[at + k] * F[col + k]
                K[col + i] = total
        total = zero
        for i in size:
            total = total + F[i] * F[i]
        self.spread = total
        self.innovation = self._E[0]

    def _factor(self, count: int, forgetting: float) -> bool:
        """C C^T = forgetting I + F^T F; False if a pivot is not a positive number."""
        n, p, zero = self._n, self._p, self._zero
        F, C = self._F, self._C
        size = range(n)
        for j in range(count):
            a = j * n
            row = j * p
            for i in range(j + 1):
                b = i * n
                other = i * p
                total = forgetting if i == j else zero
                for k in size:
                    total = total + F[a + k] * F[b + k]
                for k in range(i):
                    total = total - C[row + k] * C[other + k]
                if i < j:
                    C[row + i] = total / C[other + i]
                elif zero < total < math.inf:
                    C[row + j] = self._real(math.sqrt(total))
                else:
                    return False
        return True

    def _solve(self, count: int, root: float) -> None:
        """E <- S^-1 E and B = C^-T (C + root I)^-1 F^T, by triangular solves."""
        n, p = self._n, self._p
        F, C, B, E = self._F, self._C, self._B, self._E
        size = range(n)
        for j in range(count):
            row = j * p
            col = j * n
            total = E[j]
            for k in range(j):
                total = total - C[row + k] * E[k]
            E[j] = total / C[row + j]
            pivot = C[row + j] + root
            for i in size:
                total = F[col + i]
                at = i
                for k in range(j):
                    total = total - C[row + k] * B[at]
                    at += n
                B[col + i] = total / pivot
        for j in range(count - 1, -1, -1):
            col = j * n
            pivot = C[j * p + j]
            total = E[j]
            for k in range(j + 1, count):
                total = total - C[k * p + j] * E[k]
            E[j] = total / pivot
            for i in size:
                total = B[col + i]
                for k in range(j + 1, count):
                    total = total - C[k * p + j] * B[k * n + i]
                B[col + i] = total / pivot

    def _combine(self, count: int, root: float) -> None:
        """theta + K S^-1 E and (G - K B)/root, into scratch."""
        n = self._n
        G, K, B, E = self.G, self._K, self._B, self._E
        window = range(count)
        for i in range(n):
            total = self.theta[i]
            for j in window:
                total = total + K[j * n + i] * E[j]
            self._next_theta[i] = total
            for k in range(n):
                total = G[i * n + k]
                a = i
                b = k
                for _ in window:
                    total = total - K[a] * B[b]
                    a += n
                    b += n
                self._next_G[i * n + k] = total / root

    def _largest_variance(self, G: list[float]) -> float:
        """The largest P_ii = sum_k G_ik^2; nan or inf if any entry of G is not finite."""
        n = self._n
        largest: float = self._zero
        for i in range(n):
            total: float = self._zero
            for k in range(n):
                total = total + G[i * n + k] * G[i * n + k]
            if not total < math.inf:
                return total
            if total > largest:
                largest = total
        return largest
