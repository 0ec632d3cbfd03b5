"""The vehicle's continuous-time equations, written once in CasADi, with slots for what is left out.

    w'     = a1 w + b1 delta + heave_offset            heave velocity, m/s
    q'     = a2 q + a3 theta + b2 delta + pitch_offset pitch rate, rad/s
    theta' = q
    zeta'  = w - u theta,    u = measured speed, or the constant u0 where no speed is measured

Source: Yuan et al., J. Mar. Sci. Eng. 2025, 13, 1489, Eq. 1-3; the two offsets stand for an imperfect trim.
An effect (host.catalogue) adds its term to the slot of the chain where it acts.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import casadi as ca
import numpy as np

from host.recordings.recording import Array

Slot = Literal["heave", "pitch", "kinematics", "surge", "actuator", "sensor", "environment"]
STATES = ("w", "q", "theta", "zeta")
START = (*STATES, "excess")  # what a run begins with: u / u0 - 1 acts where speed is a state


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A coefficient of the equations, its unit, and the bounds no underwater vehicle exceeds.

    speed_power  the power of the forward speed with which it grows, where forces follow the speed
    """

    name: str
    unit: str
    lower: float
    upper: float
    meaning: str
    speed_power: int = 0


PARAMETERS = (
    Parameter(name="a1", unit="1/s", lower=-25.0, upper=-1e-4, meaning="heave damping", speed_power=1),
    Parameter(name="a2", unit="1/s", lower=-25.0, upper=-1e-4, meaning="pitch damping", speed_power=1),
    Parameter(name="a3", unit="1/s^2", lower=-1000.0, upper=5.0, meaning="pitch restoring"),
    Parameter(
        name="b1", unit="m/s^2/rad", lower=-100.0, upper=100.0, meaning="plane force in heave", speed_power=2
    ),
    Parameter(
        name="b2", unit="1/s^2", lower=-1000.0, upper=1000.0, meaning="plane moment in pitch", speed_power=2
    ),
    Parameter(name="u0", unit="m/s", lower=0.0, upper=20.0, meaning="forward speed"),
    Parameter(name="heave_offset", unit="m/s^2", lower=-5.0, upper=5.0, meaning="trim force in heave"),
    Parameter(name="pitch_offset", unit="rad/s^2", lower=-20.0, upper=20.0, meaning="trim moment in pitch"),
)
NAMES = tuple(parameter.name for parameter in PARAMETERS)


@dataclass(slots=True, kw_only=True)
class Chain:
    """The symbols of one instant while effects add their terms.

    p            parameters by name
    extra        states of effects by name
    excess       u / u0 - 1 at the first row, of a recording whose speed is not measured
    speed        u, m/s, measured where `is_speed_known` is 1; `speed_ratio` u / u0, on which forces depend;
    surge        u', m/s^2, of the measured speed
    command      rad, the plane as commanded; `earlier` the commands of the rows before, newest first
    elapsed      s from the row to the sub-step, `substep` its length
    plane        rad, the angle at which the plane acts, its mean over the sub-step; `change` rad, by which it
                 grows in it if it grows evenly: what has its mean and first moment; `path` what the last
                 actuator led it from and to
    heave, pitch, climb   terms added to w' (m/s^2), q' (rad/s^2), zeta' (m/s)
    sensed_pitch, sensed_depth   what the sensors give
    """

    p: dict[str, ca.SX]
    w: ca.SX
    q: ca.SX
    theta: ca.SX
    zeta: ca.SX
    extra: dict[str, ca.SX]
    time: ca.SX
    interval: ca.SX
    speed: ca.SX
    is_speed_known: ca.SX
    speed_ratio: ca.SX
    surge: ca.SX
    command: ca.SX
    earlier: list[ca.SX]
    elapsed: ca.SX
    plane: ca.SX
    substep: ca.SX = field(default_factory=lambda: ca.SX(0))
    change: ca.SX = field(default_factory=lambda: ca.SX(0))
    path: tuple[ca.SX, ca.SX] | None = None
    heave: ca.SX = field(default_factory=lambda: ca.SX(0))
    pitch: ca.SX = field(default_factory=lambda: ca.SX(0))
    climb: ca.SX = field(default_factory=lambda: ca.SX(0))
    rates: dict[str, ca.SX] = field(default_factory=dict)
    excess: ca.SX = field(default_factory=lambda: ca.SX(0))
    sensed_pitch: ca.SX = field(default_factory=lambda: ca.SX(0))
    sensed_depth: ca.SX = field(default_factory=lambda: ca.SX(0))

    @property
    def turning(self) -> ca.SX:
        """The base model's q', rad/s^2, without what is added to it."""
        p, ratio = self.p, self.speed_ratio
        return p["a2"] * ratio * self.q + p["a3"] * self.theta + p["b2"] * ratio**2 * self.plane


