"""The paper's regressions: signals of its own difference equations, their rows, and three ways to solve them.

    y(k) = phi(k)^T theta      phi = [y(k-1) ... , delta(k-2) ...]   (n = 3 for pitch, 7 for depth)

Coefficients are those of the difference equation, with the signs of the paper's tables.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from firmware_model import Mils
from firmware_model.car import DEPTH_LAGS, PITCH_LAGS
from host.recordings.recording import Array

Mask = NDArray[np.bool_]
LAGS = {"alpha": PITCH_LAGS, "beta": DEPTH_LAGS}
P0 = 1e6


def respond(truth: Array, rudder: Array, noise: Array | None = None) -> Array:
    """Output from rest of the difference equation with coefficients `truth`; `noise` enters the equation."""
    outputs = 2 if truth.size == 3 else 4
    denominator = np.concatenate([[1.0], -truth[:outputs]])
    driven = lfilter(np.concatenate([[0.0, 0.0], truth[outputs:]]), denominator, rudder)
    return np.asarray(driven if noise is None else driven + lfilter([1.0], denominator, noise))


@dataclass(frozen=True, slots=True)
class Rows:
    """Regressors phi (N, n), outputs y (N,), and the index k of each row."""

    phi: Array
    y: Array
    k: NDArray[np.int64]

    def first(self, count: int) -> "Rows":
        return Rows(self.phi[:count], self.y[:count], self.k[:count])


def rows_of(channel: str, output: Array, rudder: Array) -> Rows:
    """Every complete row of the channel "alpha" (pitch) or "beta" (depth); rows with NaN are left out."""
    output_lags, rudder_lags = LAGS[channel]
    k = np.arange(max(output_lags + rudder_lags), output.size)
    phi = np.column_stack(
        [*(output[k - lag] for lag in output_lags), *(rudder[k - lag] for lag in rudder_lags)]
    )
    complete = np.isfinite(phi).all(axis=1) & np.isfinite(output[k])
    return Rows(phi[complete], output[k][complete], k[complete])


def multiplicity(count: int, p: int, forgetting: float = 1.0) -> Array:
    """Weight that each of `count` rows has after the last step: sum over i < p of forgetting^(age - i)."""
    age = np.arange(count)[::-1]
    weight = np.zeros(count)
    for i in range(p):
        weight += np.where(age >= i, forgetting ** np.maximum(age - i, 0), 0.0)
    return weight


def weighted_fit(rows: Rows, p: int = 1, forgetting: float = 1.0, p0: float = P0) -> Array:
    """What RLS (p = 1) or MILS arrives at after these rows, by one orthogonal solution without recursion.

    min over theta of sum w (y - phi^T theta)^2 + forgetting^N/p0 ||theta - 1/p0||^2
    """
    count, n = rows.phi.shape
    root = np.sqrt(multiplicity(count, p, forgetting))
    prior = np.sqrt(forgetting**count / p0)
    table = np.vstack([root[:, None] * rows.phi, prior * np.eye(n)])
    target = np.concatenate([root * rows.y, np.full(n, prior / p0)])
    return np.asarray(np.linalg.lstsq(table, target, rcond=1e-17)[0])


@dataclass(frozen=True, slots=True)
class Textbook:
    """History (N, n) of the paper's own update, and the row at which P stopped being positive definite."""

    history: Array
    lost_at: int | None


def textbook(rows: Rows, p: int = 1, forgetting: float = 1.0, p0: float = P0) -> Textbook:
    """Eq. 23-27 word for word, in double precision, with nothing to guard P."""
    count, n = rows.phi.shape
    theta, P = np.full(n, 1.0 / p0), p0 * np.eye(n)
    history, lost_at = np.full((count, n), np.nan), None
    with np.errstate(all="ignore"):
        for i in range(count):
            window = slice(max(0, i - p + 1), i + 1)
            Phi = rows.phi[window].T
            S = forgetting * np.eye(Phi.shape[1]) + Phi.T @ P @ Phi
            try:
                L = np.linalg.solve(S, Phi.T @ P.T).T
            except np.linalg.LinAlgError:
                break
            theta = theta + L @ (rows.y[window] - Phi.T @ theta)
            P = (P - L @ Phi.T @ P) / forgetting
            if not (np.isfinite(P).all() and np.isfinite(theta).all()):
                lost_at = i if lost_at is None else lost_at
                break
            history[i] = theta
            if lost_at is None and np.linalg.eigvalsh((P + P.T) / 2.0)[0] <= 0.0:
                lost_at = i
    return Textbook(history, lost_at)


def square_root(
    rows: Rows,
    p: int = 1,
    forgetting: float = 1.0,
    p0: float = P0,
    *,
    watch: Callable[[Mils], None] | None = None,
) -> Array:
    """History (N, n) of the estimator that runs on the vehicle: P as a square root, capped at p0."""
    mils = Mils(rows.phi.shape[1], p, forgetting, p0)
    history = np.empty(rows.phi.shape)
    for i, (phi, y) in enumerate(zip(rows.phi.tolist(), rows.y.tolist(), strict=True)):
        mils.update(phi, y)
        history[i] = mils.theta
        if watch is not None:
            watch(mils)
    return history


def rank(table: Array, relative: float = 1e-9) -> int:
    """Numerical rank of the columns, each scaled to unit length."""
    length = np.linalg.norm(table, axis=0)
    singular = np.linalg.svd(table / np.where(length > 0.0, length, 1.0), compute_uv=False)
    return int(np.sum(singular > relative * singular[0]))
