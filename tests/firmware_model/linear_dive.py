"""Samples of the paper's vehicle with the rudder held between them, by the matrix exponential."""

import math

import numpy as np
from scipy.linalg import expm

from firmware_model import Sample

TRUTH = {"a1": -0.63084, "a2": -3.38699, "a3": -8.19858, "b1": 0.41385, "b2": -3.94120, "u0": 2.5}
PITCH_NOISE, DEPTH_NOISE = math.radians(0.1), 0.01


def held_levels(rng, count, step=0.1, amplitude=0.25):
    """Random rudder levels held for 1 to 8 s."""
    levels = []
    while len(levels) < count:
        levels += [rng.uniform(-amplitude, amplitude)] * max(1, round(rng.uniform(1.0, 8.0) / step))
    return np.array(levels[:count])


def transition(step=0.1, coupling=0.0, speed=TRUTH["u0"]):
    """Phi (4, 4) and Gamma (4,) of w, q, theta, zeta."""
    block = np.zeros((5, 5))
    block[0, [0, 1, 4]] = TRUTH["a1"], coupling, TRUTH["b1"]
    block[1, [1, 2, 4]] = TRUTH["a2"], TRUTH["a3"], TRUTH["b2"]
    block[2, 1] = 1.0
    block[3, [0, 2]] = 1.0, -speed
    E = expm(step * block)
    return E[:4, :4], E[:4, 4]


def dive(count, seed=0, *, step=0.1, noise=1.0, coupling=0.0, rudder=None, first=0, speeds=None):
    """Samples from instant `first` on; noise in units of 0.1 deg and 1 cm; `speeds` are measured if given."""
    rng = np.random.default_rng(seed)
    rudder = held_levels(rng, count, step) if rudder is None else rudder
    x = np.array([0.0, 0.0, 0.0, 20.0])
    Phi, Gamma = transition(step, coupling)
    samples = []
    for k in range(count):
        if speeds is not None:
            Phi, Gamma = transition(step, coupling, speeds[k])
        samples.append(
            Sample(
                t_us=round((first + k) * step * 1e6),
                depth=float(x[3] + noise * DEPTH_NOISE * rng.normal()),
                pitch=float(x[2] + noise * PITCH_NOISE * rng.normal()),
                rudder=float(rudder[k]),
                speed=math.nan if speeds is None else float(speeds[k]),
            )
        )
        x = Phi @ x + Gamma * rudder[k]
    return samples
