"""What hides the physics left out while it is unknown: no catalogue entries, but tools of the search."""

from host.equations import Chain, Effect, Parameter


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


def has_memory(effect: Effect) -> bool:
    """Whether the plane depends on commands that were given before."""
    return effect.actuator is not None or effect.lags
