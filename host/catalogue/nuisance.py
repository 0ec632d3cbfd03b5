"""What hides the physics left out while it is unknown: no catalogue entries, but tools of the search."""

from host.dynamics.equations import Chain, Effect, Parameter


def _free_trim(c: Chain) -> None:
    c.heave += c.p["trim_heave"]
    c.pitch += c.p["trim_pitch"]


FREE_TRIM = Effect(
    name="free_trim",
    slot="heave",
    parameters=(
        Parameter(name="trim_heave", unit="m/s^2", lower=-5, upper=5, meaning="constant heave force"),
        Parameter(name="trim_pitch", unit="rad/s^2", lower=-20, upper=20, meaning="constant moment"),
    ),
    sentence="A constant force and a constant moment act, of whatever cause.",
    equation="w' = ... + trim_heave, q' = ... + trim_pitch",
    manoeuvre="straight level flight",
    probes=((0.0, 0.0),),
    force=_free_trim,
    is_common=True,
)
"""Two constants that no vehicle is free of: while they are free, no other effect need imitate them.

Which of the catalogue's offsets they stand for is asked once the motion is explained.
"""

PLANE_BEFORE = Effect(
    name="plane_before",
    slot="actuator",
    parameters=(
        Parameter(name="plane_before", unit="rad", lower=-2, upper=2, meaning="plane before the recording"),
    ),
    sentence="The plane had another angle before the recording began.",
    equation="command(t < 0) = plane_before",
    manoeuvre="a recording that begins with the plane at rest",
    probes=((0.0,),),
    sizes=(),
    is_common=True,
)
"""Where a recording begins as the plane is put over, a servo, a delay or play still have it elsewhere."""

SPEED_CORRECTION = Effect(
    name="speed_correction",
    slot="surge",
    parameters=(
        Parameter(
            name="speed_gain", unit="1/s", lower=0.02, upper=5, meaning="how fast readings correct the speed"
        ),
        Parameter(
            name="balanced_share", unit="1", lower=0.7, upper=1.5, meaning="thrust's speed over u0, at first"
        ),
    ),
    sentence="The measured speed errs: how thrust, drag and weight change it tells more than each reading.",
    equation="u' = (the surge equation of speed_loss, about b instead of u0) + speed_gain (u measured - u), "
    "b' = (u measured - u)/60 s, b(0) = balanced_share u0",
    manoeuvre="a recording with a more precise speed sensor",
    probes=((2.0, 1.0), (0.2, 1.0)),
    sizes=(),
    state="balance",
    initial=lambda c: c.p["u0"] * (c.p["balanced_share"] - 1),
    is_common=True,
    changes=("speed_loss",),
)
"""A noisy or slow speed sensor misses how the speed falls in a turn, or tells it late.

An observer: with a large gain the speed is the measured one, with a small one that of the surge equation. The
speed b at which thrust and drag balance follows the measured one over the minutes, so that the speed keeps to
it. It frees the coefficients of that equation, which a measured speed alone does not need (Fitter.held_in).
"""


def has_memory(effect: Effect) -> bool:
    """Whether the plane depends on commands that were given before."""
    return effect.actuator is not None or effect.lags
