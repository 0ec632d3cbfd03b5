"""Forward speed, u' = ..."""

from host.equations import Chain, Effect, Parameter


def _speed_loss(c: Chain) -> None:
    loss, is_known = c.extra["speed_loss"], c.is_speed_known
    c.rates["speed_loss"] = -loss / c.p["speed_time"] - c.p["c_ud"] * c.plane**2
    c.speed = c.speed + loss * (1 - is_known)
    c.speed_ratio = c.speed / c.p["u0"]


EFFECTS = (
    Effect(
        name="speed_loss",
        slot="surge",
        parameters=(
            Parameter(
                name="speed_time", unit="s", lower=0.3, upper=200, meaning="recovery time of the speed"
            ),
            Parameter(name="c_ud", unit="m/s^2/rad^2", lower=-100, upper=500, meaning="drag of the plane"),
        ),
        sentence="The speed falls in manoeuvres: damping falls with it, the plane's force with its square.",
        equation="u' = -(u - u0)/speed_time - c_ud delta^2; a1, a2 ~ u/u0; b1, b2 ~ (u/u0)^2",
        manoeuvre="record the speed, or hold large plane angles for ten seconds and return to level",
        probes=((5.0, 2.0), (20.0, 1.0)),
        force=_speed_loss,
        state="speed_loss",
        initial=lambda c: 0 * c.zeta,
    ),
)
