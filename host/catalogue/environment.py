"""Moving water."""

import casadi as ca

from host.catalogue.gravity import GRAVITY
from host.catalogue.oscillation import oscillation, oscillation_parameters
from host.dynamics.equations import Chain, Effect, Parameter

INTERNAL_PERIODS = (15.0, 20000.0)  # s
WAVE_PERIODS = (2.0, 20.0)  # s


def _current(c: Chain) -> None:
    c.climb += c.p["current"]


def _internal_wave(c: Chain) -> None:
    c.climb += oscillation(c, "internal")


def _surface_waves(c: Chain) -> None:
    number = (2 * ca.pi / c.p["wave_period"]) ** 2 / GRAVITY  # deep water
    c.climb += oscillation(c, "wave") * ca.exp(-number * c.zeta)


def _suction(c: Chain) -> None:
    near = c.speed_ratio**2 * ca.exp(-ca.fmax(c.zeta, 0) / c.p["suction_reach"])
    c.heave -= c.p["suction"] * near
    c.pitch += c.p["suction_moment"] * near


def _over_ground(c: Chain) -> None:
    c.speed = c.speed + c.p["ground_share"] * c.climb * ca.sin(c.theta) * c.is_speed_known


EFFECTS = (
    Effect(
        name="vertical_current",
        slot="environment",
        parameters=(
            Parameter(name="current", unit="m/s", lower=-3, upper=3, meaning="water, down positive"),
        ),
        sentence="The water itself moves up or down at a constant rate.",
        equation="zeta' = ... + current",
        manoeuvre="a change of speed: buoyancy answers to it, a current does not",
        probes=((0.0,),),
        force=_current,
    ),
    Effect(
        name="internal_wave",
        slot="environment",
        parameters=oscillation_parameters("internal", "m/s", 3, INTERNAL_PERIODS, "vertical water motion"),
        sentence="The water heaves slowly up and down (an internal wave).",
        equation="zeta' = ... + internal_sine sin(2 pi t/T) + internal_cosine cos(2 pi t/T)",
        manoeuvre="a straight level run of several periods with the planes fixed",
        probes=((0.0, 0.0, 100.0),),
        sizes=("internal_sine", "internal_cosine"),
        periods=INTERNAL_PERIODS,
        force=_internal_wave,
    ),
    Effect(
        name="surface_waves",
        slot="environment",
        parameters=oscillation_parameters("wave", "m/s", 20, WAVE_PERIODS, "orbital speed at the surface"),
        sentence="Surface waves carry the vehicle up and down, less so the deeper it is.",
        equation="zeta' = ... + exp(-k zeta) (wave_sine sin ot + wave_cosine cos ot), o = 2 pi/T, k = o^2/g",
        manoeuvre="level runs at two depths, the shallower one within a few metres of the surface",
        probes=((0.0, 0.0, 7.0),),
        sizes=("wave_sine", "wave_cosine"),
        periods=WAVE_PERIODS,
        force=_surface_waves,
    ),
    Effect(
        name="speed_over_ground",
        slot="environment",
        parameters=(
            Parameter(name="ground_share", unit="1", lower=0, upper=2, meaning="1 is over the ground"),
        ),
        sentence="The speed was measured over the ground: moving water that a pitched hull meets along its "
        "axis is not in it.",
        equation="u = measured speed + ground_share (vertical speed of the water) sin theta",
        manoeuvre="long climbs and dives in moving water",
        probes=((1.0,),),
        force=_over_ground,
        changes=("current_change", "vertical_current", "internal_wave"),
    ),
)
NEAR_THE_SURFACE = (
    Effect(
        name="free_surface_suction",
        slot="environment",
        parameters=(
            Parameter(
                name="suction", unit="m/s^2", lower=0, upper=20, meaning="lift at depth zero", speed_power=2
            ),
            Parameter(
                name="suction_moment",
                unit="rad/s^2",
                lower=-20,
                upper=20,
                meaning="its moment",
                speed_power=2,
            ),
            Parameter(name="suction_reach", unit="m", lower=0.2, upper=5, meaning="e-folding depth"),
        ),
        sentence="Near the surface the hull is sucked up towards it, and turned.",
        equation="w' = ... - suction (u/u0)^2 exp(-zeta/suction_reach), "
        "q' = ... + suction_moment (u/u0)^2 exp(-zeta/suction_reach)",
        manoeuvre="level runs at one, two and four hull diameters below the surface",
        probes=((0.0, 0.0, 0.7), (0.0, 0.0, 2.0)),
        sizes=("suction", "suction_moment"),
        force=_suction,
    ),
)
"""Entries that are tried only of a vehicle that comes near the surface."""
