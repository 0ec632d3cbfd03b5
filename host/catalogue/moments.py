"""A change that came at one moment, tried at many moments at once: no entries, but tools of the search.

The likelihood of such a change has many maxima over its moment, and none is seen from far. As a change at a
given moment is linear in its size, one propagation with a change of no size at each moment foretells which of
them would gain most.
"""

import casadi as ca

from host.catalogue import changes
from host.catalogue.switching import after
from host.dynamics.equations import Chain, Effect, Parameter, Slot, Term

COUNT = 24
FIRST, LAST = "moments_first", "moments_last"
"""The parameters that hold between which times, s, the moments lie."""


def sizes(like: str) -> tuple[str, ...]:
    """The names of the sizes, one a moment."""
    return tuple(f"{like}_size_{k}" for k in range(1, COUNT + 1))


def _changed(c: Chain, like: str) -> ca.SX:
    """The sum of all changes that have come."""
    apart = (c.p[LAST] - c.p[FIRST]) / (COUNT + 1)
    value = ca.SX(0)
    for k, name in enumerate(sizes(like), start=1):
        value += c.p[name] * after(c, c.p[FIRST] + k * apart)
    return value


def _weigh(c: Chain) -> None:
    c.heave += _changed(c, "ballast_change") * ca.cos(c.theta)


def _weaken(c: Chain) -> None:
    share = 1 + _changed(c, "rudder_effectiveness_change")
    c.plane, c.change = c.plane * share, c.change * share


def _at_any_moment(
    like: str,
    slot: Slot,
    unit: str,
    force: Term | None = None,
    plane: Term | None = None,
    sense: Term | None = None,
) -> Effect:
    return Effect(
        name=f"{like}_at_any_moment",
        slot=slot,
        parameters=(
            *(Parameter(name=n, unit=unit, lower=-5, upper=5, meaning="of a change") for n in sizes(like)),
            Parameter(name=FIRST, unit="s", lower=-1e9, upper=1e9, meaning="where the moments begin"),
            Parameter(name=LAST, unit="s", lower=-1e9, upper=1e9, meaning="where they end"),
        ),
        sentence=f"A {like.replace('_', ' ')} came at some moment.",
        equation=f"that of {like}, summed over {COUNT} moments",
        manoeuvre="the same before and after",
        probes=((*((0.0,) * COUNT), 0.0, 1.0),),
        force=force,
        plane=plane,
        sense=sense,
    )


def _of(kind: changes.Change) -> Effect:
    def come(c: Chain) -> ca.SX:
        return _changed(c, kind.name)

    terms = (changes.with_size(action, come) for action in (kind.force, kind.plane, kind.sense))
    return _at_any_moment(kind.name, kind.slot, kind.size.unit, *terms)


SCANS: dict[str, Effect] = {
    "ballast_change": _at_any_moment("ballast_change", "heave", "m/s^2", force=_weigh),
    "rudder_effectiveness_change": _at_any_moment(
        "rudder_effectiveness_change", "actuator", "1", plane=_weaken
    ),
} | {kind.name: _of(kind) for kind in changes.KINDS}
"""By the name of the entry whose moment they tell."""
