"""The vertical motion of the water and the pressure that goes with it."""

from dataclasses import dataclass
from itertools import pairwise
from math import cos, exp, pi, sin

import numpy as np

from tools.sitl.effects import Effects
from tools.sitl.hull import GRAVITY


@dataclass(frozen=True, slots=True, kw_only=True)
class Water:
    """At the vehicle: velocity m/s down, nose-up turning of the flow rad/s, pressure head m."""

    velocity: float = 0.0
    pitch_rate: float = 0.0
    head: float = 0.0


STILL = Water()


class Sea:
    """Current, one internal wave and deep-water waves from ahead (linear theory, Bretschneider spectrum).

    Wave of amplitude a, frequency s, number k = s^2/g, met at s + k u: eta = a cos(psi), upwards; the water
    at depth z goes down with a s exp(-k z) sin(psi), and the pressure head is a exp(-k z) cos(psi).
    """

    def __init__(self, effects: Effects, speed: float, rng: np.random.Generator) -> None:
        self.current = effects.vertical_current
        self.internal = effects.internal_wave
        self.internal_phase = rng.uniform(0.0, 2 * pi)
        waves = effects.surface_waves
        self.waves: list[tuple[float, float, float, float, float]] = []
        if waves.size > 0.0:
            peak = 2 * pi / waves.period_s
            edges = np.linspace(0.6 * peak, 2.4 * peak, waves.components + 1)
            for low, high in pairwise(edges.tolist()):
                omega = float(rng.uniform(low, high))
                density = 5 / 16 * waves.size**2 * peak**4 / omega**5 * exp(-1.25 * (peak / omega) ** 4)
                number = omega**2 / GRAVITY
                amplitude = (2 * density * (high - low)) ** 0.5
                phase = float(rng.uniform(0.0, 2 * pi))
                self.waves.append((amplitude, omega, number, omega + number * speed, phase))
        self.is_still = self.current == 0.0 and self.internal.size == 0.0 and not self.waves

    def water(self, t_s: float, depth: float) -> Water:
        """The water around the vehicle at one instant."""
        if self.is_still:
            return STILL
        velocity = self.current
        if self.internal.size != 0.0:
            velocity += self.internal.size * sin(2 * pi * t_s / self.internal.period_s + self.internal_phase)
        turning = head = 0.0
        for amplitude, omega, number, met, phase in self.waves:
            reach = amplitude * exp(-number * max(depth, 0.0))
            angle = met * t_s + phase
            velocity += reach * omega * sin(angle)
            # A point x ahead has the phase psi + k x; water that sinks faster ahead turns the hull nose down.
            turning -= reach * omega * number * cos(angle)
            head += reach * cos(angle)
        return Water(velocity=velocity, pitch_rate=turning, head=head)
