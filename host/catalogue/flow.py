"""How damping and the plane's force follow the flow past the hull, other than u and u^2."""

import casadi as ca

from host.dynamics.equations import Chain, Effect, Parameter

SLOWEST = 0.2  # of u0: the flow meets the fins of a vehicle that stands still at any angle


def _steady_damping(c: Chain) -> None:
    lacking = 1 - c.speed_ratio
    c.heave += c.p["heave_damping_steady"] * c.p["a1"] * lacking * c.w
    c.pitch += c.p["pitch_damping_steady"] * c.p["a2"] * lacking * c.q


def _cross_flow(c: Chain) -> None:
    # A plane that the flow meets at more than 45 deg has long stalled.
    across = ca.fmin(ca.fabs(c.w) / c.p["u0"], c.speed_ratio) ** 2
    c.heave += c.p["cross_flow_share"] * across * c.p["b1"] * c.plane
    c.pitch += c.p["cross_flow_share"] * across * c.p["b2"] * c.plane


def _fin_stall(c: Chain) -> None:
    """What the lift of the fins lacks where they meet the flow at a large angle."""
    p = c.p
    behind = -ca.sign(p["b2"])  # a plane that pitches nose-down turns into the flow as flow from below does
    ahead = p["u0"] * ca.fmax(c.speed_ratio, SLOWEST)
    angle = c.plane + behind * (c.w + p["fin_arm"] * c.q) / ahead
    beyond = (angle / p["fin_stall_angle"]) ** 2
    lost = p["fin_stall_loss"] * beyond / (1 + beyond) * angle * c.speed_ratio**2
    c.heave -= p["b1"] * lost
    c.pitch -= p["b2"] * lost


EFFECTS = (
    Effect(
        name="speed_independent_damping",
        slot="surge",
        parameters=(
            Parameter(
                name="heave_damping_steady", unit="1", lower=0, upper=1, meaning="share of a1 that stays"
            ),
            Parameter(
                name="pitch_damping_steady", unit="1", lower=0, upper=1, meaning="share of a2 that stays"
            ),
        ),
        sentence="Damping does not fall with the speed as lift does: a part of it is there at any speed.",
        equation="a1 u/u0 -> a1 [u/u0 + heave_damping_steady (1 - u/u0)], "
        "a2 u/u0 -> a2 [u/u0 + pitch_damping_steady (1 - u/u0)]",
        manoeuvre="the same plane steps at half and at full speed",
        probes=((1.0, 1.0),),
        sizes=("heave_damping_steady", "pitch_damping_steady"),
        force=_steady_damping,
        changes=("speed_loss",),
    ),
    Effect(
        name="plane_in_cross_flow",
        slot="actuator",
        parameters=(
            Parameter(name="cross_flow_share", unit="1", lower=0, upper=4, meaning="1 is the whole flow"),
        ),
        sentence="The plane's force follows the whole flow that it meets, heave and speed ahead together: it "
        "is larger while the hull heaves.",
        equation="b1, b2 ~ u^2 + cross_flow_share w^2",
        manoeuvre="full plane reversals, during which the hull heaves most",
        probes=((1.0,),),
        force=_cross_flow,
    ),
    Effect(
        name="fin_stall",
        slot="actuator",
        parameters=(
            Parameter(
                name="fin_stall_angle",
                unit="rad",
                lower=0.05,
                upper=1.5,
                meaning="half of it is lost there",
            ),
            Parameter(
                name="fin_stall_loss", unit="1", lower=0, upper=1, meaning="share of lift, lost far beyond"
            ),
            Parameter(name="fin_arm", unit="m", lower=0.05, upper=10, meaning="from the middle to the fins"),
        ),
        sentence="The fins stall by the angle at which they meet the flow, of which the plane is a part.",
        equation="w' = ... - b1 L, q' = ... - b2 L, L = (u/u0)^2 fin_stall_loss alpha r/(1 + r), "
        "r = (alpha/fin_stall_angle)^2, alpha = delta - sign(b2) (w + fin_arm q)/u",
        manoeuvre="full plane reversals, during which the hull heaves and turns most",
        probes=((0.4, 0.5, 1.0), (0.5, 1.0, 0.4), (0.5, 1.0, 2.0)),
        sizes=("fin_stall_loss",),
        force=_fin_stall,
    ),
)
