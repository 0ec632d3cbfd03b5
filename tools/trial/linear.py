"""Linear equations in free run, many sets of coefficients at once, exactly between the samples.

    w' = a1 w + b1 d + c_wq q + w0            theta' = q
    q' = a2 q + a3 theta + b2 d + c_qw w + q0 zeta'  = w - u theta + current

With the last five coefficients 0 they are those of Yuan et al., J. Mar. Sci. Eng. 2025, 13, 1489, Eq. 1-3.
"""

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm

Array = npt.NDArray[np.float64]

NAMES = ("a1", "a2", "a3", "b1", "b2", "u0")
STATE = ("heave", "pitch_rate", "pitch", "depth")
MORE = ("c_wq", "c_qw", "w0", "q0", "current")
"""What linear equations can have beyond the paper's."""


def free_run(sets: Array, command: Array, step_s: float, speed: Array | None) -> tuple[Array, Array]:
    """Pitch and depth, each (sets, rows).

    sets     (sets, 15): NAMES, STATE at the first row, MORE
    command  rad, held from its row to the next
    speed    m/s at each row, or None for the constant u0
    """
    a1, a2, a3, b1, b2, u0 = sets[:, :6].T
    c_wq, c_qw, w0, q0, current = sets[:, 10:].T
    # w, q, theta, the integrals of w and theta over one step, then the command and 1 as constant states
    flow = np.zeros((len(sets), 7, 7))
    flow[:, 0, 0], flow[:, 0, 1], flow[:, 0, 5], flow[:, 0, 6] = a1, c_wq, b1, w0
    flow[:, 1, 0], flow[:, 1, 1], flow[:, 1, 2], flow[:, 1, 5], flow[:, 1, 6] = c_qw, a2, a3, b2, q0
    flow[:, 2, 1] = flow[:, 3, 0] = flow[:, 4, 2] = 1.0
    over = expm(flow * step_s)
    advance = np.ascontiguousarray(over[:, :5, :3])
    kick, push = over[:, :5, 5:6], over[:, :5, 6:]
    rows = len(command)
    moved = np.empty((rows, len(sets), 5, 1))
    state = sets[:, 6:9, None]
    moved[0] = 0.0
    moved[0, :, :3] = state
    for row in range(1, rows):
        moved[row] = advance @ state + kick * command[row - 1] + push
        state = moved[row, :, :3]
    along = np.broadcast_to(u0[:, None], (len(sets), rows - 1))
    if speed is not None:
        along = np.broadcast_to((speed[1:] + speed[:-1]) / 2, (len(sets), rows - 1))
    sunk = moved[1:, :, 3, 0].T - along * moved[1:, :, 4, 0].T + current[:, None] * step_s
    depth = sets[:, 9:10] + np.concatenate([np.zeros((len(sets), 1)), np.cumsum(sunk, axis=1)], axis=1)
    return moved[:, :, 2, 0].T, depth
