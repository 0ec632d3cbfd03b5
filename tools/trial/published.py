"""Published vehicles, and vehicles like them.

Facts from the tables, but that a positive plane angle pitches the nose down, which sources print with either
sign, and that all are trimmed neutral, as what is hidden may be a buoyancy.
"""

from dataclasses import dataclass, replace

import numpy as np

from tools.trial.hidden import Hidden, Setting, draw_hidden
from tools.trial.vehicle import Vehicle
from tools.trial.whole_body import WholeHull, is_steady

NATIVE = (
    "heave_pitch_rate_coupling",
    "heave_quadratic_drag",
    "pitch_quadratic_damping",
    "drag_along_the_hull",
    "munk_moment",
    "large_angle_restoring",
    "large_angle_kinematics",
    "speed_loss",
    "surge_pitch_coupling",
    "heave_pitch_acceleration_coupling",
    "actuator_lag",
)
"""What they all have by themselves, by the catalogue's names."""
VARIED = (
    *("Iy", "zb", "Xudot", "Zwdot", "Mqdot", "Xuu", "Xdd", "Zw", "Zq", "Zdelta", "Mw", "Mq", "Mdelta"),
    *("Zww", "Zqq", "Mww", "Mqq", "cross_flow"),
)
REFITTED = (
    *("Zqdot", "Xuu", "Xdd", "zb", "Zw", "Zq", "Zdelta", "Mw", "Mq", "Mdelta"),
    *("Zww", "Zqq", "Mww", "Mqq", "cross_flow"),
)
"""By anybody who fits such a vehicle to a recording; masses only scale these."""
SPREAD = 0.1
OFF_CENTRE = 0.01  # of heave mass times length: no hull carries its water quite about its middle
SERVO = (0.03, 0.15)  # s
SLOW_STEP = 0.05  # s, of the integrator: the quickest of them, the LAUV, settles in 0.13 s
STEADY = ("net_buoyancy", "trim_moment", "vertical_current")


@dataclass(frozen=True, slots=True, kw_only=True)
class Published:
    """A vehicle with its usual speeds, m/s."""

    hull: WholeHull
    slowest: float
    fastest: float


def _remus_100() -> Published:
    """Prestero, Verification of a six-degree of freedom simulation model for the REMUS autonomous underwater
    vehicle, MIT 2001, Appendix C: 1.33 m.

    As printed its straight run is unstable from 0.6 m/s on. Here its fins, at x = -0.638 m with a lift of
    9.64 u (w - x q) + 9.64 u^2 delta, are 2.5 times as large, with which it is steady at any speed. The drag
    of the deflected planes is ours.
    """
    fins, lift, arm = 2.5, 9.64, 0.638
    more = (fins - 1.0) * lift
    hull = WholeHull(
        mass=30.48, Iy=3.45, zb=0.0196, length=1.33,
        Xudot=-0.93, Zwdot=-35.5, Zqdot=-1.93, Mwdot=-1.93, Mqdot=-4.88,
        Xuu=-1.62, Xdd=-fins * lift,
        Zw=-28.6 - more, Zq=-5.22 - more * arm, Zww=-131.0, Zqq=-0.632, Zdelta=-fins * lift,
        Mw=24.0 - more * arm, Mq=-2.0 - more * arm**2, Mww=3.18, Mqq=-188.0, Mdelta=-fins * 6.15,
    )  # fmt: skip
    return Published(hull=hull, slowest=1.2, fastest=2.2)


def _nps_auv_2() -> Published:
    """Healey and Lienard, Multivariable sliding mode control for autonomous diving and steering of unmanned
    underwater vehicles, IEEE J. Oceanic Eng. 18 (1993) 327-339: 5.3 m, 1.8 m/s.

    Non-dimensional by rho/2 = 500 kg/m3, length and speed. The table prints Mqdot = -1.7e-2, which would be
    26 times the inertia; the inverse of the mass matrix in Fossen's MSS (npsauv.m) was made with -1.7e-3, as
    is this. The cross-flow drag is that of a hull 1 m broad, as in MSS.
    """
    length, half_density = 5.3, 500.0
    area, volume = half_density * length**2, half_density * length**3
    hull = WholeHull(
        mass=5454.54, Iy=13587.0, zb=0.061, length=length, cross_flow=half_density * 0.6,
        Xudot=-7.6e-3 * volume, Zwdot=-2.4e-1 * volume, Zqdot=-6.8e-3 * volume * length,
        Mwdot=-6.8e-3 * volume * length, Mqdot=-1.7e-3 * volume * length**2,
        Xuu=-3.85e-3 * area, Xdd=-1.0e-2 * area,
        Zw=-3.0e-1 * area, Zq=-1.4e-1 * volume, Zdelta=-7.3e-2 * area,
        Mw=1.0e-1 * volume, Mq=-6.8e-2 * volume * length, Mdelta=-4.1e-2 * volume,
    )  # fmt: skip
    return Published(hull=hull, slowest=1.2, fastest=2.5)


