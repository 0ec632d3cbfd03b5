"""Mean x and covariance P = L D L^T of an estimate, L unit lower triangular, D >= 0 and diagonal.

P cannot become indefinite, whatever the rounding. This is Bierman's U D U^T seen in a mirror: the entries
that never move (parameters) come first, so a time update leaves their rows of L alone.

Sources: G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, ch. V (scalar update)
and C. L. Thornton, JPL TM 33-798, 1976 (modified weighted Gram-Schmidt); P. E. Gill, G. H. Golub, W. Murray
and M. A. Saunders, Math. Comp. 28, 1974, method C1 (rank-one addition).
"""

from collections.abc import Sequence

Row = Sequence[float]


class UdFactors:
    """The factors of n entries, of which the last m move.

    x  (n)     mean
    L  [j][i]  column j of the factor, ones on and zeros above the diagonal included
    D  (n)     an entry with D = 0 from the start is known exactly and never changes

    pattern    for each of the m moving entries, the columns of its transition row that are not always zero
    driven     which of the m moving entries are driven by noise
    """

    def __init__(self, n: int, pattern: Sequence[Sequence[int]], driven: Sequence[int]) -> None:
        m = len(pattern)
        self.n = n
        self.x = [0.0] * n
        self.D = [0.0] * n
        self.L = [[float(i == j) for i in range(n)] for j in range(n)]
        self._first = n - m
        self._driven = tuple(driven)
        # Columns beyond j that add to entry (i, j) of the product of a transition row and L.
        self._beyond = tuple(
            tuple(tuple(k for k in columns if k > j) for j in range(n)) for columns in pattern
        )
        self._W = [[0.0] * (n + len(driven)) for _ in range(m)]
        self._weights = [0.0] * (m + len(driven))
        self._f = [0.0] * n
        self._v = [0.0] * n
        self._gain = [0.0] * n
        self._unit = [0.0] * n
        self._good_x = [0.0] * n
        self._good_D = [0.0] * n
        self._good_L = [[0.0] * n for _ in range(n)]

    def covariance(self, i: int, j: int) -> float:
        """P[i, j]."""
        total = 0.0
        for k in range((i if i < j else j) + 1):
            column = self.L[k]
            total += column[i] * self.D[k] * column[j]
        return total

    def spread(self, h: Row) -> float:
        """h P h^T for a row of n."""
        total = 0.0
        for j in range(self.n):
            column = self.L[j]
            part = 0.0
            for i in range(j, self.n):
                part += h[i] * column[i]
            total += part * part * self.D[j]
        return total

    def observe(self, h: Row, error: float, variance: float) -> None:
        """Learns a scalar y = h x + noise; `error` is y - h x, `variance` (above 0) that of the noise."""
        for j in range(self.n):
            column = self.L[j]
            part = 0.0
            for i in range(j, self.n):
                part += h[i] * column[i]
            self._f[j] = part
        self._learn(self.n, error, variance)

    def observe_entry(self, index: int, error: float, variance: float) -> None:
        """`observe` where y measures x[index] itself."""
        for j in range(index + 1):
            self._f[j] = self.L[j][index]
        self._learn(index + 1, error, variance)

    def _learn(self, count: int, error: float, variance: float) -> None:
        """Bierman's update with f = L^T h in place, of which the first `count` may differ from zero."""
        n, f, v, gain, D = self.n, self._f, self._v, self._gain, self.D
        for i in range(n):
            gain[i] = 0.0
        for j in range(count):
            v[j] = D[j] * f[j]
        before = variance
        for j in range(count - 1, -1, -1):
            after = before + f[j] * v[j]
            D[j] *= before / after
            down = -f[j] / before
            add = v[j]
            column = self.L[j]
            for i in range(j + 1, n):
                entry = column[i]
                column[i] = entry + gain[i] * down
                gain[i] += add * entry
            gain[j] = add
            before = after
        scale = error / before
        for i in range(n):
            self.x[i] += gain[i] * scale

    def add(self, w: list[float], variance: float) -> None:
        """P <- P + variance w w^T; w (n) is used up."""
        for j in range(self.n):
            p = w[j]
            grown = self.D[j] + variance * p * p
            if p == 0.0 or not grown > 0.0:
                continue
            ratio = p * variance / grown
            variance *= self.D[j] / grown
            self.D[j] = grown
            column = self.L[j]
            for i in range(j + 1, self.n):
                w[i] -= p * column[i]
                column[i] += ratio * w[i]

    def move(self, F: Sequence[Row], noise: Row) -> None:
        """P <- [I; F] P [I; F]^T + noise, for transition rows F (m, n) of the moving entries; x is not
        touched.

        noise  variances, one for each driven entry
        """
        n, first, W, weights, D = self.n, self._first, self._W, self._weights, self.D
        m = n - first
        for i in range(m):
            row, product, beyond = F[i], W[i], self._beyond[i]
            for j in range(n):
                column = self.L[j]
                total = row[j]
                for k in beyond[j]:
                    total += row[k] * column[k]
                product[j] = total
            for k in range(len(noise)):
                product[n + k] = 1.0 if i == self._driven[k] else 0.0
        for j in range(first):
            column = self.L[j]
            for i in range(m):
                column[first + i] = W[i][j]
        for j in range(m):
            weights[j] = D[first + j]
        for k in range(len(noise)):
            weights[m + k] = noise[k]
        self._orthogonalise(m, m + len(noise))

    def _orthogonalise(self, m: int, width: int) -> None:
        """L and D of the moving entries from the rows W, weighted (modified weighted Gram-Schmidt)."""
        first, W, weights = self._first, self._W, self._weights
        for i in range(m):
            row = W[i]
            size = 0.0
            for k in range(width):
                size += row[first + k] * row[first + k] * weights[k]
            self.D[first + i] = size
            column = self.L[first + i]
            for r in range(i + 1, m):
                other = W[r]
                product = 0.0
                for k in range(width):
                    product += other[first + k] * row[first + k] * weights[k]
                share = product / size if size > 0.0 else 0.0
                column[first + r] = share
                for k in range(width):
                    other[first + k] -= share * row[first + k]

    def forget(self, index: int, mean: float, variance: float) -> None:
        """Makes a moving entry unknown: independent of all before it, with this mean and variance.

        Entries after it keep what they owe to it, so forget them first where that matters.
        """
        for j in range(index):
            self.L[j][index] = 0.0
        self.x[index] = mean
        self.D[index] = variance

    def save(self) -> None:
        """Remembers x and P for `rollback`."""
        self._good_x[:] = self.x
        self._good_D[:] = self.D
        for j in range(self.n):
            self._good_L[j][:] = self.L[j]

    def rollback(self) -> None:
        """x and P as at the last `save`."""
        self.x[:] = self._good_x
        self.D[:] = self._good_D
        for j in range(self.n):
            self.L[j][:] = self._good_L[j]

    @property
    def is_finite(self) -> bool:
        """Whether no entry of x, L and D is infinite or NaN."""
        total = 0.0
        for j in range(self.n):
            total += (self.x[j] - self.x[j]) + (self.D[j] - self.D[j])
            column = self.L[j]
            for i in range(j + 1, self.n):
                total += column[i] - column[i]
        return total == 0.0
