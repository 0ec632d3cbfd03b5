"""The equations over one interval in which plane and speed are held, with exact sensitivities.

    w'     = a1 w + gamma theta - kappa q + b1 delta + f      heave velocity that belongs to the speed u, m/s
    q'     = a2 q + a3 theta + b2 delta + c                   pitch rate, rad/s
    theta' = q
    zeta'  = w - u theta

u is the speed that is known. If it is wrong by kappa, so that u0 = u + kappa, then w - kappa theta obeys the
first line with gamma = a1 kappa; if pitch rate acts on heave (w' = ... + c_wq q), kappa is smaller by c_wq.
With gamma and kappa as two parameters the equations are linear in the state and linear in the parameters. f
and c are the forces of an imperfect trim; offsets of both sensors and of the plane go into them.
"""

from collections.abc import Sequence

A1, A2, A3, B1, B2, KAPPA, GAMMA, HEAVE_TRIM, PITCH_TRIM = range(9)
W, Q, THETA, ZETA = range(9, 13)
COUNT = 13
"""Entries of the extended state: nine parameters, then the four states."""

_IN_PITCH = (A2, A3, B2, PITCH_TRIM, Q, THETA)
_IN_HEAVE = (A1, A2, A3, B1, B2, KAPPA, GAMMA, HEAVE_TRIM, PITCH_TRIM, W, Q, THETA)
PATTERN = (_IN_HEAVE, _IN_PITCH, _IN_PITCH, (*_IN_HEAVE, ZETA))
"""Columns of the four transition rows (w, q, theta, zeta) that are not always zero."""

ORDER = 8
"""Terms of the Taylor series: for modes up to 10 rad/s over 0.1 s the rest is below 3e-6."""


class Propagation:
    """Moves the state over `interval` s: x(t + h) = sum_k h^k/k! x^(k)(t), and F = d x(t + h)/d x(t).

    F  (4, 13) rows of w, q, theta, zeta
    """

    def __init__(self, interval: float) -> None:
        self.F = [[0.0] * COUNT for _ in range(4)]
        self._factors = [1.0]
        for k in range(ORDER):
            self._factors.append(self._factors[k] * interval / (k + 1))
        # Derivatives of the state, and of what drives one sensitivity, by order.
        self._w = [0.0] * ORDER
        self._q = [0.0] * ORDER
        self._theta = [0.0] * ORDER
        self._push = [0.0] * ORDER

    def advance(
        self, x: list[float], rudder: float, speed: float, heave_push: float, pitch_push: float
    ) -> None:
        """Moves x in place and sets F.

        heave_push, pitch_push  m/s^2, rad/s^2: further accelerations, held
        """
        self._advance_state(x, rudder, speed, heave_push, pitch_push)
        F, push = self.F, self._push
        for k in range(ORDER):
            push[k] = self._w[k]
        self._heave_column(x, A1, 0.0)
        for k in range(ORDER):
            push[k] = self._theta[k]
        self._heave_column(x, GAMMA, 0.0)
        self._pitch_column(x, speed, A3, 0.0, 0.0)
        for k in range(ORDER):
            push[k] = self._q[k]
        self._pitch_column(x, speed, A2, 0.0, 0.0)
        for k in range(ORDER):
            push[k] = -self._q[k]
        self._heave_column(x, KAPPA, 0.0)
        for k in range(ORDER):
            push[k] = 1.0 if k == 0 else 0.0
        self._heave_column(x, HEAVE_TRIM, 0.0)
        self._pitch_column(x, speed, PITCH_TRIM, 0.0, 0.0)
        push[0] = 0.0
        self._heave_column(x, W, 1.0)
        self._pitch_column(x, speed, Q, 1.0, 0.0)
        self._pitch_column(x, speed, THETA, 0.0, 1.0)
        for i in range(4):
            F[i][B1] = rudder * F[i][HEAVE_TRIM]
            F[i][B2] = rudder * F[i][PITCH_TRIM]
        F[3][ZETA] = 1.0

    def _advance_state(
        self, x: list[float], rudder: float, speed: float, heave_push: float, pitch_push: float
    ) -> None:
        a1, a2, a3, gamma, kappa = x[A1], x[A2], x[A3], x[GAMMA], x[KAPPA]
        w, q, theta = x[W], x[Q], x[THETA]
        heave = x[B1] * rudder + x[HEAVE_TRIM] + heave_push
        pitch = x[B2] * rudder + x[PITCH_TRIM] + pitch_push
        for k in range(ORDER):
            self._w[k], self._q[k], self._theta[k] = w, q, theta
            climb = w - speed * theta
            w, q, theta = (
                a1 * w + gamma * theta - kappa * q + heave,
                a2 * q + a3 * theta + pitch,
                q,
            )
            heave = pitch = 0.0
            factor = self._factors[k + 1]
            x[W] += factor * w
            x[Q] += factor * q
            x[THETA] += factor * theta
            x[ZETA] += factor * climb

    def _heave_column(self, x: Sequence[float], column: int, w: float) -> None:
        """Column of F for what acts on heave alone: the response to the pushes, from a state w."""
        a1, factors, push = x[A1], self._factors, self._push
        end_w, end_zeta = w, 0.0
        for k in range(ORDER):
            factor = factors[k + 1]
            end_zeta += factor * w
            w = a1 * w + push[k]
            end_w += factor * w
        self.F[0][column] = end_w
        self.F[3][column] = end_zeta

    def _pitch_column(self, x: Sequence[float], speed: float, column: int, q: float, theta: float) -> None:
        """Column of F for what acts on pitch: the response to the pushes, from a state (q, theta)."""
        a1, a2, a3, gamma, kappa = x[A1], x[A2], x[A3], x[GAMMA], x[KAPPA]
        factors, push = self._factors, self._push
        w = 0.0
        end_w, end_q, end_theta, end_zeta = 0.0, q, theta, 0.0
        for k in range(ORDER):
            factor = factors[k + 1]
            end_zeta += factor * (w - speed * theta)
            w = a1 * w + gamma * theta - kappa * q
            rate = a2 * q + a3 * theta + push[k]
            theta = q
            q = rate
            end_w += factor * w
            end_q += factor * q
            end_theta += factor * theta
        F = self.F
        F[0][column] = end_w
        F[1][column] = end_q
        F[2][column] = end_theta
        F[3][column] = end_zeta
