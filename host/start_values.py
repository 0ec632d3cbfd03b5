"""Start values by separable least squares: no guess is needed, and no local minimum is met.

For given denominators the responses are linear in everything else. So a grid over natural frequency and
damping of pitch, then over the heave time constant, each with a linear least-squares fit of the gains,
trims and initial states to the measurements themselves (an output-error fit, free of the noise bias of
regression on measured signals), covers all stable vehicles; the best few points start the likelihood search.
"""

import numpy as np
from scipy.linalg import expm
from scipy.optimize import minimize, minimize_scalar
from scipy.signal import lfilter, ss2tf

from host.equations import NAMES
from host.recording import Array, Recording

LARGEST_FIT = 4000  # rows used per linear fit; more only cost time


class _Stretch:
    """One recording on a uniform grid, rudder held, with the rows where pitch and depth were measured."""

    def __init__(self, recording: Recording, thinning: int) -> None:
        self.step = recording.step
        count = round(recording.duration / self.step) + 1
        at = recording.time[0] + np.arange(count) * self.step
        row = np.clip(
            np.searchsorted(recording.time, at + self.step / 2, side="right") - 1, 0, recording.time.size - 1
        )
        self.rudder = recording.rudder[row]
        self.speed = recording.speed[row] if recording.has_speed else None
        self.pitch_rows, self.pitch = self._measured(recording, recording.pitch, thinning)
        self.depth_rows, self.depth = self._measured(recording, recording.depth, thinning)
        self.count = count

    def _measured(self, recording: Recording, values: Array, thinning: int) -> tuple[Array, Array]:
        present = np.flatnonzero(np.isfinite(values))[::thinning]
        rows = np.rint((recording.time[present] - recording.time[0]) / self.step).astype(int)
        return rows, values[present]


def _discrete(A: Array, B: Array, h: float) -> tuple[Array, Array]:
    """Exact zero-order hold, by the augmented matrix exponential (A may be singular)."""
    n, m = B.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n], block[:n, n:] = A, B
    E = expm(block * h)
    return E[:n, :n], E[:n, n:]


def _responses(A: Array, B: Array, c: Array, h: float, drives: list[Array]) -> list[Array]:
    """Outputs c x of x' = A x + B drive, one for each drive (1-D B), then for each unit initial state."""
    Phi, Gamma = _discrete(A, B, h)
    count = drives[0].size
    columns = []
    for drive in drives:
        numerator, denominator = ss2tf(Phi, Gamma, c[None, :], np.zeros((1, 1)))
        columns.append(lfilter(numerator[0], denominator, drive))
    impulse = np.zeros(count)
    impulse[0] = 1.0
    for state in np.eye(A.shape[0]):
        numerator, denominator = ss2tf(
            Phi, (Phi @ state)[:, None], c[None, :], np.array([[float(c @ state)]])
        )
        columns.append(lfilter(numerator[0], denominator, impulse))
    return columns


def _joint_fit(
    blocks: list[Array], own: list[Array], targets: list[Array]
) -> tuple[Array, float, list[Array]]:
    """Least squares with columns common to all stretches and columns of each stretch alone."""
    shared = blocks[0].shape[1]
    total = shared + sum(part.shape[1] for part in own)
    rows = sum(target.size for target in targets)
    table, at, column = np.zeros((rows, total)), 0, shared
    for block, part, target in zip(blocks, own, targets, strict=True):
        table[at : at + target.size, :shared] = block
        table[at : at + target.size, column : column + part.shape[1]] = part
        at, column = at + target.size, column + part.shape[1]
    scale = np.linalg.norm(table, axis=0)
    scale[scale == 0.0] = 1.0
    y = np.concatenate(targets)
    solution = np.linalg.lstsq(table / scale, y, rcond=1e-10)[0] / scale
    own_solutions, column = [], shared
    for part in own:
        own_solutions.append(solution[column : column + part.shape[1]])
        column += part.shape[1]
    return solution, float(np.sum((y - table @ solution) ** 2)), own_solutions


def _pitch_model(stretches: list[_Stretch], a2: float, a3: float) -> tuple[Array, float, list[Array]]:
    """Fits b2, pitch_offset and each stretch's initial [q, theta]; also the cost, and theta on the grid."""
    A, B, c = np.array([[a2, a3], [1.0, 0.0]]), np.array([[1.0], [0.0]]), np.array([0.0, 1.0])
    tables = [np.column_stack(_responses(A, B, c, s.step, [s.rudder, np.ones(s.count)])) for s in stretches]
    blocks = [table[s.pitch_rows, :2] for table, s in zip(tables, stretches, strict=True)]
    own = [table[s.pitch_rows, 2:] for table, s in zip(tables, stretches, strict=True)]
    solution, cost, initial = _joint_fit(blocks, own, [s.pitch for s in stretches])
    theta = [
        table[:, :2] @ solution[:2] + table[:, 2:] @ x0 for table, x0 in zip(tables, initial, strict=True)
    ]
    return np.concatenate([solution[:2], *initial]), cost, theta


