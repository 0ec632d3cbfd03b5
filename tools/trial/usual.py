"""What every real vehicle has beside whatever else is hidden."""

from dataclasses import replace

import numpy as np

from tools.trial.hidden import Hidden, Setting, draw_hidden

SHARES = {
    "heave_pitch_rate_coupling": (0.6, 0.9),
    "heave_quadratic_drag": (0.1, 0.5),
    "pitch_quadratic_damping": (0.03, 0.2),
    "munk_moment": (0.05, 0.3),
    "large_angle_restoring": (2 / 3, 2 / 3),  # just sin(pitch)
    "large_angle_kinematics": (2 / 3, 2 / 3),
    "speed_loss": (2 / 3, 2 / 3),  # just the balance of thrust and drag
    "actuator_lag": (0.03, 0.15),
}
"""Of the strongest ordinary size, from and to."""


def draw_usual(rng: np.random.Generator, setting: Setting, but: tuple[str, ...]) -> tuple[Hidden, ...]:
    """All of these but the named ones."""
    drawn = [
        replace(draw_hidden(rng, name, setting), strength=float(rng.uniform(*share)))
        for name, share in SHARES.items()
    ]
    return tuple(effect for effect in drawn if effect.name not in but)
