"""Forces in heave, w' = ..."""

import casadi as ca

from host.catalogue import weight
from host.catalogue.gravity import GRAVITY
from host.dynamics.equations import Chain, Effect, Parameter

HEAVE_OVER_WEIGHT = 1.9
"""Mass that a slender hull moves in heave, the water about it included, over its own (Fossen, Handbook of
Marine Craft Hydrodynamics and Motion Control, ch. 8)."""


def _coupling(c: Chain) -> None:
    c.heave += c.p["c_wq"] * c.speed_ratio * c.q


def _drag(c: Chain) -> None:
    c.heave += c.p["c_ww"] * c.w * ca.fabs(c.w)


def _buoyancy(c: Chain) -> None:
    c.heave += weight.constant(c) * ca.cos(c.theta)


def _compressibility(c: Chain) -> None:
    lost = weight.compressed(c)
    c.heave += lost * ca.cos(c.theta)
    # What rights the hull is its buoyancy, too (which the weight equals, but for little).
    c.pitch -= HEAVE_OVER_WEIGHT * lost / GRAVITY * c.p["a3"] * ca.sin(c.theta)


def _ballast(c: Chain) -> None:
    c.heave += weight.ballast(c) * ca.cos(c.theta)


def _acceleration(c: Chain) -> None:
    c.heave += c.p["c_wa"] * (c.turning + c.pitch)


EFFECTS = (
    Effect(
        name="heave_pitch_rate_coupling",
        slot="heave",
        parameters=(
            Parameter(
                name="c_wq", unit="m/s", lower=-20, upper=20, meaning="pitch rate into heave", speed_power=1
            ),
        ),
        sentence="Pitching at a forward speed throws the hull sideways: the pitch rate drives heave "
        "(centripetal term m u q and Zq q), which the base model leaves out.",
        equation="w' = ... + c_wq (u/u0) q",
        manoeuvre="quick plane reversals (3-2-1-1) at cruising speed, which make the pitch rate large",
        probes=((0.5,), (-0.5,)),
        scales=("",),
        force=_coupling,
        is_common=True,
    ),
    Effect(
        name="heave_quadratic_drag",
        slot="heave",
        parameters=(Parameter(name="c_ww", unit="1/m", lower=-50, upper=0, meaning="cross-flow drag"),),
        sentence="Cross-flow drag in heave grows with the square of the heave velocity.",
        equation="w' = ... + c_ww w |w|",
        manoeuvre="plane steps of several sizes, the largest held for five heave time constants",
        probes=((-1.0,),),
        force=_drag,
        is_common=True,
    ),
    Effect(
        name="net_buoyancy",
        slot="heave",
        parameters=(
            Parameter(name="c_w0", unit="m/s^2", lower=-5, upper=5, meaning="net weight per heave mass"),
        ),
        sentence="The vehicle is not neutral: weight and buoyancy differ by a constant force.",
        equation="w' = ... + c_w0 cos theta",
        manoeuvre="a start from rest with the planes level, or a change of speed",
        probes=((0.0,),),
        force=_buoyancy,
        is_common=True,
    ),
    Effect(
        name="depth_dependent_buoyancy",
        slot="heave",
        parameters=(
            Parameter(name="c_wz", unit="1/s^2", lower=-1, upper=1, meaning="buoyancy change with depth"),
            Parameter(
                name="neutral_depth", unit="m", lower=-1000, upper=6000, meaning="depth of neutral trim"
            ),
        ),
        sentence="Buoyancy changes with depth: the hull or the water is compressed.",
        equation="w' = ... + c_wz (zeta - neutral_depth) cos theta; a3 ~ buoyancy",
        manoeuvre="long straight runs at the shallowest and the deepest depth of the mission",
        probes=((1e-3, 1.0), (1e-5, 1.0)),  # alone; and beside what leaves little of it to tell
        scales=("", "depth"),
        force=_compressibility,
    ),
    Effect(
        name="ballast_change",
        slot="heave",
        parameters=(
            Parameter(name="c_wb", unit="m/s^2", lower=-5, upper=5, meaning="step of net weight"),
            Parameter(name="ballast_time", unit="s", lower=0, upper=1e6, meaning="when it happened"),
        ),
        sentence="The weight changed at one moment: ballast was dropped, or water came in.",
        equation="w' = ... + c_wb cos theta (t > ballast_time)",
        manoeuvre="straight level runs before and after",
        probes=((0.0, 0.5),),
        scales=("", "duration"),
        force=_ballast,
    ),
)

BY_TURNING = (
    Effect(
        name="heave_pitch_acceleration_coupling",
        slot="heave",
        parameters=(
            Parameter(name="c_wa", unit="m/rad", lower=-1, upper=1, meaning="pitch acceleration into heave"),
        ),
        sentence="Turning the hull throws it sideways: its centre of gravity, or the water it carries along, "
        "lies ahead or astern of the reference point (m xG + Zq').",
        equation="w' = ... + c_wa q'",
        manoeuvre="quick plane reversals, then climbs and dives held until the pitch has settled",
        probes=((0.05,), (-0.05,)),
        force=_acceleration,
        beside="heave_pitch_rate_coupling",
    ),
)
"""What follows from q', whatever turns the hull."""
