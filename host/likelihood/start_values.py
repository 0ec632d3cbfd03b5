"""Start values by separable least squares: no guess is needed, and no local minimum is met.

For given denominators the responses are linear in everything else. So a grid over natural frequency and
damping of pitch, then over the heave time constant, each with a linear least-squares fit of the gains,
trims and initial states to the measurements themselves (an output-error fit, free of the noise bias of
regression on measured signals), covers all stable vehicles; the best few points start the likelihood search.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.optimize import minimize, minimize_scalar
from scipy.signal import lfilter

from host.noise.speed import smoothed_speed
from host.recordings.recording import Array, Recording, mean_speed

LARGEST_FIT = 4000  # rows used per linear fit; more only cost time
FARTHEST = (-12.0, 6.0)  # logarithms of a natural frequency, rad/s, and a damping ratio
REST = 1e-3  # weight of an initial state of zero, in residuals: 1 mrad or 1 mm for a whole rad/s or m/s


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
        self.speed = smoothed_speed(recording.speed).speed[row] if recording.has_speed else None
        self.pitch_rows, self.pitch = self._measured(recording, recording.pitch, thinning)
        self.depth_rows, self.depth = self._measured(recording, recording.depth, thinning)
        self.count = count

    def _measured(self, recording: Recording, values: Array, thinning: int) -> tuple[Array, Array]:
        present = np.flatnonzero(np.isfinite(values))[::thinning]
        rows = np.rint((recording.time[present] - recording.time[0]) / self.step).astype(int)
        return rows, values[present]


class _SecondOrder:
    """Exact zero-order-hold responses of x' = A x + [1, 0]^T input, output x[1], two states, one step."""

    def __init__(self, A: Array, h: float, count: int) -> None:
        block = np.zeros((3, 3))
        block[:2, :2], block[0, 2] = A, 1.0
        E = expm(block * h)  # the augmented exponential: A itself may be singular
        Phi, Gamma = E[:2, :2], E[:2, 2]
        trace = float(np.trace(Phi))
        first, second = Gamma[1], float(Phi[1] @ Gamma)
        self._denominator = np.array([1.0, -trace, float(np.linalg.det(Phi))])
        self._numerator = np.array([0.0, first, second - trace * first])
        impulse = np.zeros(count)
        impulse[0] = 1.0
        self.to_constant = self.to_input(np.ones(count))
        self.to_initial = [
            lfilter([state[1], Phi[1] @ state - trace * state[1]], self._denominator, impulse)
            for state in np.eye(2)
        ]

    def to_input(self, values: Array) -> Array:
        return np.asarray(lfilter(self._numerator, self._denominator, values))

    def table(self, stretch: _Stretch) -> Array:
        """Columns: response to the rudder, to a constant, to each initial state; one row a grid instant."""
        ends = slice(0, stretch.count)
        return np.column_stack(
            [self.to_input(stretch.rudder), self.to_constant[ends], *(r[ends] for r in self.to_initial)]
        )


def _tables(stretches: list[_Stretch], A: Array) -> list[Array]:
    longest = max(s.count for s in stretches)
    systems = {step: _SecondOrder(A, step, longest) for step in {s.step for s in stretches}}
    return [systems[s.step].table(s) for s in stretches]


def _joint_fit(
    shared: list[Array], own: list[Array], targets: list[Array]
) -> tuple[Array, list[Array], float]:
    """Least squares with columns common to all stretches and columns of each stretch alone, and its cost.

    Each stretch's own columns are projected out first, so the work is linear in the stretches.
    """
    count = shared[0].shape[1]
    H, g = np.zeros((count, count)), np.zeros(count)
    projected = []
    for block, part, y in zip(shared, own, targets, strict=True):
        Q, _ = np.linalg.qr(part)
        B, r = block - Q @ (Q.T @ block), y - Q @ (Q.T @ y)
        H += B.T @ B
        g += B.T @ r
        projected.append((B, r))
    scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
    solution = np.linalg.lstsq(H / np.outer(scale, scale), g / scale, rcond=1e-12)[0] / scale
    cost = sum(float(np.sum((r - B @ solution) ** 2)) for B, r in projected)
    initial = [
        _held_near_rest(part, y - block @ solution)
        for block, part, y in zip(shared, own, targets, strict=True)
    ]
    return solution, initial, cost


def _held_near_rest(columns: Array, target: Array) -> Array:
    """Least squares for an initial state; one that had died away before anything was measured stays zero."""
    count = columns.shape[1]
    weighted = np.vstack([columns, REST * np.eye(count)])
    solution: Array = np.linalg.lstsq(weighted, np.concatenate([target, np.zeros(count)]), rcond=1e-10)[0]
    return solution


@dataclass(frozen=True, slots=True)
class _Fitted:
    """Gains, initial states of each stretch, cost, and the output on every grid instant of each stretch."""

    gains: Array
    initial: list[Array]
    cost: float
    output: list[Array]


def _pitch_model(stretches: list[_Stretch], a2: float, a3: float) -> _Fitted:
    """Fits b2, pitch_offset and the initial [q, theta]."""
    tables = _tables(stretches, np.array([[a2, a3], [1.0, 0.0]]))
    gains, initial, cost = _joint_fit(
        [table[s.pitch_rows, :2] for table, s in zip(tables, stretches, strict=True)],
        [table[s.pitch_rows, 2:] for table, s in zip(tables, stretches, strict=True)],
        [s.pitch for s in stretches],
    )
    theta = [table[:, :2] @ gains + table[:, 2:] @ x0 for table, x0 in zip(tables, initial, strict=True)]
    return _Fitted(gains, initial, cost, theta)


