"""Forces of which only the form is known: what is none of the catalogue's physics can still be described.

None of these is an answer. Where one of them does better than the named effects it takes part with, physics
is at work that the catalogue does not hold, however well some of its entries may imitate it together.
"""

from collections.abc import Callable, Mapping
from itertools import combinations_with_replacement
from typing import Literal

import casadi as ca
import numpy as np

from host.catalogue.oscillation import oscillation, oscillation_parameters
from host.dynamics.equations import Chain, Effect, Parameter, Slot
from host.recordings.recording import Array

Side = Literal["heave", "pitch"]
SIDES: tuple[Side, Side] = ("heave", "pitch")
KIND = {"heave": "force", "pitch": "moment"}
LAYERED_KIND = {**KIND, "climb": "current"}
SLOT: dict[str, Slot] = {"heave": "heave", "pitch": "pitch", "climb": "environment"}
RATE = {"heave": "w'", "pitch": "q'", "climb": "zeta'"}
UNIT = {"heave": "m/s^2", "pitch": "rad/s^2", "climb": "m/s"}
MOST = {"heave": 5.0, "pitch": 20.0, "climb": 5.0}
MOTION = ("w", "q", "theta", "delta")
DEGREE = 7  # of what wanders slowly: about as many turns as a tide or a leak takes in one recording
LAYERED_DEGREE = 11  # the same of what goes with the depth: a layer a quarter as thick as the dive is deep
SWING_PERIODS = (2.0, 20000.0)  # s
SPANS = {side: f"wander_{side}_span" for side in SIDES}
"""The parameters that hold the length of the recording, s, over which a force wanders."""
SHALLOWEST = {side: f"layers_{side}_top" for side in LAYERED_KIND}
DEEPEST = {side: f"layers_{side}_bottom" for side in LAYERED_KIND}
"""The parameters that hold the depths, m, between which a force, moment or current goes with the depth."""

NARROW = 0.002  # m/s or rad/s: within which dry friction turns about, to begin with
LEAST_WIDTH, MOST_WIDTH = 0.0004, 0.05

Term = Callable[[tuple[ca.SX, ...]], ca.SX]


def _product(*which: int) -> Term:
    def term(motion: tuple[ca.SX, ...]) -> ca.SX:
        value = motion[which[0]]
        for i in which[1:]:
            value = value * motion[i]
        return value

    return term


def _modulus(which: int) -> Term:
    return lambda motion: ca.fabs(motion[which])


SHAPES: dict[str, Term] = {
    f"{MOTION[i]}_{MOTION[j]}": _product(i, j) for i, j in combinations_with_replacement(range(4), 2)
} | {f"abs_{name}": _modulus(i) for i, name in enumerate(MOTION)}
"""Forms that change neither sign nor size with the motion as those of the catalogue do."""
CUBES: dict[str, Term] = {f"{name}_cubed": _product(i, i, i) for i, name in enumerate(MOTION)}
"""These are close to entries of the catalogue: a sign that something is left, but no form of their own."""
PLANE_SHAPES = {shape: term for shape, term in SHAPES.items() if "delta" in shape}
"""Forms of what a plane does beyond its angle: force and moment together, as the plane makes them."""


def _push(side: Side, own: str, term: Term) -> Callable[[Chain], None]:
    def force(c: Chain) -> None:
        value = c.p[own] * term((c.w, c.q, c.theta, c.plane)) * c.speed_ratio
        setattr(c, side, getattr(c, side) + value)

    return force


def _share(side: Side, shape: str, own: str) -> Parameter:
    return Parameter(
        name=own,
        unit=f"({UNIT[side]})/({shape})",
        lower=-1e6,
        upper=1e6,
        meaning="share of the term",
        speed_power=1,
    )


def _of_motion(side: Side, shape: str, term: Term) -> Effect:
    return Effect(
        name=f"unknown_{KIND[side]}_{shape}",
        slot=side,
        parameters=(_share(side, shape, f"{side}_{shape}"),),
        sentence=f"A {KIND[side]} acts that goes with {_in_words(shape)}, as nothing in the catalogue does.",
        equation=f"{RATE[side]} = ... + {side}_{shape} {shape}",
        manoeuvre="steps of several sizes and both signs",
        probes=((0.0,),),
        force=_push(side, f"{side}_{shape}", term),
    )


