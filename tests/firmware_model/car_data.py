"""Signals of the paper's vehicle, made by its own CAR equations."""

import numpy as np

from firmware_model import car_from_physical

TABLE_1 = {"a1": -0.63084, "a2": -3.38699, "a3": -8.19858, "b1": 0.41385, "b2": -3.94120}
SPEED = 2.5
STEP = 0.1
ALPHA, BETA = car_from_physical(**TABLE_1, u0=SPEED, h=STEP)


def random_rudder(rng, count, amplitude=0.25):
    """Random levels held for 1 to 8 s, after four instants at rest from which all signals start."""
    levels = [0.0] * 4
    while len(levels) < count:
        levels += [rng.uniform(-amplitude, amplitude)] * int(rng.integers(10, 80))
    return np.array(levels[:count])


def car_signals(rudder, rng=None, pitch_noise=0.0, depth_noise=0.0):
    """Pitch (rad) and depth (m) with white noise in the CAR equations."""
    count = len(rudder)
    v1, v2 = rng.normal(size=(2, count)) if rng is not None else np.zeros((2, count))
    pitch, depth = np.zeros(count), np.zeros(count)
    for k in range(4, count):
        pitch[k] = -ALPHA[0] * pitch[k - 1] - ALPHA[1] * pitch[k - 2] + ALPHA[2] * rudder[k - 2]
        pitch[k] += pitch_noise * v1[k]
        depth[k] = -sum(BETA[i] * depth[k - 1 - i] for i in range(4))
        depth[k] += sum(BETA[4 + i] * rudder[k - 2 - i] for i in range(3)) + depth_noise * v2[k]
    return pitch, depth


def pitch_rows(pitch, rudder):
    k = np.arange(2, len(pitch))
    return np.column_stack([-pitch[k - 1], -pitch[k - 2], rudder[k - 2]]), pitch[k]


def depth_rows(depth, rudder):
    k = np.arange(4, len(depth))
    lagged = [-depth[k - i] for i in (1, 2, 3, 4)] + [rudder[k - i] for i in (2, 3, 4)]
    return np.column_stack(lagged), depth[k]