def _heave_model(stretches: list[_Stretch], theta: list[Array], a1: float) -> _Fitted:
    """Fits b1, heave_offset, u0 (unless the speed is measured) and the initial [w, zeta], for given pitch."""
    tables = _tables(stretches, np.array([[a1, 0.0], [1.0, 0.0]]))
    shared, targets = [], []
    for table, s, pitch in zip(tables, stretches, theta, strict=True):
        climb = pitch if s.speed is None else s.speed * pitch
        risen = np.concatenate([[0.0], np.cumsum(0.5 * (climb[1:] + climb[:-1])) * s.step])
        columns = table[:, :2] if s.speed is not None else np.column_stack([table[:, :2], -risen])
        shared.append(columns[s.depth_rows])
        targets.append(s.depth if s.speed is None else s.depth + risen[s.depth_rows])
    own = [table[s.depth_rows, 2:] for table, s in zip(tables, stretches, strict=True)]
    gains, initial, cost = _joint_fit(shared, own, targets)
    return _Fitted(gains, initial, cost, [])


def start_values(recordings: list[Recording]) -> list[tuple[Array, list[Array]]]:
    """Start points for the likelihood search, best first: one, or more where the grid has several valleys.

    Each is (parameters (8,) in the order of host.dynamics.equations.NAMES, what each begins with (5,)).
    """
    rows = sum(r.time.size for r in recordings)
    stretches = [_Stretch(r, 1 + rows // LARGEST_FIT) for r in recordings]
    longest = max(s.step * s.count for s in stretches)
    slowest, fastest = 2.0 * np.pi / longest, min(0.7 * np.pi / max(s.step for s in stretches), 30.0)
    speed = mean_speed(recordings) if recordings[0].has_speed else None
    best = []
    for frequency, damping in _pitch_valleys(stretches, slowest, fastest):
        a2, a3 = -2.0 * damping * frequency, -(frequency**2)
        pitch = _pitch_model(stretches, a2, a3)
        for a1 in _heave_valleys(stretches, pitch.output, 0.3 * slowest, fastest):
            heave = _heave_model(stretches, pitch.output, a1)
            u0 = heave.gains[2] if speed is None else speed
            gains = [a1, a2, a3, heave.gains[0], pitch.gains[0], u0, heave.gains[1], pitch.gains[1]]
            initial = [
                np.array([w, q, theta, zeta, 0.0])
                for (w, zeta), (q, theta) in zip(heave.initial, pitch.initial, strict=True)
            ]
            best.append((heave.cost, np.array(gains), initial))
    best.sort(key=lambda start: start[0])
    return [(parameters, initial) for _, parameters, initial in best]


def _pitch_valleys(stretches: list[_Stretch], slowest: float, fastest: float) -> list[tuple[float, float]]:
    """Natural frequency and damping ratio of the best pitch models, refined; one per distinct valley."""

    def cost(log_point: Array) -> float:
        frequency, damping = np.exp(np.clip(log_point, *FARTHEST))
        return _pitch_model(stretches, -2.0 * damping * frequency, -(frequency**2)).cost

    grid = [
        np.log([frequency, damping])
        for frequency in np.geomspace(slowest, fastest, 14)
        for damping in (0.15, 0.35, 0.7, 1.2, 2.5)
    ]
    grid.sort(key=cost)
    valleys: list[tuple[float, Array]] = []
    for point in (grid[0], next(g for g in grid if abs(g[0] - grid[0][0]) > 0.7)):
        found = minimize(cost, point, method="Nelder-Mead", options=dict(xatol=0.01, fatol=0.0, maxfev=50))
        end = np.clip(found.x, *FARTHEST)  # where pitch tells nothing a search runs away
        if all(np.max(np.abs(end - other)) > 0.3 for _, other in valleys):
            valleys.append((found.fun, end))
    valleys.sort(key=lambda valley: valley[0])
    near_best = [point for value, point in valleys if value <= 4.0 * valleys[0][0]]
    return [(float(np.exp(point[0])), float(np.exp(point[1]))) for point in near_best]


def _heave_valleys(
    stretches: list[_Stretch], theta: list[Array], slowest: float, fastest: float
) -> list[float]:
    """Heave damping a1 of the best depth model for the given pitch; two where two explain almost alike."""

    def cost(log_rate: float) -> float:
        return _heave_model(stretches, theta, -np.exp(log_rate)).cost

    grid = np.linspace(np.log(slowest), np.log(fastest), 16)
    costs = np.array([cost(rate) for rate in grid])
    padded = np.concatenate([[np.inf], costs, [np.inf]])
    valleys = np.flatnonzero((costs <= padded[:-2]) & (costs <= padded[2:]))
    found = []
    for at in valleys[np.argsort(costs[valleys])][:2]:
        bracket = (grid[max(at - 1, 0)], grid[min(at + 1, 15)])
        refined = minimize_scalar(cost, bounds=bracket, method="bounded", options=dict(xatol=0.02))
        found.append((float(refined.fun), -float(np.exp(refined.x))))
    found.sort()
    return [a1 for value, a1 in found if value <= 1.5 * found[0][0]]
