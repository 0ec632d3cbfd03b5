"""Draws an ordinary underwater vehicle: hull, speed and the linear coefficients that follow from them."""

from dataclasses import dataclass
from math import exp, log, pi

import numpy as np

from tools.sitl.hull import GRAVITY, Hull

WATER = 1025.0  # kg/m3


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return exp(float(rng.uniform(log(low), log(high))))


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """A hull under way; `length` in m, `speed` in m/s.

    derivatives   of the hull, that whoever fits such a vehicle to a recording finds anew
    is_whole      whether they are so many that what a fit of them leaves is foretold, not fitted
    """

    hull: Hull
    speed: float
    length: float
    derivatives: tuple[str, ...] = ("Zw", "Mq", "zb", "Zdelta", "Mdelta")
    is_whole: bool = False

    @property
    def heave_mass(self) -> float:
        """kg, with the added mass."""
        return self.hull.mass - self.hull.Zwdot

    @property
    def surge_mass(self) -> float:
        """kg, with the added mass."""
        return self.hull.mass - self.hull.Xudot

    @property
    def pitch_inertia(self) -> float:
        """kg m2, with the added inertia."""
        return self.hull.Iy - self.hull.Mqdot

    @property
    def coefficients(self) -> dict[str, float]:
        """The paper's coefficients (Yuan et al. 2025, Eq. 1-3), which hold exactly with every effect off."""
        hull, u = self.hull, self.speed
        return {
            "a1": hull.Zw * u / self.heave_mass,
            "a2": hull.Mq * u / self.pitch_inertia,
            "a3": -hull.zb * hull.weight / self.pitch_inertia,
            "b1": hull.Zdelta * u**2 / self.heave_mass,
            "b2": hull.Mdelta * u**2 / self.pitch_inertia,
            "u0": u,
        }


def draw_vehicle(rng: np.random.Generator) -> Vehicle:
    """1-300 kg, 5-10 diameters long, 0.8-4 m/s; derivatives scale with speed over length as hulls' do."""
    mass = log_uniform(rng, 1.0, 300.0)
    slenderness = rng.uniform(5.0, 10.0)
    length = float((mass / WATER * 4 / pi * slenderness**2) ** (1 / 3))
    speed = log_uniform(rng, 0.8, min(4.0, max(0.9, 3.0 * length)))
    turn = speed / length  # 1/s: hull lengths a second, to which all rates of a hull are proportional
    Zwdot = -mass * rng.uniform(0.7, 1.1)
    Xudot = -mass * rng.uniform(0.02, 0.1)
    Iy = mass * length**2 / 12 * rng.uniform(0.7, 1.2)
    Mqdot = -Iy * rng.uniform(0.5, 1.0)
    heave_mass, surge_mass, inertia = mass - Zwdot, mass - Xudot, Iy - Mqdot
    a1 = -turn * log_uniform(rng, 0.3, 2.0)
    a2 = -turn * log_uniform(rng, 1.0, 5.0)
    a3 = -GRAVITY * mass * length * log_uniform(rng, 0.004, 0.04) / inertia
    b2 = -(turn**2) * log_uniform(rng, 0.5, 4.0)
    Mdelta = b2 * inertia / speed**2
    Zdelta = Mdelta / (length * rng.uniform(0.3, 0.5)) * (-1.0 if rng.random() < 0.3 else 1.0)
    hull = Hull(
        mass=mass,
        Iy=Iy,
        zb=-a3 * inertia / (mass * GRAVITY),
        Xudot=Xudot,
        Zwdot=Zwdot,
        Mqdot=Mqdot,
        Xuu=-surge_mass / (2 * speed * log_uniform(rng, 5.0, 40.0)),
        Xdd=-abs(Zdelta) * rng.uniform(0.7, 2.0),
        Zw=a1 * heave_mass / speed,
        Zq=-surge_mass * rng.uniform(0.0, 0.6),
        Zdelta=Zdelta,
        Mq=a2 * inertia / speed,
        Mdelta=Mdelta,
    )
    return Vehicle(hull=hull, speed=speed, length=length)
