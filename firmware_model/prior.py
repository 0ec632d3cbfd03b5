"""What is thought of a vehicle before its first sample, and what it can be at all.

Time goes with the pitch time T, length with the configured speed and T, the plane with its typical movement;
so one set of numbers serves vehicles of all sizes.
"""

import math

from firmware_model.config import EstimatorConfig
from firmware_model.propagation import (
    A1,
    A2,
    A3,
    B1,
    B2,
    COUNT,
    GAMMA,
    HEAVE_TRIM,
    KAPPA,
    PITCH_TRIM,
    THETA,
    ZETA,
    Q,
    W,
)


class Prior:
    """Means and standard deviations of the extended state, bounds of a stable vehicle, sizes of unknown
    forces.

    mean, variance  by entry
    coupling        variance of c_wq, (m/s)^2
    lower, upper    of a1, a2, a3 by entry
    caution         most that the second-order variance may add in heave and pitch, as densities
    forces          densities of unknown forces at the start, in heave (m/s^2)^2 s and pitch (rad/s^2)^2 s
    """

    def __init__(self, config: EstimatorConfig) -> None:
        own, T, speed = config.robust, config.pitch_time, config.speed
        plane = 0.25 / own.typical_rudder
        speed_std = 0.5 * speed if own.speed_std is None else own.speed_std
        self.coupling = 0.25 * speed * speed
        self.mean = [0.0] * COUNT
        self.mean[A1], self.mean[A2], self.mean[A3] = -1.0 / T, -3.0 / T, -5.0 / (T * T)
        std = [0.0] * COUNT
        std[A1], std[A2], std[A3] = 1.0 / T, 3.0 / T, 5.0 / (T * T)
        std[B1], std[B2] = 0.5 * plane * speed / T, 5.0 * plane / (T * T)
        std[KAPPA] = math.sqrt(
            speed_std * speed_std + (self.coupling if own.heave_pitch_rate_coupling else 0.0)
        )
        std[GAMMA] = 1.5 * speed_std / T
        std[HEAVE_TRIM], std[PITCH_TRIM] = 0.05 * speed / T, 0.3 / (T * T)
        std[W], std[Q] = 0.25 * speed, 0.5 / T
        std[THETA], std[ZETA] = 0.3, 2.5 * speed * T
        self.variance = [value * value for value in std]
        self.lower = {A1: -20.0 / T, A2: -20.0 / T, A3: -200.0 / (T * T)}
        self.upper = {A1: -0.02 / T, A2: -0.05 / T, A3: -0.05 / (T * T)}
        heave, pitch = speed * speed / T, 1.0 / (T * T * T)
        self.caution = (0.0125 * heave, 0.02 * pitch)
        # Small: what is not known yet adds its own noise, and true forces soon raise the level.
        self.forces = (2.5e-6 * heave, 4e-5 * pitch)
