"""The physics that the base model leaves out, one entry an effect, in the order of the chain.

The names are a contract: reports, tests and users rely on them.
"""

import copyreg

from host.catalogue import (
    actuator,
    changes,
    environment,
    flow,
    heave,
    kinematics,
    moments,
    nuisance,
    pitch,
    sensor,
    surge,
    unknown,
)
from host.dynamics.equations import Effect, Structure

NEAR_THE_SURFACE = environment.NEAR_THE_SURFACE
_IN_ORDER: tuple[Effect, ...] = (
    *environment.EFFECTS,  # first: the speed through the water may depend on how that moves
    *surge.EFFECTS,
    *flow.EFFECTS,
    *heave.EFFECTS,
    *NEAR_THE_SURFACE,
    *pitch.EFFECTS,
    *heave.BY_TURNING,  # by all that turns the hull
    *kinematics.EFFECTS,
    *actuator.EFFECTS,
    *sensor.EFFECTS,
)
CATALOGUE = tuple(effect for effect in _IN_ORDER if effect not in NEAR_THE_SURFACE)
CHANGES = changes.EFFECTS
"""Entries that are tried only after an alarm, or where a change shows."""
BY_NAME = {effect.name: effect for effect in (*CHANGES, *_IN_ORDER)}  # what changes a speed, before its loss
UNKNOWN = {effect.name: effect for effect in unknown.FORMS}
_TOOLS = (
    nuisance.FREE_TRIM,
    nuisance.PLANE_BEFORE,
    nuisance.SPEED_CORRECTION,
    unknown.ANY_SMOOTH_FORCE,
)
_ENTRIES = (effect for name, entry in BY_NAME.items() for effect in (entry, moments.SCANS.get(name)))
_ALL = {effect.name: effect for effect in (*filter(None, _ENTRIES), *UNKNOWN.values(), *_TOOLS)}
ORDINARY = (
    "heave_pitch_rate_coupling",
    "large_angle_kinematics",
    "speed_loss",
    "munk_moment",
    "actuator_lag",
    "large_angle_restoring",
    "heave_quadratic_drag",
    "pitch_quadratic_damping",
    "surge_pitch_coupling",
)
"""What acts on every vehicle, strong or weak, beside an imperfect trim: the largest part first."""
FAINT = ("heave_pitch_acceleration_coupling", "plane_in_cross_flow", "speed_independent_damping")
"""What every vehicle has, too, but too weak to be found before all that is ordinary is there."""
ALONG_THE_HULL = "drag_along_the_hull"
"""Of every long hull, but of no simulator that knows two drags only."""
DRIVE = (
    "actuator_backlash",
    "actuator_rate_limit",
    "actuator_saturation",
    "actuator_delay",
    "rudder_stall",
)
"""What may keep a plane from where it is commanded to: then no hull follows the commands."""
OVER_GROUND = "speed_over_ground"
"""Of moving water, where the speed was measured against the bottom, or by a simulator."""


def named(name: str) -> Effect:
    """The entry of that name, or the form of unknown physics. Raises KeyError where there is none."""
    return _ALL[name]


# Between processes an effect travels by its name: its equations are code.
copyreg.pickle(Effect, lambda effect: (named, (effect.name,)))


def structure_of(names: frozenset[str] | tuple[str, ...]) -> Structure:
    """The base equations with the named effects. Raises KeyError for a name that is not in the catalogue."""
    foreign = [name for name in names if name not in _ALL]
    if foreign:
        raise KeyError(foreign[0])
    return Structure(tuple(effect for effect in _ALL.values() if effect.name in names))
