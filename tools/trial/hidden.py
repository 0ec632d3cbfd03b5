"""What a recording can hide: each kind with its slot, its strongest ordinary size, its way into the plant."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tools.sitl.effects import Effects, InternalWave, SurfaceWaves, Timed
from tools.trial.outside import (
    DriftingTrim,
    Foreign,
    OneWayDrag,
    OneWayPlane,
    RestoringHysteresis,
    RotatingMass,
    StickyPlane,
)
from tools.trial.vehicle import Vehicle


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What the size of an effect is measured by: largest command (rad) and pitch (rad), length of the run."""

    vehicle: Vehicle
    command: float
    pitch: float
    duration_s: float
    step_s: float


@dataclass(frozen=True, slots=True)
class Kind:
    """An effect of the plant.

    is_bound  the smaller the size, the stronger (a limit on the plane)
    least     the smallest size that deserves the name
    """

    slot: str
    strongest: Callable[[Setting], float]
    is_signed: bool = False
    is_bound: bool = False
    least: float = 0.0


def _always(size: float) -> Callable[[Setting], float]:
    return lambda _: size


KINDS: Mapping[str, Kind] = {
    "heave_pitch_rate_coupling": Kind("heave", _always(1.2)),
    "heave_quadratic_drag": Kind("heave", lambda s: 6.0 * s.vehicle.heave_mass / s.vehicle.length),
    "net_buoyancy": Kind("heave", lambda s: 0.03 * s.vehicle.hull.weight, is_signed=True),
    "depth_dependent_buoyancy": Kind("heave", lambda s: 0.02 * s.vehicle.heave_mass),
    "ballast_change": Kind("heave", lambda s: 0.05 * s.vehicle.hull.mass, is_signed=True),
    "pitch_quadratic_damping": Kind("pitch", lambda s: 20.0 * s.vehicle.pitch_inertia),
    "trim_moment": Kind("pitch", lambda s: 0.2 * s.vehicle.hull.weight * s.vehicle.hull.zb, is_signed=True),
    "munk_moment": Kind("pitch", _always(1.0)),
    "large_angle_restoring": Kind("pitch", _always(1.5)),
    "large_angle_kinematics": Kind("kinematics", _always(1.5)),
    "speed_loss": Kind("surge", _always(1.5)),
    "actuator_lag": Kind("actuator", _always(1.5), least=0.03),
    "actuator_delay": Kind("actuator", _always(0.9), least=0.03),
    "actuator_rate_limit": Kind("actuator", lambda s: 0.1 * s.command, is_bound=True),
    "actuator_saturation": Kind("actuator", lambda s: 0.25 * s.command, is_bound=True),
    "actuator_backlash": Kind("actuator", lambda s: 0.6 * s.command),
    "rudder_offset": Kind("actuator", _always(0.1), is_signed=True),
    "rudder_stall": Kind("actuator", lambda s: 0.4 * s.command, is_bound=True),
    "rudder_effectiveness_change": Kind("actuator", _always(0.7)),
    "depth_sensor_lever_arm": Kind("sensor", lambda s: 0.5 * s.vehicle.length, is_signed=True),
    "depth_sensor_lag": Kind("sensor", _always(3.0), least=0.05),
    "pitch_bias": Kind("sensor", _always(0.1), is_signed=True),
    "pitch_sensor_lag": Kind("sensor", _always(1.5), least=0.05),
    "vertical_current": Kind("environment", _always(0.3), is_signed=True),
    "internal_wave": Kind("environment", _always(0.3)),
    "surface_waves": Kind("environment", _always(3.0)),
}
"""Names as in tools.sitl.effects."""

_Maker = Callable[[float, Setting, "Hidden"], Foreign]


@dataclass(frozen=True, slots=True)
class Stranger:
    """Physics outside the catalogue."""

    slot: str
    strongest: Callable[[Setting], float]
    make: _Maker


