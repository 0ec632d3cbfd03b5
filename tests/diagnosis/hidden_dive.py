"""Recordings that hide one effect, integrated by scipy: nothing of the catalogue or of its integrator."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

from host.recordings.recording import Array, Recording

BASE = {"a1": -0.63084, "a2": -3.38699, "a3": -8.19858, "b1": 0.41385, "b2": -3.94120, "u0": 2.5}
RECOVERY, DRAG = 4.0, 8.0  # of the speed, s, and of the plane, m/s^2/rad^2
Extra = Callable[[float, Array, float], tuple[float, float, float]]


def nothing(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    """No hidden effect."""
    return 0.0, 0.0, 0.0


def hidden_dive(
    extra: Extra = nothing, *, seed: int = 0, duration: float = 90.0, noise: float = 1.0
) -> Recording:
    """A dive of the paper's vehicle; `extra` adds to w', q' and zeta'. `noise` scales that of the sensors."""
    rng = np.random.default_rng(seed)
    h, rows = 0.1, round(duration / 0.1)
    rudder, at = np.empty(rows), 0
    while at < rows:
        until = at + int(rng.uniform(10, 60))
        rudder[at:until] = rng.uniform(-0.25, 0.25)
        at = until
    x, states = np.array([0.0, 0.0, 0.0, 20.0]), np.empty((4, rows))
    for k in range(rows):
        states[:, k] = x

        def rate(time: float, x: Array, plane: float = rudder[k]) -> Array:
            w, q, theta, _ = x
            force, moment, climb = extra(time, x, plane)
            return np.array(
                [
                    BASE["a1"] * w + BASE["b1"] * plane + force,
                    BASE["a2"] * q + BASE["a3"] * theta + BASE["b2"] * plane + moment,
                    q,
                    w - BASE["u0"] * theta + climb,
                ]
            )

        x = solve_ivp(rate, (k * h, k * h + h), x, rtol=1e-8, atol=1e-10).y[:, -1]
    nan = np.full(rows, np.nan)
    return Recording(
        name="hidden.csv",
        sha256="0" * 64,
        time=np.arange(rows) * h,
        depth=states[3] + noise * 0.01 * rng.standard_normal(rows),
        pitch=states[2] + noise * np.deg2rad(0.1) * rng.standard_normal(rows),
        rudder=rudder,
        speed=nan,
        pitch_rate=nan,
        step=h,
    )


@cache
def slowing(noise: float, begins_at: float = BASE["u0"]) -> Recording:
    """A hull that the plane slows, its speed told with so much noise, m/s, from that at which it begins."""
    plain, rng = hidden_dive(duration=120.0), np.random.default_rng(5)
    x, states = np.array([0.0, 0.0, 0.0, 20.0, begins_at]), np.empty((5, plain.time.size))
    for k, plane in enumerate(plain.rudder.tolist()):
        states[:, k] = x

        def rate(_: float, x: Array, plane: float = plane) -> list[float]:
            w, q, theta, _, u = x
            ratio = u / BASE["u0"]
            return [
                BASE["a1"] * ratio * w + BASE["b1"] * ratio**2 * plane,
                BASE["a2"] * ratio * q + BASE["a3"] * theta + BASE["b2"] * ratio**2 * plane,
                q,
                w - u * theta,
                BASE["u0"] * (1.0 - ratio**2) / (2.0 * RECOVERY) - DRAG * (ratio * plane) ** 2,
            ]

        x = solve_ivp(rate, (0.0, plain.step), x, rtol=1e-8, atol=1e-10).y[:, -1]
    return replace(
        plain,
        depth=states[3] + 0.01 * rng.standard_normal(plain.time.size),
        pitch=states[2] + np.deg2rad(0.1) * rng.standard_normal(plain.time.size),
        speed=states[4] + noise * rng.standard_normal(plain.time.size),
    )
