"""What drifts in a sensor beside its white noise, and how to whiten what a free run leaves of it.

    e = n + c + d + white noise, for depth; c + white noise for pitch, with
    n(k+1) = n(k) - theta_k h_k v(k),  v(k+1) = a v(k) + ...     errors of the speed (host.noise.speed_error)
    c(t+h) = exp(-h / T) c(t) + ...                              the sensor's own error wanders
    d' = g,  g(t+h) = exp(-h / T_g) g(t) + ...                   water that rises and sinks at random

A vehicle moves with water that changes slowly, so a vertical current adds to depth and does nothing else. A
Kalman filter for these states in the residual whitens it, and its sensitivities: generalised least squares
(Durbin, Biometrika 47, 1960). It depends on the recording alone, not on the parameters, so that sets of
effects are compared as quickly as under white noise. d and g as in Singer, IEEE AES-6(4), 1970.
"""

from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from host.compiled.linear_filter import linear_filter
from host.compiled.over_rows import over_rows
from host.recordings.recording import Array, Recording

NOTHING = (0.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Drift:
    """What drifts in one channel over N rows, variances in units of the channel's white noise.

    present   (N,) whether it was measured
    interval  (N,) s to the next row
    wander    variance and time constant s of the sensor's own error c
    current   variance per s^2 and time constant s of the water's velocity g
    leverage  (N,) theta h, by which n loses v from row to row
    speed     variance and decay from row to row of v
    """

    present: Array
    interval: Array
    wander: tuple[float, float] = NOTHING
    current: tuple[float, float] = NOTHING
    leverage: Array = field(default_factory=lambda: np.zeros(0))
    speed: tuple[float, float] = NOTHING

    @property
    def kinds(self) -> tuple[str, ...]:
        """Of what drifts at all."""
        return tuple(kind for kind in ("speed", "wander", "current") if getattr(self, kind)[0] > 0.0)


class Whitening:
    """The filter over one channel's residuals.

    seen    (nx,) 1 for a state that shows in the channel
    spread  (N,) innovation variance over that of white noise, 1 where nothing was measured
    doubt   (N,) the same everywhere, of what a measurement would bring
    """

    def __init__(self, drift: Drift) -> None:
        kinds = drift.kinds
        self.seen = _seen(kinds)
        table = _filtered(drift, np.zeros(drift.present.size))
        self.spread, self.doubt = table[1:3]
        self._deviation = np.sqrt(self.spread)
        moves, K = _moves(drift), table[3:].T[:, :, None]
        self._closed, self._driven = moves @ (np.eye(self.seen.size) - K * self.seen), (moves @ K)[:, :, 0]

    @property
    def charge(self) -> float:
        """By how much the spread lowers the log-likelihood."""
        return 0.5 * float(np.sum(np.log(self.spread)))

    def whitened(self, values: Array) -> Array:
        """Residuals or sensitivities (c, N), filtered; white residuals keep the sensor's variance."""
        foreseen = self.foreseen(values)
        np.subtract(values, foreseen, out=foreseen)
        foreseen /= self._deviation
        return foreseen

    def foreseen(self, values: Array) -> Array:
        """What the filter expects of each row of (c, N) values before it: x(k+1) = A_k (x + K (y - C x))."""
        # A trial may run away: what is infinite is refused by its likelihood.
        with np.errstate(invalid="ignore", over="ignore"):
            return linear_filter(self._closed, self._driven, self.seen, values)


Whitenings = tuple[Whitening | None, Whitening | None]
"""Of pitch and of depth; None where all of the noise is white."""
NOT_WHITENED: Whitenings = (None, None)


def whitenings(pitch: Drift | None, depth: Drift | None) -> Whitenings:
    """The filters of both channels, None where nothing drifts."""
    return _whitening(pitch), _whitening(depth)


def _whitening(drift: Drift | None) -> Whitening | None:
    return None if drift is None or not drift.kinds else Whitening(drift)


def log_likelihood(drifts: list[Drift], residuals: list[Array]) -> float:
    """Of a channel's residuals (N,) in recordings, the variance of its white noise at the likeliest value."""
    squares = logarithms = count = 0.0
    for drift, residual in zip(drifts, residuals, strict=True):
        error, spread = _filtered(drift, residual)[:2]
        squares += float(np.sum(error**2 / spread))
        logarithms += float(np.sum(np.log(spread)))
        count += float(drift.present.sum())
    return float(-0.5 * (count * np.log(max(squares / count, 1e-12)) + logarithms))


def drifting_speed(recording: Recording, variance: float, decay: float) -> Drift:
    """The drift of depth by errors of the measured speed, their variance in units of depth's white noise."""
    known = np.isfinite(recording.pitch)
    pitch = np.interp(recording.time, recording.time[known], recording.pitch[known])
    return Drift(
        present=np.isfinite(recording.depth).astype(float),
        interval=recording.intervals,
        leverage=pitch * recording.intervals,
        speed=(variance, decay),
    )


def drifts_of(recording: Recording, by_speed: Drift | None, levels: Array) -> tuple[Drift, Drift]:
    """What drifts in pitch and in depth of a recording.

    by_speed  the drift of depth by errors of the measured speed, if any
    levels    variances and time constants of pitch, depth and current (3, 2), in units of the white noise
    """
    pitch, depth, current = ((float(variance), float(time)) for variance, time in levels)
    bare = [
        Drift(present=np.isfinite(values).astype(float), interval=recording.intervals)
        for values in (recording.pitch, recording.depth)
    ]
    if by_speed is not None:
        bare[1] = replace(bare[1], leverage=by_speed.leverage, speed=by_speed.speed)
    return replace(bare[0], wander=pitch), replace(bare[1], wander=depth, current=current)


def _filtered(drift: Drift, residual: Array) -> Array:
    """Innovations, their variances with and without regard to what was measured, and gains, (3 + nx, N)."""
    kinds = drift.kinds
    rows, states = residual.size, _states(kinds)
    leverage = drift.leverage if drift.leverage.size else np.zeros(rows)
    start = np.zeros((states, states))
    for kind, first in _first(kinds).items():
        own = first + (kind != "wander")  # n and d begin at nothing: the initial depth is estimated
        start[own, own] = getattr(drift, kind)[0]
    carried = np.concatenate([np.zeros(states), start[np.tri(states, dtype=bool).T]])
    per_row = np.vstack([drift.present, drift.interval, leverage, residual])
    levels = np.array([value for kind in kinds for value in getattr(drift, kind)])
    return over_rows(_filter, kinds, rows)(carried, per_row, levels)


def _filter(kinds: tuple[str, ...]) -> ca.Function:
    """One row of the Kalman filter: (states and covariance, row, levels) -> (the next, results)."""
    nx = _states(kinds)
    x, lower = ca.SX.sym("x", nx), ca.Sparsity.lower(nx)
    P = ca.tril2symm(ca.SX.sym("P", lower))
    row, levels = ca.SX.sym("row", 4), ca.SX.sym("levels", 2 * len(kinds))
    present, interval, leverage, value = ca.vertsplit(row)
    A, Q = ca.SX.eye(nx), ca.SX(nx, nx)
    for kind, first in _first(kinds).items():
        variance, time = levels[2 * kinds.index(kind)], levels[2 * kinds.index(kind) + 1]
        own = slice(first, first + 1 + (kind != "wander"))
        A[own, own], Q[own, own] = _step(kind, variance, time, interval, leverage)
    seen = ca.SX(_seen(kinds)).T
    C, doubt = present * seen, seen @ P @ seen.T + 1
    S = present * (doubt - 1) + 1
    K = P @ C.T / S
    error = present * value - C @ x
    P_next = A @ (P - K @ K.T * S) @ A.T + Q
    kept = ca.vertcat(*(P_next[i, j] for i, j in zip(*lower.get_triplet(), strict=True)))
    carried = ca.vertcat(x, ca.vertcat(*(P[i, j] for i, j in zip(*lower.get_triplet(), strict=True))))
    carried_on, results = ca.vertcat(A @ (x + K * error), kept), ca.vertcat(error, S, doubt, K)
    return ca.Function("drift", [carried, row, levels], [carried_on, results])


def _step(kind: str, variance: ca.SX, time: ca.SX, interval: ca.SX, leverage: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Transition and covariance of the noise of one kind's states over a row."""
    if kind == "speed":
        noise = (1 - time**2) * variance
        return ca.vertcat(ca.horzcat(1, -leverage), ca.horzcat(0, time)), ca.diag(ca.vertcat(0, noise))
    a = ca.exp(-interval / time)
    if kind == "wander":
        return a, (1 - a**2) * variance
    moved = variance * time**2 * (2 * interval / time - 3 + 4 * a - a**2)
    both = variance * time * (1 - a) ** 2
    transition = ca.vertcat(ca.horzcat(1, time * (1 - a)), ca.horzcat(0, a))
    return transition, ca.vertcat(ca.horzcat(moved, both), ca.horzcat(both, variance * (1 - a**2)))


def _moves(drift: Drift) -> Array:
    """(N, nx, nx), as `_step` has them."""
    rows, kinds = drift.interval.size, drift.kinds
    moves = np.tile(np.eye(_states(kinds)), (rows, 1, 1))
    for kind, k in _first(kinds).items():
        time = getattr(drift, kind)[1]
        if kind == "speed":
            moves[:, k, k + 1], moves[:, k + 1, k + 1] = -drift.leverage, time
            continue
        a = np.exp(-drift.interval / time)
        if kind == "wander":
            moves[:, k, k] = a
        else:
            moves[:, k, k + 1], moves[:, k + 1, k + 1] = time * (1.0 - a), a
    return moves


def _first(kinds: tuple[str, ...]) -> dict[str, int]:
    """The first state of each kind; n and d come before what drives them."""
    places, count = {}, 0
    for kind in kinds:
        places[kind] = count
        count += 1 if kind == "wander" else 2
    return places


def _states(kinds: tuple[str, ...]) -> int:
    return sum(1 if kind == "wander" else 2 for kind in kinds)


def _seen(kinds: tuple[str, ...]) -> Array:
    seen = np.zeros(_states(kinds))
    seen[list(_first(kinds).values())] = 1.0
    return seen
