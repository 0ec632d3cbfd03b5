"""A scenario file: the vehicle, the sea, the instruments and the messages of one simulated run."""

import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from tools.sitl.effects import REALISTIC, Effects
from tools.sitl.errors import ScenarioError
from tools.sitl.excitation import Excitation
from tools.sitl.hull import Hull
from tools.sitl.sensors import Sensors
from tools.sitl.strict import build, require

SCENARIOS = Path(__file__).parent / "scenarios"


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Where and how fast the run begins, in straight and level motion."""

    depth: float = 20.0  # m
    pitch: float = 0.0  # rad
    heave: float = 0.0  # m/s, body axes, through the water
    pitch_rate: float = 0.0  # rad/s
    speed: float = 2.5  # m/s through the water

    def __post_init__(self) -> None:
        require(self.depth >= 0.0, "depth", "be >= 0 m", self.depth)
        require(abs(self.pitch) < 1.5, "pitch", "be within 1.5 rad", self.pitch)
        require(self.speed > 0.0, "speed", "be > 0 m/s", self.speed)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rates:
    """Messages a second until somebody asks for another rate; 0 for none."""

    attitude: float = 10.0
    pressure: float = 10.0
    servo: float = 10.0
    vfr_hud: float = 4.0
    local_position: float = 0.0

    def __post_init__(self) -> None:
        for name in ("attitude", "pressure", "servo", "vfr_hud", "local_position"):
            require(0.0 <= getattr(self, name) <= 200.0, name, "be in [0, 200] Hz", getattr(self, name))


@dataclass(frozen=True, slots=True, kw_only=True)
class Mavlink:
    """How the autopilot speaks.

    Pressure is surface_pressure_pa + density * gravity * depth. The servo pulse is
    servo_trim_us + servo_us_per_rad * command, in the field servo<channel>_raw.
    """

    system: int = 1
    component: int = 1
    rates: Rates = field(default_factory=Rates)
    surface_pressure_pa: float = 101325.0
    density: float = 1025.0  # kg/m3
    gravity: float = 9.80665  # m/s2
    pressure_is_sampled: bool = (
        True  # sent between samples of sensors.depth.rate_hz, the last sample is repeated
    )
    servo_channel: int = 1
    servo_trim_us: float = 1500.0
    servo_us_per_rad: float = 1000.0
    boot_clock_s: float = 0.0  # the boot clock at the start; 4290 makes time_usec wrap after 5 s
    reboot_at_s: float = 0.0  # 0 for never
    reboot_lasts_s: float = 3.0
    boot_text: bool = False  # ASCII on the link at each boot
    statustext_hz: float = 0.0
    parameters_hz: float = 0.0  # PARAM_VALUE as in a parameter download

    def __post_init__(self) -> None:
        require(1 <= self.system <= 254, "system", "be in 1..254", self.system)
        require(1 <= self.component <= 255, "component", "be in 1..255", self.component)
        require(self.density > 0.0, "density", "be > 0 kg/m3", self.density)
        require(1 <= self.servo_channel <= 16, "servo_channel", "be in 1..16", self.servo_channel)
        require(self.servo_us_per_rad != 0.0, "servo_us_per_rad", "not be 0", self.servo_us_per_rad)
        for name in ("boot_clock_s", "reboot_at_s", "reboot_lasts_s", "statustext_hz", "parameters_hz"):
            require(getattr(self, name) >= 0.0, name, "be >= 0", getattr(self, name))


@dataclass(frozen=True, slots=True, kw_only=True)
class Can:
    """How the bus speaks: each message of the DBC that has a signal named here, at its channel's rate."""

    dbc: str = ""  # "" for the one that the caller gives
    depth: str = "depth"
    pitch: str = "pitch"
    rudder: str = "rudder"
    speed: str = "speed"
    pitch_rate: str = "pitch_rate"
    time: str = "time"  # s, the vehicle's own clock


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One simulated run. `flavour` says which effects are on unless the table `effects` says otherwise."""

    name: str = "unnamed"
    flavour: Literal["linear", "realistic"] = "linear"
    duration_s: float = 300.0  # 0 for without end on a link
    step_s: float = 0.01  # of the integrator
    seed: int = 1
    start: Start = field(default_factory=Start)
    hull: Hull = field(default_factory=Hull)
    effects: Effects = field(default_factory=Effects)
    excitation: Excitation = field(default_factory=Excitation)
    sensors: Sensors = field(default_factory=Sensors)
    mavlink: Mavlink = field(default_factory=Mavlink)
    can: Can = field(default_factory=Can)
    folder: str = "."  # where a relative file named in the scenario is looked for; that of the scenario file

    def __post_init__(self) -> None:
        require(self.duration_s >= 0.0, "duration_s", "be >= 0 s", self.duration_s)
        require(0.0 < self.step_s <= 0.1, "step_s", "be in (0, 0.1] s", self.step_s)
        require(self.seed >= 0, "seed", "be >= 0", self.seed)
        steps = self.excitation.update_s / self.step_s
        whole = round(steps) >= 1 and abs(steps - round(steps)) < 1e-6
        require(whole, "excitation.update_s", "be a multiple of step_s", self.excitation.update_s)


def parse(text: str, folder: Path = Path()) -> Scenario:
    """A scenario from TOML text. Raises ScenarioError."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"scenario is not TOML: {error}") from error
    if table.get("flavour") == "realistic" and isinstance(table.setdefault("effects", {}), dict):
        table["effects"] = REALISTIC | table["effects"]
    table.setdefault("folder", str(folder))
    return build(Scenario, table)


def load(name: str) -> Scenario:
    """The scenario of a TOML file, or the shipped one of that name ("default", "rough_sea", ...).

    Raises ScenarioError when there is no such file or it breaks a rule; the message names the file.
    """
    path = Path(name)
    if not path.suffix and (SCENARIOS / f"{name}.toml").is_file():
        path = SCENARIOS / f"{name}.toml"
    try:
        return parse(path.read_text(encoding="utf-8"), path.parent)
    except OSError as error:
        shipped = ", ".join(sorted(file.stem for file in SCENARIOS.glob("*.toml")))
        raise ScenarioError(
            f"scenario {name} cannot be read: {error.strerror}; shipped ones: {shipped}"
        ) from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"scenario {name} is not UTF-8 text") from error
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error}") from error
