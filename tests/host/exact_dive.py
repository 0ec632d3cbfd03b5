"""Recordings of the linear vehicle by the exact matrix exponential: ground truth for identification tests."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from host.recordings.recording import Array, Recording

TABLE_1 = {"a1": -0.63084, "a2": -3.38699, "a3": -8.19858, "b1": 0.41385, "b2": -3.94120, "u0": 2.5}
"""The paper's vehicle (Table 1 with u0 = 2.5 m/s)."""


@dataclass(frozen=True, kw_only=True)
class Dive:
    """What is flown; everything in SI."""

    seed: int = 0
    step: float = 0.1
    duration: float = 120.0
    vehicle: tuple[float, ...] = tuple(TABLE_1.values())
    offsets: tuple[float, float] = (0.0, 0.0)
    pitch_noise: float = float(np.deg2rad(0.1))
    depth_noise: float = 0.01
    force_density: tuple[float, float] = (0.0, 0.0)
    missing: float = 0.0
    amplitude: float = 0.25
    start: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 20.0)
    speed: Array | None = None
    rudder: Array | None = None


def multistep(rng: np.random.Generator, rows: int, step: float, amplitude: float) -> Array:
    """Random levels held for 1 to 8 s."""
    rudder, at = np.empty(rows), 0
    while at < rows:
        until = at + max(1, int(rng.uniform(1.0, 8.0) / step))
        rudder[at:until] = rng.uniform(-amplitude, amplitude)
        at = until
    return rudder


def fly(dive: Dive) -> tuple[Recording, Array]:
    """The recording, and the noise-free states [w, q, theta, zeta] (4, N)."""
    rng = np.random.default_rng(dive.seed)
    rows = round(dive.duration / dive.step)
    rudder = multistep(rng, rows, dive.step, dive.amplitude) if dive.rudder is None else dive.rudder
    speed = np.full(rows, dive.vehicle[5]) if dive.speed is None else dive.speed
    kicks = rng.standard_normal((2, rows)) * np.sqrt(np.array(dive.force_density)[:, None] * dive.step)
    states, x = np.empty((4, rows)), np.array(dive.start)
    matrices = {u: _transition(dive, u) for u in np.unique(speed)}
    for k in range(rows):
        states[:, k] = x
        x = (matrices[speed[k]] @ np.concatenate([x, [rudder[k], 1.0]]))[:4]
        x[:2] += kicks[:, k]
    pitch = states[2] + rng.standard_normal(rows) * dive.pitch_noise
    depth = states[3] + rng.standard_normal(rows) * dive.depth_noise
    for channel in (pitch, depth):
        channel[rng.random(rows) < dive.missing] = np.nan
    recording = Recording(
        name=f"dive{dive.seed}",
        sha256="0" * 64,
        time=np.arange(rows) * dive.step,
        depth=depth,
        pitch=pitch,
        rudder=rudder,
        speed=np.full(rows, np.nan) if dive.speed is None else speed,
        pitch_rate=np.full(rows, np.nan),
        step=dive.step,
    )
    return recording, states


def _transition(dive: Dive, u: float) -> Array:
    a1, a2, a3, b1, b2, _ = dive.vehicle
    force, moment = dive.offsets
    A = np.zeros((6, 6))
    A[0, [0, 4, 5]] = a1, b1, force
    A[1, [1, 2, 4, 5]] = a2, a3, b2, moment
    A[2, 1] = 1.0
    A[3, [0, 2]] = 1.0, -u
    return np.asarray(expm(A * dive.step))