def _of_plane(shape: str, term: Term) -> Effect:
    own = f"plane_{shape}"

    def force(c: Chain) -> None:
        beyond = c.p[own] * term((c.w, c.q, c.theta, c.plane)) * c.speed_ratio
        c.heave += c.p["b1"] * beyond
        c.pitch += c.p["b2"] * beyond

    return Effect(
        name=f"unknown_plane_{shape}",
        slot="actuator",
        parameters=(
            Parameter(name=own, unit=f"rad/({shape})", lower=-1e6, upper=1e6, meaning="share of the term"),
        ),
        sentence=f"The plane acts as if it stood further over by an angle that goes with {_in_words(shape)}, "
        "as nothing in the catalogue does.",
        equation=f"w' = ... + b1 {own} {shape}, q' = ... + b2 {own} {shape}",
        manoeuvre="steps of several sizes and both signs",
        probes=((0.0,),),
        force=force,
    )


def _in_words(shape: str) -> str:
    return shape.replace("abs_", "the size of ").replace("_", " times ")


def _directed(side: Side) -> Effect:
    rate, unit = {"heave": ("w", "m/s"), "pitch": ("q", "rad/s")}[side]
    own, width = f"dry_{side}", f"dry_{side}_width"

    def force(c: Chain) -> None:
        x = getattr(c, rate)
        setattr(c, side, getattr(c, side) + c.p[own] * x / ca.sqrt(x**2 + c.p[width] ** 2))

    return Effect(
        name=f"unknown_{KIND[side]}_by_direction",
        slot=side,
        parameters=(
            Parameter(name=own, unit=UNIT[side], lower=-MOST[side], upper=MOST[side], meaning="its size"),
            Parameter(name=width, unit=unit, lower=LEAST_WIDTH, upper=MOST_WIDTH, meaning="where it turns"),
        ),
        sentence=f"A {KIND[side]} acts that goes with the direction of {rate} and hardly with its size, as "
        "dry friction does.",
        equation=f"{RATE[side]} = ... + {own} {rate}/sqrt({rate}^2 + {width}^2)",
        manoeuvre="slow and fast steps of the same size",
        probes=((0.0, NARROW),),
        sizes=(own,),
        force=force,
    )


def _any_smooth_force(c: Chain) -> None:
    for side in SIDES:
        for shape, term in (SHAPES | CUBES).items():
            _push(side, f"any_{side}_{shape}", term)(c)


ANY_SMOOTH_FORCE = Effect(
    name="any_smooth_force",
    slot="heave",
    parameters=tuple(
        _share(side, shape, f"any_{side}_{shape}") for side in SIDES for shape in SHAPES | CUBES
    ),
    sentence="A force or moment that depends on the motion acts, and no entry of the catalogue is it.",
    equation="w' = ... + P(w, q, theta, delta), q' = ... + R(w, q, theta, delta)",
    manoeuvre="steps of several sizes and both signs",
    probes=((0.0,) * (2 * len(SHAPES | CUBES)),),
    force=_any_smooth_force,
)
"""Products of two, cubes and moduli of the motion, in heave and pitch: what is left by physics unknown to us
shows as a gain of these, where random forces show none."""


def _chebyshev(c: Chain, names: tuple[str, ...], x: ca.SX) -> ca.SX:
    """Sum of the parameters times Chebyshev polynomials, T_k+1 = 2 x T_k - T_k-1; beyond 1 as at 1."""
    x = ca.fmax(-1, ca.fmin(x, 1))
    before, now, value = ca.SX(1), x, ca.SX(0)
    for name in names:
        value += c.p[name] * now
        before, now = now, 2 * x * now - before
    return value


def _shares(side: str, names: tuple[str, ...]) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(name=name, unit=UNIT[side], lower=-MOST[side], upper=MOST[side], meaning="of Chebyshev's")
        for name in names
    )


def _wandering(side: Side) -> Effect:
    names = tuple(f"wander_{side}_{k}" for k in range(1, DEGREE + 1))

    def force(c: Chain) -> None:
        value = _chebyshev(c, names, 2 * c.time / c.p[SPANS[side]] - 1)
        setattr(c, side, getattr(c, side) + value)

    return Effect(
        name=f"unknown_wandering_{KIND[side]}",
        slot=side,
        parameters=(
            *_shares(side, names),
            Parameter(name=SPANS[side], unit="s", lower=1.0, upper=1e6, meaning="length of the recording"),
        ),
        sentence=f"A {KIND[side]} acts that wanders slowly with time, whatever the vehicle does.",
        equation=f"{RATE[side]} = ... + sum of wander_{side}_k T_k(2 t/{SPANS[side]} - 1)",
        manoeuvre="a straight level run as long as this one",
        probes=((*((0.0,) * DEGREE), 1.0),),
        scales=(*(("",) * DEGREE), "duration"),
        sizes=names,
        force=force,
    )


