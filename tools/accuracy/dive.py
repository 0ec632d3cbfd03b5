"""Dives of the linear vehicle by the exact matrix exponential, sharing nothing with what they measure."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import lfilter

Array = NDArray[np.float64]

NAMES = ("a1", "a2", "a3", "b1", "b2", "u0")
TABLE_1 = (-0.63084, -3.38699, -8.19858, 0.41385, -3.94120, 2.5)
"""The paper's vehicle and speed."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """What is flown and how it is measured; SI units.

    missing  share of the samples of each sensor that is lost, one by one, or in bursts of `burst` s of both
    loses_rows  whether a sample is lost as a whole, the plane with it
    offsets  standard deviations over dives of the forces of trim: heave m/s^2, pitch rad/s^2
    drift    factors by which a1, a2, a3, b1, b2 change over the dive, linearly from 1
    coupling c_wq of w' = ... + c_wq q
    forces   white forces that act: heave m/s^2/sqrt(Hz), pitch rad/s^2/sqrt(Hz)
    """

    step: float = 0.1
    duration: float = 300.0
    pitch_noise: float = float(np.deg2rad(0.1))
    depth_noise: float = 0.01
    missing: float = 0.0
    burst: float = 0.0
    loses_rows: bool = False
    offsets: tuple[float, float] = (0.0, 0.0)
    drift: tuple[float, float, float, float, float] = (1.0, 1.0, 1.0, 1.0, 1.0)
    coupling: float = 0.0
    forces: tuple[float, float] = (0.0, 0.0)
    vehicle: tuple[float, ...] = TABLE_1
    amplitude: float = 0.25
    tells_speed: bool = False

    @property
    def truth(self) -> Array:
        """a1, a2, a3, b1, b2, u0 at the end of the dive."""
        return np.array(self.vehicle) * (*self.drift, 1.0)

    @property
    def is_drifting(self) -> bool:
        return set(self.drift) != {1.0}


@dataclass(frozen=True, kw_only=True)
class Dive:
    """One dive, arrays of N; NaN where nothing was measured; `start` is w, q, theta, zeta at its start."""

    case: Case
    time: Array
    rudder: Array
    pitch: Array
    depth: Array
    start: Array
    trim: Array


def multistep(rng: np.random.Generator, case: Case) -> Array:
    """Plane levels held for 1 to 8 s."""
    rows = round(case.duration / case.step)
    rudder, at = np.empty(rows), 0
    while at < rows:
        until = at + max(1, round(rng.uniform(1.0, 8.0) / case.step))
        rudder[at:until] = rng.uniform(-case.amplitude, case.amplitude)
        at = until
    return rudder


def fly(case: Case, seed: int) -> Dive:
    """A dive of this case; the same seed gives the same plane, start and noise."""
    rng = np.random.default_rng(seed)
    rudder = multistep(rng, case)
    start = rng.normal(size=4) * (0.2, 0.1, 0.1, 3.0) + (0.0, 0.0, 0.0, 20.0)
    trim = rng.normal(size=2) * case.offsets
    noise = rng.normal(size=(2, rudder.size))
    present = ~_lost(rng, case, rudder.size)
    pushes = (
        trim[:, None] + np.array(case.forces)[:, None] * rng.normal(size=(2, rudder.size)) / case.step**0.5
    )
    states = simulate(case, np.array(case.vehicle), rudder, start, pushes)
    return Dive(
        case=case,
        time=np.asarray(case.step * np.arange(rudder.size), dtype=np.float64),
        rudder=rudder,
        pitch=np.where(present[0], states[2] + case.pitch_noise * noise[0], np.nan),
        depth=np.where(present[1], states[3] + case.depth_noise * noise[1], np.nan),
        start=start,
        trim=trim,
    )


def simulate(case: Case, vehicle: Array, rudder: Array, start: Array, pushes: Array) -> Array:
    """States w, q, theta, zeta (4, N); pushes (2, N) or (2, 1), held m/s^2 and rad/s^2."""
    time = case.step * np.arange(rudder.size)
    inputs = np.vstack([rudder, np.broadcast_to(pushes, (2, rudder.size))])
    if not case.is_drifting:
        Phi, Gamma = transition(vehicle, case)
        return _march(Phi, Gamma @ inputs, start)
    states, x = np.empty((4, rudder.size)), start
    factors = np.array(case.drift)
    for k in range(rudder.size):
        if k % round(1.0 / case.step) == 0:
            now = vehicle.copy()
            now[:5] *= 1.0 + (factors - 1.0) * time[k] / case.duration
            Phi, Gamma = transition(now, case)
        states[:, k] = x
        x = Phi @ x + Gamma @ inputs[:, k]
    return states


def transition(vehicle: Array, case: Case) -> tuple[Array, Array]:
    """Exact zero-order-hold matrices (4, 4) and (4, 3) for plane, heave trim and pitch trim."""
    a1, a2, a3, b1, b2, u0 = vehicle
    block = np.zeros((7, 7))
    block[0, [0, 1, 4, 5]] = a1, case.coupling, b1, 1.0
    block[1, [1, 2, 4, 6]] = a2, a3, b2, 1.0
    block[2, 1] = 1.0
    block[3, [0, 2]] = 1.0, -u0
    E = expm(block * case.step)
    return E[:4, :4], E[:4, 4:]


def _march(Phi: Array, pushes: Array, start: Array) -> Array:
    """x(k + 1) = Phi x(k) + pushes(k) for all k at once, in the modes of Phi."""
    values, modes = np.linalg.eig(Phi)
    inverse = np.linalg.inv(modes)
    own = inverse @ pushes
    first = inverse @ start
    states = np.empty((4, pushes.shape[1]), dtype=complex)
    for i in range(4):
        driven = np.concatenate([[first[i]], own[i, :-1]])
        states[i] = lfilter([1.0], [1.0, -values[i]], driven)
    return np.ascontiguousarray((modes @ states).real)


def _lost(rng: np.random.Generator, case: Case, rows: int) -> NDArray[np.bool_]:
    """Where each sensor gives nothing, (2, rows)."""
    if case.missing == 0.0:
        return np.zeros((2, rows), dtype=bool)
    if case.burst == 0.0:
        lost = rng.random((2, rows)) < case.missing
        return np.vstack([lost[:1], lost[:1]]) if case.loses_rows else lost
    length = max(1, round(case.burst / case.step))
    begins = case.missing / (1.0 - case.missing) / length
    lost = np.zeros((2, rows), dtype=bool)
    k = 0
    while k < rows:
        if rng.random() < begins:
            lost[:, k : k + length] = True
            k += length
        else:
            k += 1
    return lost
