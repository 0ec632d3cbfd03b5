"""What changes at one moment, beside ballast and the plane's effect: tried where something is known to have.

By an alarm, or as one of all these is likeliest so far. A recording that shows no such moment would mostly
let them imitate what acts all the time.
"""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca

from host.catalogue.switching import after
from host.dynamics.equations import Chain, Effect, Parameter, Slot, Term

Action = Callable[[Chain, ca.SX], None]
SPEED_CHANGES = ("speed_change", "second_speed_change")
"""A mission flown at several speeds has as many; the second is asked for beside the first."""
SHORTEST = 0.05  # s, in which any speed changes: a vehicle has mass


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """One quantity of the chain that takes another value at one moment.

    details  what else the change has, and `likely` start values of these
    changes  entries without which it means nothing
    force, plane, sense  as of an Effect, with the change that has come so far
    """

    name: str
    slot: Slot
    size: Parameter
    sentence: str
    equation: str
    details: tuple[Parameter, ...] = ()
    likely: tuple[tuple[float, ...], ...] = ((),)
    changes: tuple[str, ...] = ()
    force: Action | None = None
    plane: Action | None = None
    sense: Action | None = None

    @property
    def time(self) -> str:
        """The name of the moment among the parameters."""
        return f"{self.name}_time"

    def effect(self) -> Effect:
        """The entry for the catalogue."""
        size, time = self.size.name, self.time
        moment = Parameter(name=time, unit="s", lower=0, upper=1e6, meaning="when it happened")

        def come(c: Chain) -> ca.SX:
            return c.p[size] * after(c, c.p[time])

        return Effect(
            name=self.name,
            slot=self.slot,
            parameters=(self.size, moment, *self.details),
            sentence=self.sentence,
            equation=f"{self.equation} (t > {time})",
            manoeuvre="the same manoeuvre before and after",
            probes=tuple((0.0, 0.5, *values) for values in self.likely),
            scales=("", "duration", *("" for _ in self.details)),
            changes=self.changes,
            force=with_size(self.force, come),
            plane=with_size(self.plane, come),
            sense=with_size(self.sense, come),
        )


def with_size(action: Action | None, size: Callable[[Chain], ca.SX]) -> Term | None:
    """The action as an effect's term, for what gives the size."""
    return None if action is None else lambda c: action(c, size(c))


def _speed_change(name: str, size: str, sentence: str, changes: tuple[str, ...] = ()) -> Change:
    settling, moment = f"{size.removesuffix('_step')}_settling", f"{name}_time"

    def force(c: Chain, come: ca.SX) -> None:
        unmeasured = come * (1 - c.is_speed_known)
        if settling in c.p:  # else it is asked when it happened
            lag = c.p[settling] + SHORTEST
            missing = ca.exp(-ca.fmax(c.time - c.p[moment], 0) / lag)
            c.surge = c.surge + c.p["u0"] * unmeasured * missing / lag
            unmeasured = unmeasured * (1 - missing)
        c.speed = c.speed + c.p["u0"] * unmeasured
        c.speed_ratio = c.speed_ratio + unmeasured

    return Change(
        name=name,
        slot="surge",
        force=force,
        size=Parameter(name=size, unit="1", lower=-0.9, upper=5, meaning="share lost or gained"),
        sentence=sentence,
        equation=f"u0 -> u0 (1 + {size} (1 - exp(-(t - {moment}) / {settling})))",
        details=(Parameter(name=settling, unit="s", lower=0, upper=300, meaning="how slowly it changes"),),
        likely=((0.0,), (2.0,)),
        changes=changes,
    )


def _trim(c: Chain, size: ca.SX) -> None:
    c.pitch += size


def _plane_zero(c: Chain, size: ca.SX) -> None:
    c.plane = c.plane + size


def _pitch_datum(c: Chain, size: ca.SX) -> None:
    c.sensed_pitch = c.sensed_pitch + size


def _current(c: Chain, size: ca.SX) -> None:
    c.w = c.w - (1 - c.p.get("carried_share", 0.0)) * size
    c.climb += size


KINDS = (
    _speed_change(
        "speed_change",
        "speed_step",
        "The forward speed changed at one moment: thrust was lost, or something drags.",
    ),
    _speed_change(
        "second_speed_change",
        "second_speed_step",
        "The forward speed changed once more: thrust is set anew under way.",
        changes=("speed_change",),
    ),
    Change(
        name="trim_moment_change",
        slot="pitch",
        force=_trim,
        size=Parameter(name="c_qb", unit="rad/s^2", lower=-20, upper=20, meaning="step of the moment"),
        sentence="A constant moment came at one moment: a weight shifted, or part of the hull is bent.",
        equation="q' = ... + c_qb",
    ),
    Change(
        name="rudder_offset_change",
        slot="actuator",
        plane=_plane_zero,
        size=Parameter(name="rudder_step", unit="rad", lower=-0.5, upper=0.5, meaning="step of the zero"),
        sentence="The plane's zero moved at one moment: its drive slipped, or it is bent.",
        equation="delta = servo + rudder_step",
    ),
    Change(
        name="pitch_bias_change",
        slot="sensor",
        sense=_pitch_datum,
        size=Parameter(name="pitch_step", unit="rad", lower=-0.5, upper=0.5, meaning="step of the datum"),
        sentence="The pitch sensor's datum moved at one moment: it was set anew, or knocked.",
        equation="recorded pitch = theta + pitch_step",
    ),
    Change(
        name="current_change",
        slot="environment",
        force=_current,
        size=Parameter(name="current_step", unit="m/s", lower=-3, upper=3, meaning="step of the current"),
        sentence="The vehicle entered or left water that moves up or down.",
        equation="w - (1 - carried_share) current_step in place of w, zeta' = ... + current_step",
        details=(
            Parameter(
                name="carried_share",
                unit="1",
                lower=0,
                upper=1,
                meaning="0 enters moving water as it moved before, 1 is carried along at once",
            ),
        ),
        likely=((0.0,), (1.0,)),
    ),
)
EFFECTS = tuple(kind.effect() for kind in KINDS)
