"""What is likely of the speed a run begins with, before the recording is seen.

Most recordings begin in steady flight, a few far from it: after a launch, or within a manoeuvre. The
excess e = u / u0 - 1 is held to little, and to hardly anything once it is much,

    -log p(e) = A e^2 / (s^2 + e^2) + constant,

so that a slow beginning must pay as an effect does that seldom acts, and is believed where the motion tells
it clearly, but does not do the work of other physics. All else that a run begins with may be anything.
"""

import numpy as np

from host.dynamics.propagate import NX0
from host.recordings.recording import Array

SCALE = 0.05  # s: half of the price is paid there
PRICE = 13.0  # A, of the log-likelihood: that of a parameter, and what else a rare effect must pay
EXCESS = NX0 - 1


def start_cost(initial: list[Array]) -> float:
    """-log p of what the runs begin with (5,), 0 in steady flight."""
    squares = np.array([x0[EXCESS] ** 2 for x0 in initial])
    return float(np.sum(PRICE * squares / (SCALE**2 + squares)))


def start_normal(x0: Array) -> tuple[Array, Array]:
    """Information (5, 5) and score (5,) of the prior for a Gauss-Newton step.

    The weight 2 A s^2 / (s^2 + e^2)^2 is that of the parabola which touches -log p at e and lies above it.
    """
    information, score = np.zeros((NX0, NX0)), np.zeros(NX0)
    excess = x0[EXCESS]
    weight = 2.0 * PRICE * SCALE**2 / (SCALE**2 + excess**2) ** 2
    information[EXCESS, EXCESS], score[EXCESS] = weight, -weight * excess
    return information, score