def _heave_model(
    stretches: list[_Stretch], theta: list[Array], a1: float, speed: float | None
) -> tuple[Array, float]:
    """Fits b1, heave_offset, u0 (unless the speed is measured) and each stretch's initial [w, zeta]."""
    A, B, c = np.array([[a1, 0.0], [1.0, 0.0]]), np.array([[1.0], [0.0]]), np.array([0.0, 1.0])
    blocks, own, targets = [], [], []
    for s, pitch in zip(stretches, theta, strict=True):
        rise = np.concatenate([[0.0], np.cumsum(0.5 * (pitch[1:] + pitch[:-1])) * s.step])
        table = np.column_stack(_responses(A, B, c, s.step, [s.rudder, np.ones(s.count)]))
        target = s.depth
        if s.speed is None:
            block = np.column_stack([table[:, :2], -rise])
        else:
            product = s.speed * pitch
            climb = np.concatenate([[0.0], np.cumsum(0.5 * (product[1:] + product[:-1])) * s.step])
            block, target = table[:, :2], target + climb[s.depth_rows]
        blocks.append(block[s.depth_rows])
        own.append(table[s.depth_rows, 2:])
        targets.append(target)
    solution, cost, initial = _joint_fit(blocks, own, targets)
    u0 = solution[2] if speed is None else speed
    return np.concatenate([solution[:2], [u0], *initial]), cost


def start_values(recordings: list[Recording]) -> list[tuple[Array, list[Array]]]:
    """Start points for the likelihood search, best first: one, or two where the grid has two valleys.

    Each is (parameters (8,) in the order of host.equations.NAMES, initial states (4,) of each recording).
    """
    rows = sum(r.time.size for r in recordings)
    stretches = [_Stretch(r, 1 + rows // LARGEST_FIT) for r in recordings]
    longest = max(s.step * s.count for s in stretches)
    slowest, fastest = 2.0 * np.pi / longest, min(0.7 * np.pi / max(s.step for s in stretches), 30.0)
    speed = float(np.mean([r.speed.mean() for r in recordings])) if recordings[0].has_speed else None
    best = []
    for frequency, damping in _pitch_valleys(stretches, slowest, fastest):
        a2, a3 = -2.0 * damping * frequency, -(frequency**2)
        pitch, _, theta = _pitch_model(stretches, a2, a3)
        a1 = _heave_valley(stretches, theta, speed, 0.3 * slowest, fastest)
        heave, _ = _heave_model(stretches, theta, a1, speed)
        parameters = dict(
            a1=a1, a2=a2, a3=a3, b1=heave[0], b2=pitch[0], u0=heave[2],
            heave_offset=heave[1], pitch_offset=pitch[1],
        )  # fmt: skip
        initial = [
            np.array([heave[3 + 2 * i], pitch[2 + 2 * i], pitch[3 + 2 * i], heave[4 + 2 * i]])
            for i in range(len(recordings))
        ]
        best.append((np.array([parameters[name] for name in NAMES]), initial))
    return best


def _pitch_valleys(stretches: list[_Stretch], slowest: float, fastest: float) -> list[tuple[float, float]]:
    """Natural frequency and damping ratio of the best pitch models, refined; one per distinct valley."""

    def cost(log_point: Array) -> float:
        frequency, damping = np.exp(np.clip(log_point, -12.0, 6.0))
        return _pitch_model(stretches, -2.0 * damping * frequency, -(frequency**2))[1]

    grid = [
        np.log([frequency, damping])
        for frequency in np.geomspace(slowest, fastest, 14)
        for damping in (0.15, 0.35, 0.7, 1.2, 2.5)
    ]
    grid.sort(key=cost)
    valleys: list[tuple[float, Array]] = []
    for point in (grid[0], next(g for g in grid if abs(g[0] - grid[0][0]) > 0.7)):
        found = minimize(cost, point, method="Nelder-Mead", options=dict(xatol=0.01, fatol=0.0, maxfev=50))
        if all(np.max(np.abs(found.x - other)) > 0.3 for _, other in valleys):
            valleys.append((found.fun, found.x))
    valleys.sort(key=lambda valley: valley[0])
    near_best = [point for value, point in valleys if value < 4.0 * valleys[0][0]]
    return [(float(np.exp(point[0])), float(np.exp(point[1]))) for point in near_best]


def _heave_valley(
    stretches: list[_Stretch], theta: list[Array], speed: float | None, slowest: float, fastest: float
) -> float:
    """The heave damping a1 of the best depth model for the given pitch, refined between grid points."""

    def cost(log_rate: float) -> float:
        return _heave_model(stretches, theta, -np.exp(log_rate), speed)[1]

    grid = np.linspace(np.log(slowest), np.log(fastest), 16)
    at = int(np.argmin([cost(rate) for rate in grid]))
    bracket = (grid[max(at - 1, 0)], grid[min(at + 1, 15)])
    return -float(np.exp(minimize_scalar(cost, bounds=bracket, method="bounded", options=dict(xatol=0.02)).x))
