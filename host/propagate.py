"""Propagation of the equations over a recording: free run, exact sensitivities, Kalman innovations.

Between rows the rudder is held (zero-order hold), as the actuator holds it, and the state advances by
classical fourth-order Runge-Kutta in sub-steps short enough that its error stays below the sensors'
resolution; derivatives are those of the very same steps, by CasADi, so gradients are exact.
"""

from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np

from host.equations import NAMES, STATES, derivative, outputs
from host.recording import Array, Recording

NX, NP = len(STATES), len(NAMES)
MOST_SUBSTEPS = 8  # slow records show no modes faster than their sampling: finer steps would resolve nothing
LONGEST_SUBSTEP = 0.05  # s; for a 10 rad/s mode the error of one sub-step is below 3e-4 of its change


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """What drives the equations over one recording, and what was measured. N rows.

    drive     (4, N) rudder rad, speed m/s, 1 where the speed is known, interval to the next row s
    measured  (2, N) pitch rad and depth m, 0 where missing
    present   (2, N) 1 where measured, else 0
    """

    drive: Array
    measured: Array
    present: Array
    substeps: int


def inputs_of(recording: Recording) -> Inputs:
    """Inputs of one recording."""
    intervals = recording.intervals
    known = np.full(intervals.size, float(recording.has_speed))
    speed = recording.speed if recording.has_speed else np.zeros(intervals.size)
    measured = np.vstack([recording.pitch, recording.depth])
    present = np.isfinite(measured)
    return Inputs(
        drive=np.vstack([recording.rudder, speed, known, intervals]),
        measured=np.where(present, measured, 0.0),
        present=present.astype(float),
        substeps=int(np.ceil(recording.step / max(LONGEST_SUBSTEP, recording.step / MOST_SUBSTEPS))),
    )


def _step(x: ca.SX, p: ca.SX, drive: ca.SX, substeps: int) -> ca.SX:
    h = drive[3] / substeps
    held = (drive[0], drive[1], drive[2])
    for _ in range(substeps):
        k1 = derivative(x, p, *held)
        k2 = derivative(x + h / 2 * k1, p, *held)
        k3 = derivative(x + h / 2 * k2, p, *held)
        k4 = derivative(x + h * k3, p, *held)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return x


@cache
def _free_run(substeps: int) -> ca.Function:
    x, p, drive = ca.SX.sym("x", NX), ca.SX.sym("p", NP), ca.SX.sym("drive", 4)
    return ca.Function("free_run", [x, drive, p], [_step(x, p, drive, substeps), x])


@cache
def _sensitivities(substeps: int) -> ca.Function:
    """One step of the innovations form x+ = F(x + K e) with d/d(parameters, initial state) carried along."""
    x, p, drive = ca.SX.sym("x", NX), ca.SX.sym("p", NP), ca.SX.sym("drive", 4)
    measured, gain = ca.SX.sym("measured", 2), ca.SX.sym("gain", NX * 2)
    S = ca.SX.sym("S", NX, NP + NX)
    K = ca.reshape(gain, NX, 2)
    error = measured - outputs(x)
    updated = x + K @ error
    S_updated = S - K @ S[2:4, :]
    x_symbol = ca.SX.sym("x_symbol", NX)
    after = _step(x_symbol, p, drive, substeps)
    A = ca.substitute(ca.jacobian(after, x_symbol), x_symbol, updated)
    B = ca.substitute(ca.jacobian(after, p), x_symbol, updated)
    S_next = A @ S_updated + ca.horzcat(B, ca.SX(NX, NX))
    carried = ca.vertcat(x, ca.vec(S))
    carried_next = ca.vertcat(ca.substitute(after, x_symbol, updated), ca.vec(S_next))
    per_step = ca.vertcat(drive, measured, gain)
    return ca.Function(
        "sensitivities", [carried, per_step, p], [carried_next, ca.vertcat(x, ca.vec(S[2:4, :]))]
    )


