"""Kalman filter over a recording: innovations when random forces act on the vehicle.

Or a plane that moved between the rows as they do not show: of a deviation s_k of its mean angle in row k, the
state after it has the covariance g g^T s_k^2 more, g what an angle does to it within the row.
"""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from host.compiled.over_rows import KEPT, over_rows
from host.dynamics.equations import Structure
from host.dynamics.form import Form
from host.dynamics.propagate import Inputs, form_of, start_of
from host.recordings.recording import Array


@lru_cache(KEPT)
def _kalman(form: Form) -> ca.Function:
    """One step of the extended Kalman filter with white force and moment noise; gives e, S and K."""
    return _filter_step(form, may_stray=False)


@lru_cache(KEPT)
def _kalman_astray(form: Form) -> ca.Function:
    """The same where the plane's mean angle in a row is known but for a deviation, which comes last."""
    return _filter_step(form, may_stray=True)


def _filter_step(form: Form, may_stray: bool) -> ca.Function:
    x, p, drive = form.symbols()
    lower = ca.Sparsity.lower(form.nx)  # a covariance is carried by its lower triangle alone
    P = ca.tril2symm(ca.SX.sym("P", lower))
    measured, present = ca.SX.sym("measured", 2), ca.SX.sym("present", 2)
    noise = ca.SX.sym("noise", 4)
    y = form.outputs(x, p, drive)
    C = ca.diag(present) @ ca.jacobian(y, x)
    error = present * (measured - y)
    S = C @ P @ C.T + ca.diag(noise[:2])
    det = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
    S_inverse = ca.vertcat(ca.horzcat(S[1, 1], -S[0, 1]), ca.horzcat(-S[1, 0], S[0, 0])) / det
    K = P @ C.T @ S_inverse
    updated = x + K @ error
    reduced = ca.SX.eye(form.nx) - K @ C
    P_updated = reduced @ P @ reduced.T + K @ ca.diag(noise[:2]) @ K.T
    before = ca.SX.sym("before", form.nx)
    *_, after = form.step(before, p, drive)
    A = ca.Function("A", [before, p, drive], [after, ca.jacobian(after, before)])
    x_next, Ax = A(updated, p, drive)
    density = ca.SX(form.nx, 1)
    for state, level in zip(_shaken(form.structure), ca.vertsplit(noise[2:]), strict=True):
        density[form.structure.states.index(state)] = level
    Q = ca.diag(density) * drive[3]
    P_next = Ax @ (P_updated + Q / 2) @ Ax.T + Q / 2
    per_step = ca.vertcat(drive, measured, present)
    if may_stray:
        deviation = ca.SX.sym("deviation")
        by_plane = ca.Function("by_plane", [before, p, drive], [ca.jacobian(after, drive[0])])
        moved = by_plane(updated, p, drive) * deviation
        P_next += moved @ moved.T
        per_step = ca.vertcat(per_step, deviation)
    carried = ca.vertcat(x, _of_lower(P, lower))
    carried_next = ca.vertcat(x_next, _of_lower(P_next, lower))
    result = ca.vertcat(error, S[0, 0], S[0, 1], S[1, 1], ca.vec(K), x)
    carried_next, result = ca.cse([carried_next, result])
    return ca.Function("kalman", [carried, per_step, ca.vertcat(p, noise)], [carried_next, result])


def _shaken(structure: Structure) -> tuple[str, str]:
    """The two states that white noise drives: the waves' where there are any, else the vehicle's own."""
    waves = ("wave_rate", "turning_wave_rate")
    return waves if set(waves) <= set(structure.states) else ("w", "q")


def _of_lower(matrix: ca.SX, lower: ca.Sparsity) -> ca.SX:
    rows, columns = lower.get_triplet()
    return ca.vertcat(*(matrix[row, column] for row, column in zip(rows, columns, strict=True)))


@dataclass(frozen=True, slots=True, kw_only=True)
class KalmanPass:
    """What the filter saw at each of N rows, before it took in that row's measurement.

    error     (2, N) innovations of pitch and depth, 0 where missing
    variance  (3, N) S11, S12, S22 of the innovations; 1, 0, 1 where missing
    gains     (2 nx, N), column-major nx x 2
    states    (nx, N) predicted
    """

    error: Array
    variance: Array
    gains: Array
    states: Array


def kalman_pass(
    parameters: Array, initial: Array, noise: Array, inputs: Inputs, spread: Array | None = None
) -> KalmanPass:
    """Runs the Kalman filter over a recording, from an initial state taken as exact.

    spread  (nx,) variances of the states at the first row, where some are not exact
    noise  (4,) variances of pitch (rad^2) and depth (m^2), spectral densities of the unknown heave
           acceleration ((m/s^2)^2 s) and pitch acceleration ((rad/s^2)^2 s)
    """
    form, rows = form_of(inputs), inputs.drive.shape[1]
    start, _ = start_of(form, parameters, initial, inputs)
    lower = np.tri(form.nx, dtype=bool).T  # column by column, as CasADi keeps it
    P = np.diag(spread if spread is not None else np.zeros(form.nx))
    carried = np.concatenate([start, P[lower]])
    may_stray = inputs.astray.size > 0
    per_step = np.vstack([inputs.drive, inputs.measured, inputs.present, *[inputs.astray] * may_stray])
    levels = np.concatenate([inputs.widened(parameters), noise])
    table = over_rows(_kalman_astray if may_stray else _kalman, form, rows)(carried, per_step, levels)
    split = 5 + 2 * form.nx
    variance = table[2:5]
    variance[::2][inputs.present == 0.0] = 1.0
    return KalmanPass(error=table[:2], variance=variance, gains=table[5:split], states=table[split:])
