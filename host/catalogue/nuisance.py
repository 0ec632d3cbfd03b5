"""Terms that stand for physics without naming it: no entries of the catalogue, but tools of the search."""

from itertools import combinations_with_replacement

import casadi as ca

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

_MOTION = ("w", "q", "theta", "delta")
_SMOOTH = (*combinations_with_replacement(range(4), 2), *((i, i, i) for i in range(4)))


def _any_smooth_force(c: Chain) -> None:
    motion = (c.w, c.q, c.theta, c.plane)
    for k, powers in enumerate(_SMOOTH):
        term = c.speed_ratio
        for i in powers:
            term = term * motion[i]
        c.heave += c.p[f"heave_{k}"] * term
        c.pitch += c.p[f"pitch_{k}"] * term
    for i, value in enumerate(motion):
        c.heave += c.p[f"heave_even_{i}"] * ca.fabs(value)
        c.pitch += c.p[f"pitch_even_{i}"] * ca.fabs(value)


ANY_SMOOTH_FORCE = Effect(
    name="any_smooth_force",
    slot="heave",
    parameters=tuple(
        Parameter(name=f"{side}_{term}", unit="SI", lower=-1e6, upper=1e6, meaning="of a polynomial")
        for side in ("heave", "pitch")
        for term in (*range(len(_SMOOTH)), *(f"even_{i}" for i in range(4)))
    ),
    sentence="A force or moment that depends on the motion acts, and no entry of the catalogue is it.",
    equation="w' = ... + P(w, q, theta, delta), q' = ... + R(w, q, theta, delta)",
    manoeuvre="steps of several sizes and both signs",
    probes=((0.0,) * (2 * (len(_SMOOTH) + 4)),),
    force=_any_smooth_force,
)
"""Products of two, cubes and moduli of the motion, in heave and pitch: what is left by physics unknown to us
shows as a gain of these, where random forces show none."""