@cache
def _kalman(substeps: int) -> ca.Function:
    """One step of the extended Kalman filter with white force and moment noise; gives e, S and K."""
    x, p, drive = ca.SX.sym("x", NX), ca.SX.sym("p", NP), ca.SX.sym("drive", 4)
    P = ca.SX.sym("P", NX, NX)
    measured, present = ca.SX.sym("measured", 2), ca.SX.sym("present", 2)
    noise = ca.SX.sym("noise", 4)  # variances: pitch, depth, heave force per s, pitch moment per s
    C = ca.SX(2, NX)
    C[0, 2], C[1, 3] = present[0], present[1]
    error = present * (measured - outputs(x))
    S = C @ P @ C.T + ca.diag(noise[:2])
    det = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
    S_inverse = ca.vertcat(ca.horzcat(S[1, 1], -S[0, 1]), ca.horzcat(-S[1, 0], S[0, 0])) / det
    K = P @ C.T @ S_inverse
    updated = x + K @ error
    reduced = ca.SX.eye(NX) - K @ C
    P_updated = reduced @ P @ reduced.T + K @ ca.diag(noise[:2]) @ K.T
    x_symbol = ca.SX.sym("x_symbol", NX)
    after = _step(x_symbol, p, drive, substeps)
    A = ca.substitute(ca.jacobian(after, x_symbol), x_symbol, updated)
    Q = ca.diag(ca.vertcat(noise[2], noise[3], 0, 0)) * drive[3]
    P_next = A @ (P_updated + Q / 2) @ A.T + Q / 2
    carried = ca.vertcat(x, ca.vec(P))
    carried_next = ca.vertcat(ca.substitute(after, x_symbol, updated), ca.vec(P_next))
    per_step = ca.vertcat(drive, measured, present)
    return ca.Function(
        "kalman",
        [carried, per_step, ca.vertcat(p, noise)],
        [carried_next, ca.vertcat(error, S[0, 0], S[0, 1], S[1, 1], ca.vec(K), x)],
    )


@cache
def _over(kind: str, substeps: int, rows: int) -> ca.Function:
    one = {"free": _free_run, "sensitivities": _sensitivities, "kalman": _kalman}[kind](substeps)
    return one.mapaccum(f"{kind}_{rows}", rows)


def free_run(parameters: Array, initial: Array, inputs: Inputs) -> Array:
    """States (4, N) at each row for the given initial state (4,), without looking at the measurements."""
    rows = inputs.drive.shape[1]
    _, states = _over("free", inputs.substeps, rows)(initial, inputs.drive, parameters)
    return np.asarray(states, dtype=float)


def innovations(
    parameters: Array, initial: Array, inputs: Inputs, gains: Array | None = None
) -> tuple[Array, Array]:
    """Innovations e = y - yhat (2, N) and their predictors' sensitivities (2, NP + 4, N), exact.

    gains  (8, N) Kalman gain of each row, column-major 4 x 2; None for output error (free run).
           The derivative is taken at fixed gain.
    """
    rows = inputs.drive.shape[1]
    gains = np.zeros((NX * 2, rows)) if gains is None else gains
    S0 = np.zeros((NX, NP + NX))
    S0[:, NP:] = np.eye(NX)
    carried = np.concatenate([initial, S0.ravel(order="F")])
    per_step = np.vstack([inputs.drive, inputs.measured, gains])
    _, result = _over("sensitivities", inputs.substeps, rows)(carried, per_step, parameters)
    table = np.asarray(result, dtype=float)
    error = inputs.present * (inputs.measured - table[2:4])
    sensitivity = table[4:].reshape((2, NP + NX, rows), order="F") * inputs.present[:, None, :]
    return error, sensitivity


@dataclass(frozen=True, slots=True, kw_only=True)
class KalmanPass:
    """Innovations (2, N), their variances S11, S12, S22 (3, N), gains (8, N) and predicted states (4, N)."""

    error: Array
    variance: Array
    gains: Array
    states: Array


def kalman_pass(
    parameters: Array, initial: Array, noise: Array, inputs: Inputs, initial_covariance: Array | None = None
) -> KalmanPass:
    """Runs the Kalman filter over a recording.

    noise  (4,) variances of pitch (rad^2) and depth (m^2), spectral densities of the unknown heave
           acceleration ((m/s^2)^2 s) and pitch acceleration ((rad/s^2)^2 s)
    """
    rows = inputs.drive.shape[1]
    P0 = np.zeros((NX, NX)) if initial_covariance is None else initial_covariance
    carried = np.concatenate([initial, P0.ravel(order="F")])
    per_step = np.vstack([inputs.drive, inputs.measured, inputs.present])
    _, result = _over("kalman", inputs.substeps, rows)(carried, per_step, np.concatenate([parameters, noise]))
    table = np.asarray(result, dtype=float)
    return KalmanPass(error=table[:2], variance=table[2:5], gains=table[5:13], states=table[13:17])
