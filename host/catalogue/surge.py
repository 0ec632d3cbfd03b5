"""Forward speed, u' = ..."""

import casadi as ca

from host.catalogue.weight import net_weight
from host.dynamics.equations import Chain, Effect, Parameter

MINUTE = 60.0  # s


def _speed_loss(c: Chain) -> None:
    change, known, before = c.extra["speed_loss"], c.is_speed_known, c.speed
    is_corrected = "speed_gain" in c.p
    # Counted from u0 where a measured speed is corrected; else what is measured stays as it is.
    c.speed = before + change * (1 - known) + (c.p["u0"] + change - before) * known * is_corrected
    c.speed_ratio = c.speed / c.p["u0"]
    balance = c.extra["balance"] * known if is_corrected else 0
    rate = (
        -(change - balance) * (1 + c.speed_ratio) / 2 / c.p["speed_time"]
        - c.p["c_ud"] * (c.speed_ratio * c.plane) ** 2
        # Both are known per heave mass; c_uq makes them accelerations of the surge mass.
        - c.p["c_uq"] * (c.w * c.q + net_weight(c) * ca.sin(c.theta))
    )
    if is_corrected:
        error = (before - c.speed) * known
        c.rates["balance"] = error / MINUTE
        rate += c.p["speed_gain"] * error
    c.rates["speed_loss"] = rate
    c.surge = rate if is_corrected else c.surge + rate * (1 - known)


def _begins(c: Chain) -> ca.SX:
    """At the measured speed, where it is corrected; else as far off steady flight as the motion tells."""
    found = c.p["u0"] * c.excess * (1 - c.is_speed_known)
    return found + (c.speed - c.p["u0"]) * c.is_speed_known if "speed_gain" in c.p else found


EFFECTS = (
    Effect(
        name="speed_loss",
        slot="surge",
        parameters=(
            Parameter(
                name="speed_time",
                unit="s",
                lower=0.3,
                upper=1000,
                meaning="recovery time of the speed",
                speed_power=-1,
            ),
            Parameter(
                name="c_ud",
                unit="m/s^2/rad^2",
                lower=0,
                upper=500,
                meaning="drag of the plane",
                speed_power=2,
            ),
            Parameter(name="c_uq", unit="1", lower=0, upper=20, meaning="heave mass over surge mass"),
        ),
        sentence="The speed falls in manoeuvres: damping falls with it, the plane's force with its square.",
        equation="u' = -(u^2 - u0^2)/(2 u0 speed_time) - c_ud (u/u0)^2 delta^2 - "
        "c_uq (w q + net weight sin theta); a1, a2 ~ u; b1, b2 ~ u^2",
        manoeuvre="record the speed, or hold large plane angles for ten seconds and return to level",
        probes=((5.0, 0.0, 0.0), (30.0, 0.0, 0.0), (150.0, 0.0, 0.0)),
        sizes=("c_ud", "c_uq"),
        force=_speed_loss,
        state="speed_loss",
        initial=_begins,
    ),
)
