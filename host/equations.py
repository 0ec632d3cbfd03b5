"""The vehicle's continuous-time equations, written once as CasADi expressions.

    w'     = a1 w + b1 delta + heave_offset
    q'     = a2 q + a3 theta + b2 delta + pitch_offset
    theta' = q
    zeta'  = w - u theta,    u = measured speed, or the constant u0 where no speed is measured

Source: Yuan et al., J. Mar. Sci. Eng. 2025, 13, 1489, Eq. 1-3; the two offsets stand for an imperfect trim.
"""

from dataclasses import dataclass

import casadi as ca

STATES = ("w", "q", "theta", "zeta")


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A coefficient of the equations, its unit, and the bounds no underwater vehicle exceeds."""

    name: str
    unit: str
    lower: float
    upper: float
    meaning: str


PARAMETERS = (
    Parameter(name="a1", unit="1/s", lower=-50.0, upper=-1e-4, meaning="heave damping"),
    Parameter(name="a2", unit="1/s", lower=-100.0, upper=-1e-4, meaning="pitch damping"),
    Parameter(name="a3", unit="1/s^2", lower=-1000.0, upper=5.0, meaning="pitch restoring"),
    Parameter(name="b1", unit="m/s^2/rad", lower=-100.0, upper=100.0, meaning="plane force in heave"),
    Parameter(name="b2", unit="1/s^2", lower=-1000.0, upper=1000.0, meaning="plane moment in pitch"),
    Parameter(name="u0", unit="m/s", lower=0.0, upper=20.0, meaning="forward speed"),
    Parameter(name="heave_offset", unit="m/s^2", lower=-5.0, upper=5.0, meaning="trim force in heave"),
    Parameter(name="pitch_offset", unit="rad/s^2", lower=-20.0, upper=20.0, meaning="trim moment in pitch"),
)
NAMES = tuple(parameter.name for parameter in PARAMETERS)


def derivative(x: ca.SX, parameters: ca.SX, rudder: ca.SX, speed: ca.SX, is_speed_known: ca.SX) -> ca.SX:
    """State derivative of [w, q, theta, zeta], SI; `parameters` in the order of NAMES; the flag is 0 or 1."""
    w, q, theta, _ = ca.vertsplit(x)
    a1, a2, a3, b1, b2, u0, heave_offset, pitch_offset = ca.vertsplit(parameters)
    return ca.vertcat(
        a1 * w + b1 * rudder + heave_offset,
        a2 * q + a3 * theta + b2 * rudder + pitch_offset,
        q,
        w - (u0 * (1 - is_speed_known) + speed * is_speed_known) * theta,
    )


def outputs(x: ca.SX) -> ca.SX:
    """What the sensors see: [pitch, depth]."""
    return ca.vertcat(x[2], x[3])
