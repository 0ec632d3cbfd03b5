"""A stretch of a recording that begins before the vehicle is back at its speed, which nothing measures."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from host.catalogue import structure_of
from host.gauss_newton import Point
from host.output_error import output_error
from host.propagate import inputs_of
from host.recording import Recording

BASE = {"a1": -0.9, "a2": -1.7, "a3": -0.5, "b1": -0.3, "b2": -1.2, "u0": 1.5}
LOSS = {"speed_time": 15.0, "c_ud": 0.8, "c_uq": 1.2}
PITCH_NOISE, DEPTH_NOISE = np.deg2rad(0.05), 0.005


def slow_dive(begins_at: float) -> Recording:
    """60 s at 10 Hz of a vehicle that begins at this speed, m/s, by an adaptive integrator."""
    rng = np.random.default_rng(5)
    rudder = np.repeat(rng.uniform(-0.25, 0.25, 24), 25)

    def rate(_: float, x: NDArray[np.float64], plane: float) -> list[float]:
        w, q, theta, _, u = x
        share = u / BASE["u0"]
        return [
            BASE["a1"] * share * w + BASE["b1"] * share**2 * plane,
            BASE["a2"] * share * q + BASE["a3"] * theta + BASE["b2"] * share**2 * plane,
            q,
            w - u * theta,
            -(u**2 - BASE["u0"] ** 2) / (2.0 * BASE["u0"] * LOSS["speed_time"])
            - LOSS["c_ud"] * (share * plane) ** 2
            - LOSS["c_uq"] * w * q,
        ]

    x, states = np.array([0.0, 0.0, 0.0, 20.0, begins_at]), np.empty((5, rudder.size))
    for k, plane in enumerate(rudder):
        states[:, k] = x
        x = solve_ivp(rate, (0.0, 0.1), x, args=(plane,), rtol=1e-8, atol=1e-10).y[:, -1]
    blank = np.full(rudder.size, np.nan)
    return Recording(
        name="slow", sha256="0" * 64, step=0.1, time=200.0 + 0.1 * np.arange(rudder.size), rudder=rudder,
        speed=blank, pitch_rate=blank,
        pitch=states[2] + PITCH_NOISE * rng.standard_normal(rudder.size),
        depth=states[3] + DEPTH_NOISE * rng.standard_normal(rudder.size),
    )  # fmt: skip


@pytest.mark.parametrize("begins_at", [0.6, 1.5])
def test_the_speed_at_the_first_row_is_found(begins_at: float) -> None:
    structure = structure_of(("speed_loss",))
    true = {**BASE, **LOSS, "heave_offset": 0.0, "pitch_offset": 0.0}
    values = np.array([true[name] for name in structure.names])
    start = Point(structure, 1.1 * values, [np.array([0.0, 0.0, 0.0, 20.0, 0.0])], np.zeros(4))
    fit = output_error(start, [inputs_of(slow_dive(begins_at), structure)], np.ones(values.size, dtype=bool))
    assert fit.converged
    assert np.sqrt(fit.noise[:2]) == pytest.approx([PITCH_NOISE, DEPTH_NOISE], rel=0.05)
    assert fit.parameters[structure.names.index("u0")] * (1.0 + fit.initial[0][4]) == pytest.approx(
        begins_at, abs=0.05
    )
    deviation = np.sqrt(np.diag(np.linalg.inv(fit.information)))
    assert (np.abs(fit.parameters - values) < 4.0 * deviation).all()
