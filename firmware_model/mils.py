"""Multi-innovation least squares of fixed size: the window of rows around the square-root step.

The work of an update is plain scalar loops over lists that the constructor allocates; NumPy serves the
read-outs only.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_model.square_root import SquareRootStep
from firmware_model.state import count_of, finite_numbers, require
from firmware_model.status import Status

SCHEMA = 1


class Mils:
    """Recursive least squares over the last p regression rows at once; p = 1 is ordinary RLS.

        L = P Phi (forgetting I + Phi^T P Phi)^-1
        theta <- theta + L E
        P <- (P - L Phi^T P)/forgetting

    after Yuan et al., J. Mar. Sci. Eng. 2025, 13, 1489; P is kept as a square root, see `SquareRootStep`.

    Each row takes part in p steps, so P is too small as a covariance: in a weighted fit whose rows have the
    weights w the parameter errors have the covariance sigma^2 kappa P, kappa = sum w^2 / sum w, for steady
    excitation. kappa is tracked exactly; it tends to p without forgetting, to 1/(1 + forgetting) for p = 1.

    n           parameters
    p           innovation length, rows used in each step (fewer until p rows came)
    forgetting  weight that a step leaves to all earlier ones, in (0, 1]
    p0          P(0) = p0 I; theta(0) = 1/p0
    cap         largest P_ii that forgetting may lead to (default p0, inf for none); a step that could pass it
                forgets nothing, so signals at rest cannot wind P up
    real        float, or numpy.float32 to see single precision at work
    """

    def __init__(
        self,
        n: int,
        p: int = 1,
        forgetting: float = 1.0,
        p0: float = 1e6,
        *,
        cap: float | None = None,
        real: Callable[[float], Any] = float,
    ) -> None:
        cap = p0 if cap is None else cap
        require(n >= 1, "n must be at least 1", n)
        require(p >= 1, "p must be at least 1", p)
        require(0.0 < forgetting <= 1.0, "forgetting must be in (0, 1]", forgetting)
        require(0.0 < p0 < math.inf, "p0 must be positive and finite", p0)
        require(cap > 0.0, "cap must be positive", cap)
        self.n = n
        self.p = p
        self._p0 = p0
        self._real = real
        self._zero: float = real(0.0)
        self._one: float = real(1.0)
        self._forgetting: float = real(forgetting)
        self._cap: float = real(cap)
        self._step = SquareRootStep(n, p, real)
        # One slot more than the window has: a row is committed by moving the head onto it.
        self._rows: list[float] = [self._zero] * ((p + 1) * n)
        self._outputs: list[float] = [self._zero] * (p + 1)
        self._weights: list[float] = [self._zero] * (p + 1)
        self._slots = [0] * p
        self.reset()

    def reset(self) -> None:
        """Forgets everything learnt: the estimator is as constructed."""
        self._step.set_prior(self._p0)
        self._head = 0
        self._count = 0
        self._weight = self._zero  # sum of w over all rows seen
        self._weight_squared = self._zero  # sum of w^2
        self._misfit = self._zero  # weighted squares of the innovations, and the degrees of freedom they hold
        self._freedom = self._zero
        self._innovation = self._zero
        self._updates = 0

    def update(self, phi: Sequence[float], y: float) -> Status:
        """One step with the row y = phi^T theta added to the window. Only UPDATED and CAPPED change anything.

        REFUSED_NON_FINITE: phi or y is not finite, or phi has not n entries. FAULT_NUMERICAL: overflow.
        """
        if self._real is float:
            return self._update(phi, y)
        with np.errstate(all="ignore"):  # NumPy scalars warn where plain ones quietly give inf
            return self._update(phi, y)

    def _update(self, phi: Sequence[float], y: float) -> Status:
        slot = self._head + 1 if self._head < self.p else 0
        if not self._place(slot, phi, y):
            return Status.REFUSED_NON_FINITE
        count = self._count + 1 if self._count < self.p else self.p
        for j in range(count):
            self._slots[j] = slot - j if slot >= j else slot - j + self.p + 1
        forgets = self._forgetting < self._one
        is_capped = forgets and self._step.largest > self._cap * self._forgetting
        forgetting = self._one if is_capped else self._forgetting
        if not self._step.propose(self._rows, self._outputs, self._slots, count, forgetting):
            return Status.FAULT_NUMERICAL
        innovation = self._step.innovation
        surprise = self._one + self.reuse * self._step.spread
        misfit = forgetting * self._misfit + (innovation / surprise) * (innovation / surprise)
        if not misfit < math.inf:
            return Status.FAULT_NUMERICAL

        self._step.commit()
        self._misfit = misfit
        self._freedom = forgetting * self._freedom + self._one / surprise
        self._innovation = innovation
        self._head = slot
        self._count = count
        self._weigh(count, forgetting)
        self._updates += 1
        return Status.CAPPED if is_capped else Status.UPDATED

    def _place(self, slot: int, phi: Sequence[float], y: float) -> bool:
        """Puts a row into the free slot; False if it is not finite."""
        if len(phi) != self.n:
            return False
        real = self._real
        check = self._outputs[slot] = real(y)
        check = check - check
        for i in range(self.n):
            value = self._rows[slot * self.n + i] = real(phi[i])
            check = check + (value - value)
        return bool(check == self._zero)

    def _weigh(self, count: int, forgetting: float) -> None:
        """Carries sum w and sum w^2 over one step: every weight fades, those of the window's rows gain 1."""
        window = self._zero
        fade = forgetting
        for j in range(count):
            slot = self._slots[j]
            before = self._weights[slot] * fade if j > 0 else self._zero
            window = window + before
            self._weights[slot] = before + self._one
        self._weight = fade * self._weight + self._real(count)
        self._weight_squared = fade * fade * self._weight_squared + (window + window) + self._real(count)

    def predict(self, phi: Sequence[float]) -> float:
        """phi^T theta."""
        total = self._zero
        for i in range(self.n):
            total = total + self._real(phi[i]) * self._step.theta[i]
        return float(total)

    def innovation_std(self, phi: Sequence[float]) -> float:
        """Standard deviation to expect of y - phi^T theta: noise and parameter errors together."""
        n = self.n
        spread = self._zero
        for i in range(n):
            total = self._zero
            for k in range(n):
                total = total + self._step.G[k * n + i] * self._real(phi[k])
            spread = spread + total * total
        return math.sqrt(self.noise_variance * (1.0 + float(self.reuse * spread)))

    @property
    def theta(self) -> tuple[float, ...]:
        """The parameter estimates (n)."""
        return tuple(float(value) for value in self._step.theta)

    @property
    def updates(self) -> int:
        """Steps committed since the last reset."""
        return self._updates

    @property
    def innovation(self) -> float:
        """y - phi^T theta of the newest row, before it was learnt."""
        return float(self._innovation)

    @property
    def reuse(self) -> float:
        """kappa = sum w^2 / sum w: what P must be multiplied by because rows are used more than once."""
        return self._weight_squared / self._weight if self._weight > self._zero else self._one

    @property
    def noise_variance(self) -> float:
        """Variance of the rows' noise, from a-priori innovations weighted by what they can tell about it."""
        return float(self._misfit / self._freedom) if self._freedom > self._zero else math.inf

    @property
    def covariance(self) -> NDArray[np.float64]:
        """P (n x n) of the algorithm; see `error_covariance` for the uncertainty of theta."""
        G = np.array(self._step.G, dtype=np.float64).reshape(self.n, self.n)
        return G @ G.T

    @property
    def error_covariance(self) -> NDArray[np.float64]:
        """Covariance of theta (n x n): noise_variance * reuse * P, with white noise in the rows."""
        if self._updates == 0:
            return np.full((self.n, self.n), math.inf)
        return self.noise_variance * float(self.reuse) * self.covariance

    @property
    def std(self) -> tuple[float, ...]:
        """Standard deviations of theta (n)."""
        return tuple(math.sqrt(value) for value in np.diag(self.error_covariance))

    def state(self) -> dict[str, Any]:
        """Everything learnt, as plain lists: an estimator that restores it goes on with the same bits."""
        newest_first = [(self._head - j) % (self.p + 1) for j in range(self._count)]
        oldest_first = newest_first[::-1]
        n = self.n
        return {
            "schema": SCHEMA,
            "n": n,
            "p": self.p,
            "theta": [float(value) for value in self._step.theta],
            "root": [float(value) for value in self._step.G],
            "rows": [float(value) for slot in oldest_first for value in self._rows[slot * n : slot * n + n]],
            "outputs": [float(self._outputs[slot]) for slot in oldest_first],
            "weights": [float(self._weights[slot]) for slot in oldest_first],
            "sums": [
                float(value)
                for value in (
                    self._weight,
                    self._weight_squared,
                    self._misfit,
                    self._freedom,
                    self._innovation,
                )
            ],
            "updates": self._updates,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Goes on from a saved state. Raises ValueError, and changes nothing, if it does not fit."""
        for name, mine in (("schema", SCHEMA), ("n", self.n), ("p", self.p)):
            require(state.get(name) == mine, f"state.{name} must be {mine}", state.get(name))
        n = self.n
        theta = finite_numbers(state, "theta", n)
        root = finite_numbers(state, "root", n * n)
        outputs = finite_numbers(state, "outputs", None)
        count = len(outputs)
        require(count <= self.p, f"state.outputs must hold at most {self.p} numbers", count)
        rows = finite_numbers(state, "rows", count * n)
        weights = finite_numbers(state, "weights", count)
        sums = finite_numbers(state, "sums", 5)
        updates = count_of(state, "updates")
        require(min(sums[:4]) >= 0.0, "state.sums must not be negative", min(sums[:4]))
        singular = not all(any(root[i * n : i * n + n]) for i in range(n))
        require(not singular, "state.root must not be singular", "a zero row")
        real = self._real
        self._step.theta[:] = [real(value) for value in theta]
        self._step.G[:] = [real(value) for value in root]
        self._step.refresh()
        self._rows[: n * count] = [real(value) for value in rows]
        self._outputs[:count] = [real(value) for value in outputs]
        self._weights[:count] = [real(value) for value in weights]
        self._head = count - 1 if count > 0 else 0
        self._count = count
        sums_real = [real(value) for value in sums]
        self._weight, self._weight_squared, self._misfit, self._freedom, self._innovation = sums_real
        self._updates = updates