def _dsrv() -> Published:
    """Deep submergence rescue vehicle: Healey, Marine vehicle dynamics lecture notes, NPS 1992, in Fossen,
    Handbook of Marine Craft Hydrodynamics and Motion Control, Wiley 2011 (MSS, DSRV.m): 5 m, 4.11 m/s.

    Non-dimensional by rho/2, length and speed; Mtheta = -0.156276/U^2 is the weight below the centre of
    buoyancy. Printed is the motion at constant speed with one coefficient for all of u q, so that m u q is
    taken off it here, and what the free surge takes from the inertia is added to Iy: linear motion is that of
    the source. Its planes are of the kind whose force goes with the dive. Surge is ours.
    """
    length, half_density = 5.0, 1025.0 / 2
    area, volume = half_density * length**2, half_density * length**3
    mass, Xudot = 0.036391 * volume, -0.002 * volume
    weight_arm = 0.156276 * volume
    zb = weight_arm / (mass * 9.80665)
    hull = WholeHull(
        mass=mass, Iy=0.001925 * volume * length**2 + (mass * zb) ** 2 / (mass - Xudot), zb=zb, length=length,
        Xudot=Xudot, Zwdot=-0.031545 * volume, Zqdot=-0.000130 * volume * length,
        Mwdot=-0.000146 * volume * length, Mqdot=-0.001573 * volume * length**2,
        Xuu=-0.003 * area, Xdd=-0.02 * area,
        Zw=-0.043938 * area, Zq=-0.017455 * volume - mass, Zdelta=0.027695 * area,
        Mw=0.011175 * volume, Mq=-0.01131 * volume * length, Mdelta=-0.012797 * volume,
    )  # fmt: skip
    return Published(hull=hull, slowest=2.5, fastest=4.5)


def _lauv() -> Published:
    """Da Silva, Terra, Martins and de Sousa, Modeling and simulation of the LAUV autonomous underwater
    vehicle, IEEE MMAR 2007: 1.08 m.

    Lift of the body, 11.0 u w at 0.302 m astern, and of the fins, 9.6 u (w - x q) at x = -0.4 m, join added
    mass in the products. Its linear damping was found at 1.43 m/s and is taken for proportional to the speed.
    The drag of the deflected planes is ours.
    """
    speed, body, body_arm, fins, arm = 1.43, 10.96, 0.302, 9.6, 0.4
    Xudot, Zwdot = -1.0, -16.0
    hull = WholeHull(
        mass=18.0, Iy=1.07, zb=0.01, length=1.08,
        Xudot=Xudot, Zwdot=Zwdot, Mqdot=-1.03,
        Xuu=-2.4 - 2.4 / speed, Xdd=-fins,
        Zw=-23.0 / speed - body - fins, Zq=-Xudot - 11.5 / speed - fins * arm,
        Zww=-80.0, Zqq=-0.3, Zdelta=-fins,
        Mw=Xudot - Zwdot + 3.1 / speed - body * body_arm - fins * arm, Mq=-9.7 / speed - fins * arm**2,
        Mww=1.5, Mqq=-9.1, Mdelta=-fins * arm,
    )  # fmt: skip
    return Published(hull=hull, slowest=1.0, fastest=1.8)


VEHICLES = {
    "REMUS 100": _remus_100(),
    "NPS AUV II": _nps_auv_2(),
    "DSRV": _dsrv(),
    "LAUV": _lauv(),
}


def draw_published(rng: np.random.Generator) -> tuple[str, Vehicle]:
    """One of them by name, and a steady vehicle of its kind, each derivative off by up to 10 %."""
    name = str(rng.choice(tuple(VEHICLES)))
    one = VEHICLES[name]
    while True:
        speed = float(rng.uniform(one.slowest, one.fastest))
        shares = rng.uniform(1.0 - SPREAD, 1.0 + SPREAD, len(VARIED)).tolist()
        varied = {part: getattr(one.hull, part) * share for part, share in zip(VARIED, shares, strict=True)}
        hull = replace(one.hull, **varied)
        beyond = OFF_CENTRE * (hull.mass - hull.Zwdot) * hull.length * float(rng.uniform(-1.0, 1.0))
        hull = replace(hull, Zqdot=hull.Zqdot + beyond, Mwdot=hull.Mwdot + beyond)
        if is_steady(hull, speed):
            known = tuple(part for part in REFITTED if getattr(hull, part) != 0.0)
            return name, Vehicle(hull=hull, speed=speed, length=hull.length, derivatives=known, is_whole=True)


def draw_servo(rng: np.random.Generator, setting: Setting) -> Hidden:
    """The lag of its servo, which every vehicle has."""
    servo = draw_hidden(rng, "actuator_lag", setting)
    return replace(servo, strength=float(rng.uniform(*SERVO)) / servo.size(setting))


def draw_steady(rng: np.random.Generator, setting: Setting) -> tuple[Hidden, ...]:
    """Constant forces, each a hundredth of its strongest, that a fit may put on the vehicle."""
    return tuple(replace(draw_hidden(rng, name, setting), strength=0.01) for name in STEADY)