STRANGERS: Mapping[str, Stranger] = {
    "restoring_hysteresis": Stranger(
        "pitch",
        lambda s: -20.0 * s.vehicle.coefficients["a3"] / s.pitch**2,
        lambda size, s, _: RestoringHysteresis(size, 0.4 * s.pitch),
    ),
    "one_way_plane": Stranger("actuator", lambda _: 0.8, lambda size, s, _: OneWayPlane(size, 0.1 * s.pitch)),
    "rotating_mass": Stranger(
        "pitch",
        lambda s: -0.3 * s.vehicle.coefficients["a3"],
        lambda size, _, h: RotatingMass(size, h.period_s, h.phase),
    ),
    "sticky_plane": Stranger(
        "actuator", lambda s: 0.8 * s.command, lambda size, s, h: StickyPlane(size, h.place * s.command)
    ),
    "drifting_trim": Stranger(
        "pitch",
        lambda s: -0.3 * s.vehicle.coefficients["a3"],
        lambda size, s, _: DriftingTrim(size, s.duration_s),
    ),
    "one_way_drag": Stranger(
        "heave", lambda s: 20.0 / s.vehicle.length, lambda size, _, __: OneWayDrag(size)
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """One hidden effect, as drawn. `strength` is its share of the strongest ordinary size."""

    name: str
    sign: float
    at_s: float  # of what begins at a time
    period_s: float  # of what is periodic
    phase: float
    place: float  # share of the largest command, of what sits at one plane angle
    strength: float = 1.0

    @property
    def slot(self) -> str:
        """Where in the chain it acts."""
        return (KINDS.get(self.name) or STRANGERS[self.name]).slot

    @property
    def is_foreign(self) -> bool:
        """Whether no catalogue entry describes it."""
        return self.name in STRANGERS

    def size(self, setting: Setting) -> float:
        """In the unit of the plant's switch, or of the foreign physics."""
        if self.is_foreign:
            return STRANGERS[self.name].strongest(setting) * self.strength
        kind = KINDS[self.name]
        size = kind.strongest(setting)
        size = size / self.strength if kind.is_bound else self.sign * size * self.strength
        # The plant delays by whole steps of its integrator; the answer must say what was done.
        return round(size / setting.step_s) * setting.step_s if self.name == "actuator_delay" else size

    def deserves_its_name(self, setting: Setting) -> bool:
        """Whether it is large enough for anybody to speak of it."""
        return self.is_foreign or abs(self.size(setting)) >= KINDS[self.name].least

    def foreign(self, setting: Setting) -> Foreign | None:
        """The foreign physics, new at each run as it has a memory; None where the plant has a switch."""
        if not self.is_foreign:
            return None
        return STRANGERS[self.name].make(self.size(setting), setting, self)

    def switch(self, setting: Setting) -> dict[str, Any]:
        """The plant's switch for it."""
        size = self.size(setting)
        match self.name:
            case "ballast_change" | "rudder_effectiveness_change":
                return {self.name: Timed(size=size, at_s=self.at_s)}
            case "internal_wave":
                return {self.name: InternalWave(size=size, period_s=self.period_s)}
            case "surface_waves":
                return {self.name: SurfaceWaves(size=size, period_s=self.period_s)}
        return {} if self.is_foreign else {self.name: size}


def draw_hidden(rng: np.random.Generator, name: str, setting: Setting) -> Hidden:
    """All but the strength."""
    signed = name in KINDS and KINDS[name].is_signed
    sign = -1.0 if rng.random() < 0.5 else 1.0
    duration = setting.duration_s
    match name:
        case "internal_wave":
            period = max(20.0, duration * rng.uniform(0.15, 0.8))
        case "surface_waves":
            period = rng.uniform(4.0, 9.0)
        case _:
            period = rng.uniform(8.0, 40.0)
    return Hidden(
        name=name,
        sign=sign if signed else 1.0,
        at_s=round(duration * rng.uniform(0.2, 0.8), 1),
        period_s=period,
        phase=rng.uniform(0.0, 6.28),
        place=rng.uniform(-0.6, 0.6),
    )


def switched(hidden: tuple[Hidden, ...], setting: Setting) -> Effects:
    """The plant's switches for all that is hidden."""
    values: dict[str, Any] = {}
    for effect in hidden:
        values |= effect.switch(setting)
    return Effects(**values)


def with_strength(hidden: Hidden, strength: float) -> Hidden:
    """The same effect, stronger or weaker."""
    return replace(hidden, strength=strength)
