"""The force and the moment that the base equations lack, along the recording, in physical units.

A Kalman smoother (Rauch, Tung and Striebel, AIAA J. 3(8), 1965) on the base equations with two more states,
an unknown heave and pitch acceleration that wander at random, says what must have acted beside them.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from host.recordings.recording import Array, Recording, mean_speed


@dataclass(frozen=True, slots=True)
class UnknownForce:
    """Estimates along the recording: heave m/s^2 and pitch rad/s^2, (2, N), with their deviations."""

    values: Array
    std: Array


def unknown_force(
    recording: Recording, base: dict[str, float], floor: Array, accelerations: tuple[float, float]
) -> UnknownForce:
    """Smooths one recording.

    base           a1 a2 a3 b1 b2 u0, best the extended model's: then the force is what its effects give
    accelerations  rms of w', q': the force may wander by so much in a second
    """
    h = recording.step
    u = mean_speed([recording]) if recording.has_speed else base["u0"]
    A = np.zeros((7, 7))
    A[0, [0, 4, 6]] = base["a1"], 1.0, base["b1"]
    A[1, [1, 2, 5, 6]] = base["a2"], base["a3"], 1.0, base["b2"]
    A[2, 1] = 1.0
    A[3, [0, 2]] = 1.0, -u
    E = expm(A * h)
    Phi, Gamma = E[:6, :6], E[:6, 6]
    Q = np.diag([0.0, 0.0, 0.0, 0.0, accelerations[0] ** 2 * h, accelerations[1] ** 2 * h])
    C = np.zeros((2, 6))
    C[0, 2], C[1, 3] = 1.0, 1.0
    measured = np.vstack([recording.pitch, recording.depth])
    rows = measured.shape[1]
    x, P = (
        np.zeros(6),
        np.diag([1.0, 1.0, 0.3, 100.0, 10.0 * accelerations[0] ** 2, 10.0 * accelerations[1] ** 2]),
    )
    x[3] = float(recording.depth[np.isfinite(recording.depth)][0])
    before, P_before = np.empty((rows, 6)), np.empty((rows, 6, 6))
    after, P_after = np.empty((rows, 6)), np.empty((rows, 6, 6))
    for k in range(rows):
        before[k], P_before[k] = x, P
        seen = np.isfinite(measured[:, k])
        if seen.any():
            H = C[seen]
            S = H @ P @ H.T + np.diag(floor[seen])
            K = np.linalg.solve(S, H @ P).T
            x = x + K @ (measured[seen, k] - H @ x)
            kept = np.eye(6) - K @ H
            P = kept @ P @ kept.T + K @ np.diag(floor[seen]) @ K.T  # Joseph's form: stays symmetric
        after[k], P_after[k] = x, P
        x = Phi @ x + Gamma * recording.rudder[k]
        P = Phi @ P @ Phi.T + Q
    smooth, P_smooth = after[-1].copy(), P_after[-1].copy()
    values, variance = np.empty((2, rows)), np.empty((2, rows))
    for k in range(rows - 1, -1, -1):
        if k < rows - 1:
            G = np.linalg.solve(P_before[k + 1], Phi @ P_after[k]).T
            smooth = after[k] + G @ (smooth - before[k + 1])
            P_smooth = P_after[k] + G @ (P_smooth - P_before[k + 1]) @ G.T
            P_smooth = 0.5 * (P_smooth + P_smooth.T)
        values[:, k], variance[:, k] = smooth[4:], np.diag(P_smooth)[4:]
    return UnknownForce(values=values, std=np.sqrt(np.maximum(variance, 0.0)))
