"""How the columns of a text recording become depth, pitch and rudder."""

from dataclasses import dataclass

UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "depth": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "ft": 0.3048},
    "pitch": {"rad": 1.0, "deg": 0.017453292519943295},
    "rudder": {"rad": 1.0, "deg": 0.017453292519943295, "raw": 1.0},
    "speed": {"m/s": 1.0, "kn": 0.5144444444444445},
    "pitch_rate": {"rad/s": 1.0, "deg/s": 0.017453292519943295},
}
"""Factor to SI of every unit a column may have. "raw" is for actuators that are no planes (battery, PWM)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CsvColumn:
    """SI value = sign * (column value * unit) * scale + offset."""

    column: str
    unit: str
    sign: int = 1
    scale: float = 1.0
    offset: float = 0.0  # in SI, added last

    def __post_init__(self) -> None:
        if self.sign not in (1, -1):
            raise ValueError(f"sign must be 1 or -1 (got {self.sign})")
        if self.scale == 0.0:
            raise ValueError(f"scale must not be 0 (got {self.scale})")


def _in_si(column: str, unit: str) -> CsvColumn:
    return CsvColumn(column=column, unit=unit)


@dataclass(frozen=True, slots=True, kw_only=True)
class CsvMap:
    """Columns of a text recording; the defaults are the project's own format."""

    time: CsvColumn = _in_si("time_s", "s")
    depth: CsvColumn = _in_si("depth_m", "m")
    pitch: CsvColumn = _in_si("pitch_rad", "rad")
    rudder: CsvColumn = _in_si("rudder_rad", "rad")
    speed: CsvColumn = _in_si("speed_mps", "m/s")
    pitch_rate: CsvColumn = _in_si("pitch_rate_radps", "rad/s")

    def __post_init__(self) -> None:
        for quantity, units in UNITS.items():
            unit = getattr(self, quantity).unit
            if unit not in units:
                raise ValueError(f"{quantity}.unit must be one of {', '.join(units)} (got {unit!r})")
