"""A hull with whole physics in the vertical plane, as published simulators of vehicles have it."""

from dataclasses import dataclass
from math import cos, sin

import numpy as np
import numpy.typing as npt

from tools.sitl.effects import Effects
from tools.sitl.hull import Hull, Hydrodynamics, Motion

STRIPS = 14
"""Along the hull, for its cross-flow drag: 1 % off the integral when the hull only turns."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WholeHull(Hull):
    """A hull about its centre of buoyancy, zb above the centre of gravity, as tables print it.

    Zw, Zq, Mw and Mq are the whole products of u w and u q: lift of body and fins, added mass, Munk moment.
    (m u q comes from the rigid body, which no table has among these.)
    """

    Zww: float = 0.0  # kg/m: heave force per w|w|
    Zqq: float = 0.0  # kg m: per q|q|
    Mww: float = 0.0  # kg: pitch moment per w|w|
    Mqq: float = 0.0  # kg m2: per q|q|
    cross_flow: float = 0.0  # kg/m2: drag of a metre of hull per squared cross flow, rho Cd breadth / 2
    length: float = 1.0  # m, over which that acts

    def body(self, effects: Effects, speed: float, start_depth: float) -> Hydrodynamics:
        return WholeBody(self, effects, speed, start_depth)


class WholeBody(Hydrodynamics):
    """Newton and Euler about the centre of buoyancy, with velocities relative to the water.

    (m - Xudot) u' + m zG q'   = T + Xuu u|u| + Xdd u^2 d^2 + (Zwdot - m) w q + Zqdot q^2 - (W - B) sin theta
    (m - Zwdot) w' - Zqdot q'  = Zw u w + (m + Zq) u q + Zww w|w| + Zqq q|q| + m zG q^2 + Zdelta u^2 d + Z_c
                                  + (W - B) cos theta
    (Iy - Mqdot) q' - Mwdot w' + m zG u'
                               = Mw u w + Mq u q + Mww w|w| + Mqq q|q| - m zG w q + Mdelta u^2 d + M_c
                                  - zG W sin theta + M_trim

    After Prestero, Verification of a six-degree of freedom simulation model for the REMUS autonomous
    underwater vehicle, MIT 2001, with Xwq = Zwdot and Xqq = Zqdot, as in an ideal fluid. Cross-flow drag:
    Z_c = -c int v|v| dx, M_c = c int x v|v| dx with v = w - x q over the length, c = rho Cd breadth / 2.

    Buoyancy and ballast come and go at the origin. Of the effects those that are switches for parts of the
    physics do nothing here, as all of it is on.
    """

    def __init__(self, hull: WholeHull, effects: Effects, speed: float, start_depth: float) -> None:
        super().__init__(hull, effects, speed, start_depth)
        self.whole = hull
        self.pendulum = hull.mass * hull.zb
        self.inverse = np.linalg.inv(
            [
                [self.surge_mass, 0.0, self.pendulum],
                [0.0, self.heave_mass, -hull.Zqdot],
                [self.pendulum, -hull.Mwdot, self.pitch_inertia],
            ]
        ).tolist()
        self.strip = hull.cross_flow * hull.length / STRIPS
        middles = (np.arange(STRIPS) + 0.5) / STRIPS - 0.5
        self.stations = (hull.length * middles).tolist() if hull.cross_flow > 0.0 else []

    def rates(
        self,
        motion: Motion,
        plane: float,
        t_s: float,
        water: float,
        water_pitch_rate: float,
    ) -> Motion:
        u, w, q, theta, depth = motion
        hull = self.whole
        sine, cosine = sin(theta), cos(theta)
        sunk, _ = self.net_weight(t_s, depth)
        turn = q - water_pitch_rate  # of the hull in the water
        dynamic = u * u * plane
        heaving, turning = w * abs(w), turn * abs(turn)
        drag, tilt = self.cross_flow(w, turn)
        X = (
            self.thrust
            + hull.Xuu * u * abs(u)
            + hull.Xdd * dynamic * plane
            - self.heave_mass * w * q
            + hull.Zqdot * q * q
            - sunk * sine
        )
        Z = (
            u * (hull.Zw * w + hull.mass * q + hull.Zq * turn)
            + hull.Zww * heaving
            + hull.Zqq * turning
            + self.pendulum * q * q
            + hull.Zdelta * dynamic
            + drag
            + sunk * cosine
        )
        M = (
            u * (hull.Mw * w + hull.Mq * turn)
            + hull.Mww * heaving
            + hull.Mqq * turning
            - self.pendulum * w * q
            + hull.Mdelta * dynamic
            + tilt
            - hull.zb * hull.weight * sine
            + self.trim
        )
        (xx, xz, xm), (zx, zz, zm), (mx, mz, mm) = self.inverse
        return (
            xx * X + xz * Z + xm * M,
            zx * X + zz * Z + zm * M,
            mx * X + mz * Z + mm * M,
            q,
            w * cosine - u * sine + water,
        )

    def cross_flow(self, w: float, turn: float) -> tuple[float, float]:
        """Heave force, N, and pitch moment, N m, of the drag across the hull."""
        force = moment = 0.0
        for station in self.stations:
            across = w - station * turn
            drag = across * abs(across)
            force -= drag
            moment += station * drag
        return self.strip * force, self.strip * moment


def straight_run(hull: Hull, speed: float) -> npt.NDArray[np.float64]:
    """(3, 4): how the rates of w, q and theta change with these and the plane, in a straight level run."""
    body = hull.body(Effects(), speed, 0.0)
    small = 1e-6
    columns = []
    for moved in range(4):
        w, q, theta, plane = (small * (moved == index) for index in range(4))
        rates = body.rates((speed, w, q, theta, 0.0), plane, 0.0, 0.0, 0.0)
        columns.append([rate / small for rate in rates[1:4]])
    return np.array(columns).T


def is_steady(hull: Hull, speed: float) -> bool:
    """Whether the vehicle returns to a straight level run by itself."""
    return bool(np.linalg.eigvals(straight_run(hull, speed)[:, :3]).real.max() < 0.0)
