"""A single physical quantity, in SI units, with the time of its own sensor clock."""

from dataclasses import dataclass
from enum import StrEnum


class Quantity(StrEnum):
    """What is measured; the values are the names used in journals and vehicle files."""

    DEPTH = "depth"  # m, down
    PITCH = "pitch"  # rad, nose up
    RUDDER = "rudder"  # rad, stern plane, positive pitches the nose down
    SPEED = "speed"  # m/s, forward through the water
    PITCH_RATE = "pitch_rate"  # rad/s, nose up


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """One value that passed every check of its decoder: finite, fresh, from the chosen vehicle.

    t_us    microseconds on the vehicle's own clock where the message carries one, else receive time moved
            onto that clock; never runs backwards within a boot
    source  message or signal it came from, e.g. "ATTITUDE", "SCALED_PRESSURE2", "NMEA2000 127257"
    boot    counts the vehicle's restarts seen so far; a change means that nothing may be joined across it
    """

    quantity: Quantity
    value: float
    t_us: int
    source: str
    boot: int = 0
