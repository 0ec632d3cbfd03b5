"""Rudder movements, in rad or whatever unit the amplitude has, every h = 0.1 s."""

import numpy as np

from host.recordings.recording import Array

H = 0.1  # s, the paper's step
FREQUENCY = 0.01  # Hz, caption of the paper's Figure 1


def sine(amplitude: float, duration: float, phase: float = 0.0) -> Array:
    """The paper's input; its amplitude is not stated."""
    t = np.arange(round(duration / H) + 1) * H
    return np.asarray(amplitude * np.sin(2.0 * np.pi * FREQUENCY * t + phase))


def multistep(rng: np.random.Generator, duration: float, amplitude: float = 0.25) -> Array:
    """Random levels held for 1 to 8 s: persistently exciting, unlike one sine."""
    rudder = np.empty(round(duration / H) + 1)
    at = 0
    while at < rudder.size:
        until = at + int(rng.integers(10, 80))
        rudder[at:until] = rng.uniform(-amplitude, amplitude)
        at = until
    return rudder
