"""The physics that the base model leaves out, one entry an effect, in the order of the chain.

The names are a contract: reports, tests and users rely on them.
"""

from host.catalogue import actuator, environment, heave, kinematics, pitch, sensor, surge
from host.equations import Effect, Structure

CATALOGUE: tuple[Effect, ...] = (
    *surge.EFFECTS,
    *heave.EFFECTS,
    *pitch.EFFECTS,
    *kinematics.EFFECTS,
    *actuator.EFFECTS,
    *sensor.EFFECTS,
    *environment.EFFECTS,
)
BY_NAME = {effect.name: effect for effect in CATALOGUE}


def structure_of(names: frozenset[str] | tuple[str, ...]) -> Structure:
    """The base equations with the named effects. Raises KeyError for a name that is not in the catalogue."""
    unknown = [name for name in names if name not in BY_NAME]
    if unknown:
        raise KeyError(unknown[0])
    return Structure(tuple(effect for effect in CATALOGUE if effect.name in names))
