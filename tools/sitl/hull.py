"""The body: its masses, its hydrodynamic derivatives and the forces and moments that they make."""

from dataclasses import dataclass
from math import cos, sin
from typing import Protocol

from tools.sitl.effects import Effects
from tools.sitl.strict import require

GRAVITY = 9.80665  # m/s2
HULL_HEIGHT = 0.3  # m, over which the buoyancy is lost when the hull leaves the water


@dataclass(frozen=True, slots=True, kw_only=True)
class Hull:
    """Rigid body and hydrodynamic derivatives about the centre of gravity; buoyancy acts above it.

    The defaults make a vehicle which at 2.5 m/s, with every effect off, has the coefficients of Table 1 of
    Yuan et al. 2025. (The sign of Zdelta is theirs too; an ordinary stern plane has the other one.)
    Zw u/(m - Zwdot) = -0.63084         Mq u/(Iy - Mqdot) = -3.38699         -m g zb/(Iy - Mqdot) = -8.19858
    Zdelta u^2/(m - Zwdot) = 0.41385    Mdelta u^2/(Iy - Mqdot) = -3.94120
    """

    mass: float = 70.0  # kg, neutrally buoyant
    Iy: float = 6.0  # kg m2
    zb: float = 0.119431814  # m, height of the centre of buoyancy above the centre of gravity
    Xudot: float = -5.0  # kg, added mass
    Zwdot: float = -75.0  # kg
    Zqdot: float = 0.0  # kg m
    Mwdot: float = 0.0  # kg m
    Mqdot: float = -4.0  # kg m2
    Xuu: float = -6.0  # kg/m, hull drag
    Xdd: float = -30.0  # kg/m per rad2, drag of a deflected plane
    Zw: float = -36.58872  # kg/m: heave force per u w
    Zq: float = -30.0  # kg: heave force per u q (acts with heave_pitch_rate_coupling)
    Zdelta: float = 9.60132  # kg/m per rad: heave force per u^2 delta
    Mw: float = 0.0  # kg: pitch moment per u w beyond the Munk moment
    Mq: float = -13.54796  # kg m
    Mdelta: float = -6.30592  # kg per rad

    def __post_init__(self) -> None:
        for name in ("mass", "Iy"):
            require(getattr(self, name) > 0.0, name, "be > 0", getattr(self, name))
        for name in ("Xudot", "Zwdot", "Mqdot", "Xuu", "Xdd"):
            require(getattr(self, name) <= 0.0, name, "be <= 0", getattr(self, name))
        inertia = (self.mass - self.Zwdot) * (self.Iy - self.Mqdot) - self.Zqdot * self.Mwdot
        require(inertia > 0.0, "Zqdot * Mwdot", "leave the inertia matrix positive definite", inertia)

    @property
    def weight(self) -> float:
        """N"""
        return self.mass * GRAVITY

    def body(self, effects: Effects, speed: float, start_depth: float) -> "Hydrodynamics":
        """The equations of motion of this hull, whose thrust balances its drag at `speed`."""
        return Hydrodynamics(self, effects, speed, start_depth)


Motion = tuple[float, float, float, float, float]
"""u, w, q (surge, heave, pitch rate through the water; body axes, z down), theta (nose up), depth (down)."""


class Body(Protocol):
    """Equations of motion."""

    def rates(
        self, motion: Motion, plane: float, t_s: float, water: float, water_pitch_rate: float
    ) -> Motion:
        """Time derivatives of the motion.

        plane             rad, deflection that makes force
        water             m/s, vertical velocity of the water, down
        water_pitch_rate  rad/s, nose-up turning of the water's motion along the hull
        """


class Hydrodynamics:
    """Newton and Euler in body axes, with velocities relative to the water.

        (m - Xudot) u'            = T + Xuu u|u| + Xdd u^2 d^2 - (m - Zwdot) w q - (W - B) sin theta
        (m - Zwdot) w' - Zqdot q' = (m - Xudot) u q + Zq u q + Zw u w - c_ww w|w| + Zdelta u^2 d
                                     + (W - B) cos theta
        (Iy - Mqdot) q' - Mwdot w' = (Xudot - Zwdot) u w + Mw u w + Mq u q - c_qq q|q| + Mdelta u^2 d
                                     - zb B sin theta + M_trim

    The thrust T balances the drag at the starting speed. The three products of velocities that come from the
    inertia do no work together, which the energy test relies on.
    """

    def __init__(self, hull: Hull, effects: Effects, speed: float, start_depth: float) -> None:
        self.hull = hull
        self.surge_mass = hull.mass - hull.Xudot
        self.heave_mass = hull.mass - hull.Zwdot
        self.pitch_inertia = hull.Iy - hull.Mqdot
        self.determinant = self.heave_mass * self.pitch_inertia - hull.Zqdot * hull.Mwdot
        self.thrust = -hull.Xuu * speed * abs(speed)
        self.surge_share = effects.speed_loss
        self.coupling = effects.heave_pitch_rate_coupling * (self.surge_mass + hull.Zq)
        self.munk = effects.munk_moment * (hull.Xudot - hull.Zwdot) + hull.Mw
        self.heave_drag = effects.heave_quadratic_drag
        self.pitch_drag = effects.pitch_quadratic_damping
        self.trim = effects.trim_moment
        self.restoring = effects.large_angle_restoring
        self.kinematics = effects.large_angle_kinematics
        self.buoyancy = hull.weight + effects.net_buoyancy
        self.compression = effects.depth_dependent_buoyancy
        self.start_depth = start_depth
        self.ballast = effects.ballast_change

    def net_weight(self, t_s: float, depth: float) -> tuple[float, float]:
        """W - B and B, in N."""
        weight = self.hull.weight
        if self.ballast.size != 0.0 and t_s >= self.ballast.at_s:
            weight += self.ballast.size * GRAVITY
        buoyancy = self.buoyancy - self.compression * (depth - self.start_depth)
        if depth < 0.0:
            buoyancy *= max(1.0 + depth / HULL_HEIGHT, 0.0)
        return weight - buoyancy, buoyancy

    def rates(
        self, motion: Motion, plane: float, t_s: float, water: float, water_pitch_rate: float
    ) -> Motion:
        """Time derivatives of the motion, as of every body."""
        u, w, q, theta, depth = motion
        hull = self.hull
        sine, cosine = sin(theta), cos(theta)
        sunk, buoyancy = self.net_weight(t_s, depth)
        relative_q = q - water_pitch_rate
        dynamic = u * u * plane
        heave = (
            u * (self.coupling * q + hull.Zw * w)
            - self.heave_drag * w * abs(w)
            + hull.Zdelta * dynamic
            + sunk * cosine
        )
        pitch = (
            u * (self.munk * w + hull.Mq * relative_q)
            - self.pitch_drag * relative_q * abs(relative_q)
            + hull.Mdelta * dynamic
            - hull.zb * buoyancy * (theta + self.restoring * (sine - theta))
            + self.trim
        )
        surge_rate = 0.0
        if self.surge_share != 0.0:
            drag = hull.Xuu * u * abs(u) + hull.Xdd * dynamic * plane
            surge = self.thrust + drag - self.heave_mass * w * q - sunk * sine
            surge_rate = self.surge_share * surge / self.surge_mass
        level = w - u * theta
        climb = level + self.kinematics * (w * cosine - u * sine - level)
        return (
            surge_rate,
            (self.pitch_inertia * heave + hull.Zqdot * pitch) / self.determinant,
            (self.heave_mass * pitch + hull.Mwdot * heave) / self.determinant,
            q,
            climb + water,
        )
