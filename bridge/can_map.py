"""Which signal of a CAN bus is which quantity: the [can] table of a vehicle file."""

from dataclasses import dataclass
from math import isfinite
from typing import Literal

from bridge.measurement import Quantity

STANDARD_GRAVITY = 9.80665  # m/s2


@dataclass(frozen=True, slots=True, kw_only=True)
class CanSelector:
    """Takes a message only when one of its signals has this raw value, e.g. the instance of a rudder."""

    signal: str
    value: int


@dataclass(frozen=True, slots=True, kw_only=True)
class CanSignal:
    """quantity = scale * signal + offset, in SI units.

    quantity  a `Quantity`, or "pressure": Pa absolute, turned into depth
    message   name of the DBC's message; PGN ("127257") or DroneCAN data type id ("1011") as text
    signal    name of the signal or field
    only      all of these must hold
    time      signal of the same message with the vehicle's own time in s; None: the receive time counts
    """

    quantity: Literal["depth", "pitch", "rudder", "speed", "pitch_rate", "pressure"]
    message: str
    signal: str
    scale: float = 1.0
    offset: float = 0.0
    only: tuple[CanSelector, ...] = ()
    time: str | None = None

    def __post_init__(self) -> None:
        if not isfinite(self.scale) or self.scale == 0.0:
            raise ValueError(f"scale must be finite and not 0 (got {self.scale})")
        if not isfinite(self.offset):
            raise ValueError(f"offset must be finite (got {self.offset})")


@dataclass(frozen=True, slots=True, kw_only=True)
class CanMap:
    """The bus of one vehicle.

    kind              what its frames mean: a DBC file, NMEA 2000 or DroneCAN
    dbc               path of the DBC (or KCD, SYM, ARXML) file; None: the default DBC of this package
    signals           empty: the default table of the kind
    pitch_sign        -1 where the bus counts nose down as positive; holds for pitch and pitch rate
    rudder_sign       -1 where a positive angle on the bus pitches the nose up
    rudder_instance   NMEA 2000 Instance, or DroneCAN actuator id, of the stern plane in the default tables
    source_address    only this sender; None: per signal the first that speaks, until it falls silent
    water_density     kg/m3
    gravity           m/s2
    surface_pressure_hpa  hPa, of the air above the water
    publish           send estimates onto the bus; None: only where the default DBC is in use
    """

    kind: Literal["dbc", "nmea2000", "dronecan"] = "dbc"
    dbc: str | None = None
    signals: tuple[CanSignal, ...] = ()
    pitch_sign: int = 1
    rudder_sign: int = 1
    rudder_instance: int = 0
    source_address: int | None = None
    water_density: float = 1025.0
    gravity: float = STANDARD_GRAVITY
    surface_pressure_hpa: float = 1013.25
    publish: bool | None = None

    def __post_init__(self) -> None:
        if self.kind != "dbc" and self.dbc is not None:
            raise ValueError(f'dbc must be left out when kind is "{self.kind}" (got {self.dbc})')
        if self.kind == "dbc" and self.source_address is not None:
            raise ValueError(
                f'source_address must be left out when kind is "dbc" (got {self.source_address})'
            )
        if self.kind == "dbc" and self.dbc is not None and not self.signals:
            raise ValueError("signals must name the messages of your own dbc (got none)")
        for name in ("pitch_sign", "rudder_sign"):
            if getattr(self, name) not in (1, -1):
                raise ValueError(f"{name} must be 1 or -1 (got {getattr(self, name)})")
        if not 0 <= self.rudder_instance <= 255:
            raise ValueError(f"rudder_instance must be 0 to 255 (got {self.rudder_instance})")
        if self.source_address is not None and not 0 <= self.source_address <= 253:
            raise ValueError(f"source_address must be 0 to 253 (got {self.source_address})")
        if not 500.0 <= self.water_density <= 1500.0:
            raise ValueError(f"water_density must be 500 to 1500 kg/m3 (got {self.water_density})")
        if not 9.0 <= self.gravity <= 10.0:
            raise ValueError(f"gravity must be 9 to 10 m/s2 (got {self.gravity})")
        if not 300.0 <= self.surface_pressure_hpa <= 1200.0:
            raise ValueError(f"surface_pressure_hpa must be 300 to 1200 (got {self.surface_pressure_hpa})")

    @property
    def publishes(self) -> bool:
        """Whether estimates go out: on a bus laid out by someone else only when asked for."""
        if self.publish is None:
            return self.kind == "dbc" and self.dbc is None
        return self.publish

    def table(self) -> tuple[CanSignal, ...]:
        """The signals in use."""
        if self.signals:
            return self.signals
        if self.kind == "nmea2000":
            return self._nmea2000_table()
        if self.kind == "dronecan":
            return self._dronecan_table()
        return tuple(
            CanSignal(quantity=quantity, message=quantity.upper(), signal=quantity, time="time")
            for quantity in ("depth", "pitch", "rudder", "speed", "pitch_rate")
        )

    def to_quantity(self, signal: CanSignal, raw: float) -> tuple[Quantity, float]:
        """Quantity and SI value of a raw signal value, in this program's signs."""
        value = signal.scale * raw + signal.offset
        if signal.quantity == "pressure":
            surface = 100.0 * self.surface_pressure_hpa
            return Quantity.DEPTH, (value - surface) / (self.water_density * self.gravity)
        return Quantity(signal.quantity), self._sign(signal) * value

    def from_quantity(self, signal: CanSignal, value: float) -> float:
        """Inverse of `to_quantity`."""
        if signal.quantity == "pressure":
            value = 100.0 * self.surface_pressure_hpa + self.water_density * self.gravity * value
        else:
            value *= self._sign(signal)
        return (value - signal.offset) / signal.scale

    def _sign(self, signal: CanSignal) -> int:
        if signal.quantity in ("pitch", "pitch_rate"):
            return self.pitch_sign
        return self.rudder_sign if signal.quantity == "rudder" else 1

    def _nmea2000_table(self) -> tuple[CanSignal, ...]:
        # 128267 "water depth" is the water UNDER the transducer and never the vehicle's depth.
        plane = CanSelector(signal="instance", value=self.rudder_instance)
        water = CanSelector(signal="source", value=1)
        return (
            CanSignal(quantity="pitch", message="127257", signal="pitch"),
            CanSignal(quantity="rudder", message="127245", signal="position", only=(plane,)),
            CanSignal(quantity="pressure", message="130314", signal="pressure", only=(water,)),
            CanSignal(quantity="speed", message="128259", signal="water_speed"),
        )

    def _dronecan_table(self) -> tuple[CanSignal, ...]:
        plane = CanSelector(signal="actuator_id", value=self.rudder_instance)
        return (
            CanSignal(quantity="pitch", message="1000", signal="pitch"),
            CanSignal(quantity="pitch_rate", message="1000", signal="pitch_rate"),
            CanSignal(quantity="rudder", message="1011", signal="position", only=(plane,)),
            CanSignal(quantity="pressure", message="1028", signal="static_pressure"),
        )