Term = Callable[[Chain], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """Physics that the base model leaves out: one entry of the catalogue.

    force     adds to heave, pitch, climb or the rate of its own state; evaluated within each sub-step
    late      which command has arrived when a sub-step begins, which when it ends, and the share of it for
              which the first is in force
    command   changes the command before the actuator
    actuator  (chain, held angle, sub-step s) -> (mean angle over the sub-step, next held angle), and sets the
              chain's change; needs a state of its own, which starts at the command
    plane     changes the angle at which the plane acts
    sense     changes what the sensors give
    follows   where its state follows something with a first-order lag: that, and the time constant's name
    state     name of the state the effect brings with it, and `initial`, its value at the first row
    probes    start values of its parameters to try; `scales` fits them to a recording
    periods   limits, s, of the last parameter where it is a period, to be read off the residuals
    sizes     names of the parameters that are 0 where the effect is absent, the rest being idle then; by
              default the first; () where none is
    lags      whether it looks at earlier commands
    is_common whether every vehicle has it: always tried, and preferred where the recording cannot decide
    beside    the effect without which it seldom acts
    changes   effects whose terms it changes: without any of them it does nothing
    """

    name: str
    slot: Slot
    parameters: tuple[Parameter, ...]
    sentence: str
    equation: str
    manoeuvre: str
    probes: tuple[tuple[float, ...], ...]
    scales: tuple[str, ...] = ()
    periods: tuple[float, float] | None = None
    force: Term | None = None
    late: Callable[[Chain], tuple[ca.SX, ca.SX, ca.SX]] | None = None
    command: Term | None = None
    actuator: Callable[[Chain, ca.SX, ca.SX], tuple[ca.SX, ca.SX]] | None = None
    plane: Term | None = None
    sense: Term | None = None
    follows: tuple[Callable[[Chain], ca.SX], str] | None = None
    state: str | None = None
    initial: Callable[[Chain], ca.SX] | None = None
    sizes: tuple[str, ...] | None = None
    lags: bool = False
    is_common: bool = False
    beside: str | None = None
    changes: tuple[str, ...] = ()

    @property
    def size_names(self) -> tuple[str, ...]:
        """`sizes`, or the default."""
        return (self.parameters[0].name,) if self.sizes is None else self.sizes


@dataclass(frozen=True)
class Structure:
    """Base equations with a set of effects, in the catalogue's order (the order of the chain).

    Its parameters are those of the base, then those of each effect.
    """

    effects: tuple[Effect, ...] = ()

    def __hash__(self) -> int:
        return hash(self.effect_names)  # of all that an effect is, it would take as long as a short run

    @cached_property
    def effect_names(self) -> frozenset[str]:
        return frozenset(effect.name for effect in self.effects)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        return PARAMETERS + tuple(p for effect in self.effects for p in effect.parameters)

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(parameter.name for parameter in self.parameters)

    def clipped(self, parameters: Array) -> Array:
        """The parameters (n,) within their bounds."""
        return np.clip(parameters, *self.bounds)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """The least and the largest value of each parameter (n,)."""
        limits = np.array([(p.lower, p.upper) for p in self.parameters], dtype=float)
        return limits[:, 0].copy(), limits[:, 1].copy()

    @cached_property
    def moments(self) -> frozenset[str]:
        """Names of the parameters that say when something happened, or how long it lasts, s."""
        return frozenset(
            parameter.name
            for effect in self.effects
            for parameter, scale in zip(effect.parameters, effect.scales, strict=False)
            if scale == "duration"
        )

    @cached_property
    def states(self) -> tuple[str, ...]:
        return STATES + tuple(effect.state for effect in self.effects if effect.state is not None)

    @cached_property
    def servos(self) -> tuple[int, ...]:
        """Places among the states of what stands between a command and the plane's angle."""
        own = [effect.state for effect in self.effects if effect.actuator is not None]
        return tuple(k for k, name in enumerate(self.states) if name in own)

    @cached_property
    def drive(self) -> "Structure":
        """The same with no more than moves the plane, and where that was before."""
        own = (e for e in self.effects if e.slot == "actuator" and e.force is None and e.plane is None)
        return Structure(tuple(own))

    @property
    def needs_lags(self) -> bool:
        return any(effect.lags for effect in self.effects)

    def chain(self, x: ca.SX, parameters: ca.SX, drive: ca.SX, time: ca.SX) -> Chain:
        """The symbols at one instant; `drive` as in host.dynamics.propagate.Inputs."""
        p = dict(zip(self.names, ca.vertsplit(parameters), strict=True))
        w, q, theta, zeta, *extra = ca.vertsplit(x)
        rudder, measured, is_known, interval, row_time, surge, *earlier = ca.vertsplit(drive)
        speed = p["u0"] * (1 - is_known) + measured * is_known
        return Chain(
            p=p,
            w=w,
            q=q,
            theta=theta,
            zeta=zeta,
            extra=dict(zip(self.states[len(STATES) :], extra, strict=True)),
            time=time,
            interval=interval,
            speed=speed,
            is_speed_known=is_known,
            speed_ratio=ca.SX(1),
            surge=surge,
            command=rudder,
            earlier=earlier,
            elapsed=time - row_time,
            plane=rudder,
            sensed_pitch=theta,
            sensed_depth=zeta,
        )

    @property
    def followers(self) -> list[tuple[str, Callable[[Chain], ca.SX], str]]:
        """States that follow something with a lag: the name, what it follows, the time constant's name."""
        return [(e.state, *e.follows) for e in self.effects if e.follows is not None and e.state is not None]

    def derivative(self, chain: Chain) -> ca.SX:
        """State derivative for the chain's plane angle; neither actuators nor what follows moves here."""
        p = chain.p
        for effect in self.effects:
            if effect.force is not None:
                effect.force(chain)
        ratio = chain.speed_ratio
        own = [chain.rates.get(name, ca.SX(0)) for name in self.states[len(STATES) :]]
        return ca.vertcat(
            p["a1"] * ratio * chain.w + p["b1"] * ratio**2 * chain.plane + p["heave_offset"] + chain.heave,
            chain.turning + p["pitch_offset"] + chain.pitch,
            chain.q,
            chain.w - chain.speed * chain.theta + chain.climb,
            *own,
        )

    def actuate(self, chain: Chain, substep: ca.SX) -> dict[str, ca.SX]:
        """Sets the chain's plane angle for one sub-step; gives the next states of the actuators.

        One part after the other where a late command gives way to the next within it.
        """
        chain.substep = substep
        held = {e.state: chain.extra[e.state] for e in self.effects if e.actuator is not None and e.state}
        late = next((effect.late for effect in self.effects if effect.late is not None), None)
        if late is None:
            return self._led(chain, held, substep)
        chain.command, latest, share = late(chain)
        held = self._led(chain, held, share * substep)
        before, grown, rest = chain.plane, chain.change, 1 - share
        chain.command = latest
        held = self._led(chain, held, rest * substep)
        stepped = 6 * share * rest * (chain.plane - before)
        chain.change = stepped + share**2 * grown + rest**2 * chain.change
        chain.plane = share * before + rest * chain.plane
        return held

    def _led(self, chain: Chain, held: dict[str, ca.SX], span: ca.SX) -> dict[str, ca.SX]:
        """The plane led through the actuators for a span, s, in which the command is constant."""
        moved = {}
        for effect in self.effects:
            if effect.command is not None:
                effect.command(chain)
        chain.plane, chain.change, chain.path = chain.command, ca.SX(0), None
        for effect in self.effects:
            if effect.actuator is not None and effect.state is not None:
                chain.plane, end = effect.actuator(chain, held[effect.state], span)
                moved[effect.state], chain.path = end, (held[effect.state], end)
        for effect in self.effects:
            if effect.plane is not None:
                effect.plane(chain)
        return moved

    def outputs(self, chain: Chain) -> ca.SX:
        """What the sensors see: [pitch, depth]."""
        for effect in self.effects:
            if effect.sense is not None:
                effect.sense(chain)
        return ca.vertcat(chain.sensed_pitch, chain.sensed_depth)

    def initial(self, x0: ca.SX, parameters: ca.SX, drive: ca.SX) -> ca.SX:
        """All states at the first row from what a run begins with (5,), see START."""
        base, count = x0[: len(STATES)], len(self.states) - len(STATES)
        chain = self.chain(ca.vertcat(base, ca.SX(count, 1)), parameters, drive, drive[4])
        chain.excess = x0[len(STATES)]
        own = [effect.initial(chain) for effect in self.effects if effect.initial is not None]
        return ca.vertcat(base, *own)


BASE = Structure()
