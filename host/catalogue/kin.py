"""Which effects resemble one another in what a recording shows of them."""

import numpy as np
from numpy.typing import NDArray

from host.catalogue.moments import SCANS
from host.catalogue.nuisance import FREE_TRIM
from host.dynamics.equations import Effect

OFFSETS = ("net_buoyancy", "trim_moment", "rudder_offset", "pitch_bias", "vertical_current")
"""Effects that do no more than shift the steady state, as nuisance.FREE_TRIM does without saying why."""
PITCHING_INTO_DEPTH = (
    "heave_pitch_rate_coupling",
    "heave_pitch_acceleration_coupling",
    "depth_sensor_lever_arm",
    "depth_sensor_lag",
)
"""Effects that move the recorded depth with the pitch rate; the base, bent for each its own way, does the
rest."""

AS_A_LEVER = {"depth_sensor_lever_arm": "sensor_forward", "heave_pitch_acceleration_coupling": "c_wa"}
"""Of those, two that do the very same beside another coupling and pitch damping, with their sizes."""


def moving_alike(known: dict[str, float], name: str, size: float) -> dict[str, float]:
    """What the coefficients are beside a lever arm of this size, or its double, if those without move alike.

    With s = w - x q, the heave speed at a sensor x ahead, the equations of w and q are those of s and q with
    a1 - c_qw x, b1 - b2 x, c_wq - a2 x + (a1 - c_qw x) x and a2 + c_qw x in the place of a1, b1, c_wq and a2.
    A c_wa adds to heave what q' is. Unchanged where the set has no c_wq to move with them, or one of the two:
    what a3 does to heave beside them is all that tells such motions apart.
    """
    if "c_wq" not in known or not known.keys().isdisjoint(AS_A_LEVER.values()):
        return known
    munk = known.get("c_qw", 0.0)
    if name == "depth_sensor_lever_arm":
        a2 = known["a2"] - munk * size
        moved = {
            "a1": known["a1"] + munk * size,
            "b1": known["b1"] + known["b2"] * size,
            "a2": a2,
            "c_wq": known["c_wq"] + (a2 - known["a1"]) * size,
        }
    else:
        moved = {
            "a1": known["a1"] - munk * size,
            "b1": known["b1"] - known["b2"] * size,
            "c_wq": known["c_wq"] - known["a2"] * size,
        }
    return known | moved


def is_time(effect: Effect) -> bool:
    """Whether a delay or a time constant is all that it has."""
    return [parameter.unit for parameter in effect.parameters] == ["s"]


def measure_alike(one: Effect, other: Effect) -> bool:
    """Whether the first parameter of one suits the other: both delay, or share a slot and the unit."""
    if is_time(one) and is_time(other):
        return True
    return (one.slot, one.parameters[0].unit) == (other.slot, other.parameters[0].unit)


def both_come(one: Effect, other: Effect) -> bool:
    """Whether both are changes at one moment."""
    return one.name in SCANS and other.name in SCANS


def as_trim(known: dict[str, float], name: str) -> NDArray[np.float64]:
    """Constant force and moment that one unit of an offset is: (2, its parameters).

    A climb is held by force / -a1.
    """
    a1, a3, u0, b1, b2 = (known[parameter] for parameter in ("a1", "a3", "u0", "b1", "b2"))
    columns = {
        FREE_TRIM.name: [[1.0, 0.0], [0.0, 1.0]],
        "net_buoyancy": [[1.0], [0.0]],
        "trim_moment": [[0.0], [1.0]],
        "rudder_offset": [[b1], [b2]],
        "pitch_bias": [[-a1 * u0], [-a3]],
        "vertical_current": [[-a1], [0.0]],
    }
    return np.array(columns[name])
