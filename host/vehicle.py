"""The vehicle file: what the program has to know about one vehicle, with unit and range beside each key."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from bridge.can_map import CanMap
from bridge.mavlink_map import MavlinkMap
from firmware_model.config import EstimatorConfig
from host.live.align import AlignConfig
from host.live.mismatch import MismatchConfig
from host.live.state import fingerprint
from host.recordings.csv_map import CsvMap
from host.toml_config import MAY_BE_INFINITE, build, read_toml, shared, to_table, to_toml


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkConfig:
    """Where the measurements come from."""

    url: str = "udp:127.0.0.1:14550"  # scheme:address, see `mils doctor`
    # > 0, times real time for log: links; inf as fast as it can be read
    log_speed: float = field(default=1.0, metadata=MAY_BE_INFINITE)
    silence: float = 5.0  # s, > 0: a quantity that does not come for so long is reported, once
    reopen_for: float = 600.0  # s, >= 0: how long a lost link is tried again; 0 never

    def __post_init__(self) -> None:
        if ":" not in self.url:
            raise ValueError(f"url must be scheme:address, e.g. udp:127.0.0.1:14550 (got {self.url!r})")
        if not self.log_speed > 0:
            raise ValueError(f"log_speed must be above 0 (got {self.log_speed})")
        if not 0 < self.silence <= 1e6:
            raise ValueError(f"silence must be above 0 s (got {self.silence})")
        if not 0 <= self.reopen_for <= 1e9:
            raise ValueError(f"reopen_for must be 0 s or more (got {self.reopen_for})")


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishConfig:
    """What goes back onto the link."""

    enabled: bool = True
    period: float = 1.0  # s, >= 0.05: between two sets of estimates, also in the journal

    def __post_init__(self) -> None:
        if not 0.05 <= self.period <= 1e6:
            raise ValueError(f"period must be at least 0.05 s (got {self.period})")


@dataclass(frozen=True, slots=True, kw_only=True)
class JournalConfig:
    """Where a live run is recorded."""

    folder: Path = Path("journals")  # relative to the vehicle file; left out, to where the program runs
    sync_period: float = 5.0  # s, > 0: what a loss of power may cost; a killed process loses nothing

    def __post_init__(self) -> None:
        if not 0 < self.sync_period <= 1e6:
            raise ValueError(f"sync_period must be above 0 s (got {self.sync_period})")


@dataclass(frozen=True, slots=True, kw_only=True)
class StateConfig:
    """Whether and where what was learnt is kept between runs."""

    enabled: bool = True
    file: Path | None = None  # default: <name>.state.json in the journal's folder
    period: float = 30.0  # s, > 0: between two saves

    def __post_init__(self) -> None:
        if not 0 < self.period <= 1e6:
            raise ValueError(f"period must be above 0 s (got {self.period})")


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """One vehicle. [alignment] gives the estimator its step, `speed` its speed."""

    schema: Literal[1] = 1
    name: str  # stands in journals, states and models; 1 to 60 characters
    speed: float  # m/s through the water, 0.05 to 20: forward speed u0 where none is measured
    link: LinkConfig = LinkConfig()
    alignment: AlignConfig = AlignConfig()
    mavlink: MavlinkMap = MavlinkMap()
    can: CanMap = CanMap()
    csv: CsvMap = CsvMap()
    estimator: EstimatorConfig = field(metadata=shared(step="alignment.step", speed="speed"))
    mismatch: MismatchConfig = MismatchConfig()
    publish: PublishConfig = PublishConfig()
    journal: JournalConfig = JournalConfig()
    state: StateConfig = StateConfig()

    def __post_init__(self) -> None:
        if not 1 <= len(self.name.strip()) <= 60:
            raise ValueError(f"name must be 1 to 60 characters (got {self.name!r})")
        if not 0.05 <= self.speed <= 20:
            raise ValueError(f"speed must be 0.05 to 20 m/s (got {self.speed})")
        if (self.estimator.step, self.estimator.speed) != (self.alignment.step, self.speed):
            raise ValueError(
                f"estimator must have the vehicle's step and speed {self.alignment.step} s, {self.speed} m/s "
                f"(got {self.estimator.step} s, {self.estimator.speed} m/s)"
            )

    @property
    def state_file(self) -> Path:
        name = "".join(c if c.isalnum() or c in "._-" else "_" for c in self.name)
        return self.state.file or self.journal.folder / f"{name}.state.json"

    @property
    def meaning(self) -> str:
        """Fingerprint of the tables on which the meaning of a learnt parameter depends."""
        table = effective_table(self)
        return fingerprint({key: table[key] for key in ("speed", "alignment", "mavlink", "can", "estimator")})


def read_vehicle(path: Path) -> Vehicle:
    """Reads a vehicle file. Raises ConfigError with one line: file, dotted key, rule, value."""
    vehicle = read_toml(path, Vehicle)
    # The bridge knows no vehicle files: what it opens is made relative to the file here.
    if vehicle.link.url.startswith("log:"):
        log = path.parent / vehicle.link.url.removeprefix("log:")
        vehicle = replace(vehicle, link=replace(vehicle.link, url=f"log:{log}"))
    if vehicle.can.dbc is not None:
        vehicle = replace(vehicle, can=replace(vehicle.can, dbc=str(path.parent / vehicle.can.dbc)))
    return vehicle


def vehicle_from_table(table: Mapping[str, Any], *, file: str) -> Vehicle:
    """The vehicle of a journal's header or of a model; `file` names it in messages. Raises ConfigError."""
    return build(Vehicle, table, file=file, folder=Path())


def default_vehicle() -> Vehicle:
    """What holds where no vehicle file is given."""
    return vehicle_from_table({"name": "vehicle", "speed": 1.5}, file="defaults")


def effective_table(vehicle: Vehicle) -> dict[str, Any]:
    """The configuration in force, defaults filled in, for JSON: `vehicle_from_table` takes it back."""
    return to_table(vehicle)


def effective_toml(vehicle: Vehicle) -> str:
    """The configuration in force, defaults filled in, as a vehicle file."""
    return to_toml(vehicle)
