"""Moments in pitch, q' = ..."""

import casadi as ca

from host.catalogue import weight
from host.catalogue.gravity import GRAVITY
from host.dynamics.equations import Chain, Effect, Parameter

TINY = 1e-9  # m/s, beside a speed that may be nothing


def _damping(c: Chain) -> None:
    c.pitch += c.p["c_qq"] * c.q * ca.fabs(c.q)


def _trim(c: Chain) -> None:
    c.pitch += c.p["c_q0"]


def _munk(c: Chain) -> None:
    c.pitch += c.p["c_qw"] * c.speed_ratio * c.w


def _restoring(c: Chain) -> None:
    c.pitch += c.p["restoring_share"] * c.p["a3"] * (ca.sin(c.theta) - c.theta)


def _drag_along_the_hull(c: Chain) -> None:
    # With s = w / (l q): 1/2 int (s - y)|s - y| dy over -1..1 in heave, -2 int y (s - y)|s - y| dy in pitch.
    half = c.p["drag_half_length"]
    heaving, turning = ca.fabs(c.w), half * ca.fabs(c.q)
    more, less = ca.fmax(heaving, turning), ca.fmin(heaving, turning)
    share = less / (more + TINY)
    if "c_ww" in c.p:
        c.heave += c.p["c_ww"] * c.w * (more + less * share / 3 - heaving)
    if "c_qq" in c.p:
        mostly_turns = turning * (1 + 2 * share**2 - share**4 / 3)
        damped = ca.if_else(heaving > turning, 8 / 3 * heaving, mostly_turns)
        c.pitch += c.p["c_qq"] * c.q * (damped - turning) / half


def _ballast_off_centre(c: Chain) -> None:
    if "c_wb" in c.p:
        arm = c.p["ballast_forward"] * ca.cos(c.theta) + c.p["ballast_below"] * ca.sin(c.theta)
        c.pitch -= weight.ballast(c) * arm


def _pendulum(c: Chain) -> None:
    c.pitch += c.p["pendulum_share"] * c.p["a3"] / GRAVITY * (c.surge + c.q * c.w)
    c.heave += c.p["pendulum_lever"] * c.q**2
    if "speed_loss" in c.rates:
        c.rates["speed_loss"] -= c.p["c_uq"] * c.p["pendulum_lever"] * (c.turning + c.pitch)


EFFECTS = (
    Effect(
        name="pitch_quadratic_damping",
        slot="pitch",
        parameters=(Parameter(name="c_qq", unit="1/rad", lower=-200, upper=0, meaning="quadratic damping"),),
        sentence="Damping in pitch grows with the square of the pitch rate.",
        equation="q' = ... + c_qq q |q|",
        manoeuvre="quick plane reversals of several sizes",
        probes=((-2.0,),),
        force=_damping,
        is_common=True,
    ),
    Effect(
        name="drag_along_the_hull",
        slot="pitch",
        parameters=(
            Parameter(name="drag_half_length", unit="m", lower=0.05, upper=50, meaning="of what is dragged"),
        ),
        sentence="A hull that heaves and pitches meets the water at another speed at either end: the drag of "
        "the one motion depends on the other (cross-flow drag along the hull).",
        equation="w|w| -> 1/(2 l) int (w - x q)|w - x q| dx, q|q| -> -2/l^4 int x (w - x q)|w - x q| dx, "
        "x = -l...l, l = drag_half_length",
        manoeuvre="quick plane reversals after climbs and dives in which the hull has heaved long",
        probes=((0.5,), (3.0,)),
        sizes=(),
        force=_drag_along_the_hull,
        changes=("heave_quadratic_drag", "pitch_quadratic_damping"),
    ),
    Effect(
        name="trim_moment",
        slot="pitch",
        parameters=(Parameter(name="c_q0", unit="rad/s^2", lower=-20, upper=20, meaning="constant moment"),),
        sentence="A constant moment pitches the vehicle: weights out of trim, or an asymmetric hull.",
        equation="q' = ... + c_q0",
        manoeuvre="straight runs with the planes level at two speeds",
        probes=((0.0,),),
        force=_trim,
        is_common=True,
    ),
    Effect(
        name="ballast_off_centre",
        slot="pitch",
        parameters=(
            Parameter(
                name="ballast_forward", unit="1/m", lower=-20, upper=20, meaning="moment per force, forward"
            ),
            Parameter(
                name="ballast_below", unit="1/m", lower=-20, upper=20, meaning="moment per force, below"
            ),
        ),
        sentence="What came or went was not at the centre of buoyancy: it turns the hull as well.",
        equation="q' = ... - c_wb (ballast_forward cos theta + ballast_below sin theta) (t > ballast_time)",
        manoeuvre="climbs and dives, and straight level runs, before and after",
        probes=((0.0, 0.0),),
        sizes=("ballast_forward", "ballast_below"),
        force=_ballast_off_centre,
        changes=("ballast_change",),
    ),
    Effect(
        name="munk_moment",
        slot="pitch",
        parameters=(
            Parameter(
                name="c_qw",
                unit="rad/(m s)",
                lower=-100,
                upper=100,
                meaning="heave into pitch",
                speed_power=1,
            ),
        ),
        sentence="Heave velocity turns the hull (Munk moment): angle of attack drives pitch.",
        equation="q' = ... + c_qw w",
        manoeuvre="plane steps held for several heave time constants, longer than the pitch transient",
        probes=((0.5,), (-0.5,)),
        force=_munk,
        is_common=True,
    ),
    Effect(
        name="large_angle_restoring",
        slot="pitch",
        parameters=(
            Parameter(name="restoring_share", unit="1", lower=0, upper=2, meaning="1 is the full sine"),
        ),
        sentence="At large pitch the restoring moment follows the sine of the angle, not the angle.",
        equation="q' = a2 q + a3 [theta + restoring_share (sin theta - theta)] + ...",
        manoeuvre="climbs and dives at the largest pitch angle allowed",
        probes=((1.0,),),
        force=_restoring,
        is_common=True,
    ),
    Effect(
        name="surge_pitch_coupling",
        slot="pitch",
        parameters=(
            Parameter(name="pendulum_share", unit="1", lower=0, upper=3, meaning="1 is that of the weight"),
            Parameter(
                name="pendulum_lever",
                unit="m",
                lower=0,
                upper=1,
                meaning="how low, by weight over heave mass",
            ),
        ),
        sentence="The weight hangs below the centre of buoyancy like a pendulum: it feels the vehicle's own "
        "acceleration along its axis as it feels gravity, and pulls at the hull as it swings.",
        equation="q' = a2 q + a3 [theta + pendulum_share (u' + q w)/g] + ..., w' = ... + pendulum_lever q^2, "
        "u' = ... - c_uq pendulum_lever q'",
        manoeuvre="full plane reversals at the highest speed, or changes of thrust with the planes level",
        probes=((1.0, 0.0), (1.0, 0.02)),
        sizes=("pendulum_share", "pendulum_lever"),
        force=_pendulum,
    ),
)