def _in_layers(side: str) -> Effect:
    names = tuple(f"layers_{side}_{k}" for k in range(1, LAYERED_DEGREE + 1))
    top, bottom = SHALLOWEST[side], DEEPEST[side]

    def force(c: Chain) -> None:
        x = 2 * (c.zeta - c.p[top]) / (c.p[bottom] - c.p[top]) - 1
        setattr(c, side, getattr(c, side) + _chebyshev(c, names, x))

    return Effect(
        name=f"unknown_{LAYERED_KIND[side]}_in_layers",
        slot=SLOT[side],
        parameters=(
            *_shares(side, names),
            Parameter(name=top, unit="m", lower=-100.0, upper=12000.0, meaning="least depth"),
            Parameter(name=bottom, unit="m", lower=-100.0, upper=12000.0, meaning="greatest depth"),
        ),
        sentence=f"A {LAYERED_KIND[side]} acts that goes with the depth, as in layered water.",
        equation=f"{RATE[side]} = ... + sum of layers_{side}_k T_k(2 (zeta - {top})/({bottom} - {top}) - 1)",
        manoeuvre="a slow dive through all depths and back with the planes level",
        probes=((*((0.0,) * LAYERED_DEGREE), 0.0, 1.0),),
        sizes=names,
        force=force,
    )


def _swinging_moment(c: Chain) -> None:
    c.pitch += oscillation(c, "swing")


SWINGING_MOMENT = Effect(
    name="unknown_swinging_moment",
    slot="pitch",
    parameters=oscillation_parameters("swing", UNIT["pitch"], 20, SWING_PERIODS, "moment"),
    sentence="A moment acts that swings with a period of its own, and does not move the water.",
    equation="q' = ... + swing_sine sin(2 pi t/T) + swing_cosine cos(2 pi t/T), T = swing_period",
    manoeuvre="a straight level run of several periods with the planes fixed",
    probes=((0.0, 0.0, 10.0),),
    sizes=("swing_sine", "swing_cosine"),
    periods=SWING_PERIODS,
    force=_swinging_moment,
)

AS_OF_PLANE = {
    f"unknown_{kind}_{shape}": f"unknown_plane_{shape}" for kind in KIND.values() for shape in PLANE_SHAPES
}
"""Forms in heave or pitch alone, and those of the plane that do the same there."""

WANDERING = frozenset(f"unknown_wandering_{kind}" for kind in KIND.values())
"""Of so many terms in time that any slow motion can be followed with them."""


def _hardening(c: Chain) -> None:
    c.pitch -= c.p["hardening"] * c.theta**3


HARDENING = Effect(
    name="unknown_hardening_moment",
    slot="pitch",
    parameters=(
        Parameter(name="hardening", unit="rad/s^2/rad^3", lower=0.0, upper=1e3, meaning="of the cube"),
    ),
    sentence="A moment rights the hull that grows faster than its pitch; that of a weight falls behind.",
    equation="q' = ... - hardening theta^3",
    manoeuvre="small and large steps of the plane",
    probes=((0.0,),),
    force=_hardening,
)

_LEADING = (_directed("heave"), _directed("pitch"), HARDENING)
LEADING_FORMS = (*(form.name for form in _LEADING), "unknown_plane_abs_delta")
"""Forms that bend the base, and all that every vehicle has, until they no longer promise anything."""

_LAYERED = {form.name: form for form in map(_in_layers, LAYERED_KIND)}
IN_LAYERS = frozenset(_LAYERED)
"""Asked only of a vehicle that dives: over less, anything goes with the depth."""


def terms_over_depth(name: str, values: Mapping[str, float]) -> tuple[Array, Array]:
    """Depths, m (100,), and the terms T_k (100, n) of a form in layers there, of which it is the sum."""
    top, bottom = (values[parameter.name] for parameter in _LAYERED[name].parameters[LAYERED_DEGREE:])
    x = np.linspace(-1.0, 1.0, 100)
    terms = np.polynomial.chebyshev.chebvander(x, LAYERED_DEGREE)[:, 1:]
    return top + (bottom - top) * (x + 1.0) / 2.0, np.asarray(terms, dtype=float)


def over_depth(name: str, values: Mapping[str, float]) -> tuple[Array, Array]:
    """Depths, m, and what a form in layers makes of them, by the values of its parameters (100,) each."""
    depths, terms = terms_over_depth(name, values)
    return depths, terms @ [values[share.name] for share in _LAYERED[name].parameters[:LAYERED_DEGREE]]


FORMS: tuple[Effect, ...] = (
    *(_of_motion(side, shape, term) for side in SIDES for shape, term in SHAPES.items()),
    *(_of_plane(shape, term) for shape, term in PLANE_SHAPES.items()),
    *_LEADING,
    *(_wandering(side) for side in SIDES),
    SWINGING_MOMENT,
    *_LAYERED.values(),
)
