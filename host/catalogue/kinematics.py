"""How body velocities become depth, zeta' = ..."""

import casadi as ca

from host.dynamics.equations import Chain, Effect, Parameter


def _large_angle(c: Chain) -> None:
    full = c.w * (ca.cos(c.theta) - 1) - c.speed * (ca.sin(c.theta) - c.theta)
    c.climb += c.p["kinematics_share"] * full


EFFECTS = (
    Effect(
        name="large_angle_kinematics",
        slot="kinematics",
        parameters=(
            Parameter(name="kinematics_share", unit="1", lower=0, upper=2, meaning="1 is the full geometry"),
        ),
        sentence="At large pitch the depth rate is w cos(theta) - u sin(theta), not w - u theta.",
        equation="zeta' = (1 - k)(w - u theta) + k (w cos theta - u sin theta), k = kinematics_share",
        manoeuvre="climbs and dives at the largest pitch angle allowed",
        probes=((1.0,),),
        force=_large_angle,
        is_common=True,
    ),
)
