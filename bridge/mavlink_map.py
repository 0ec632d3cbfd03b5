"""Which MAVLink messages of which vehicle are depth, pitch and stern plane, and how they are scaled."""

from dataclasses import dataclass
from math import isfinite
from typing import Literal

DepthSource = Literal[
    "auto",
    "SCALED_PRESSURE",
    "SCALED_PRESSURE2",
    "SCALED_PRESSURE3",
    "VFR_HUD",
    "AHRS2",
    "LOCAL_POSITION_NED",
]
SpeedSource = Literal["none", "LOCAL_POSITION_NED", "VFR_HUD"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoTerm:
    """One output channel's share of the rudder: rad_per_us * (pulse - trim_us)."""

    channel: int  # 1-32 as in SERVOn_FUNCTION
    rad_per_us: float  # the sign says which way it acts; positive rudder pitches the nose down
    trim_us: float = 1500.0

    def __post_init__(self) -> None:
        if not 1 <= self.channel <= 32:
            raise ValueError(f"channel must be in 1..32 (got {self.channel})")
        if not isfinite(self.rad_per_us) or self.rad_per_us == 0.0:
            raise ValueError(f"rad_per_us must be finite and not 0 (got {self.rad_per_us})")
        if not 500.0 <= self.trim_us <= 2500.0:
            raise ValueError(f"trim_us must be in 500..2500 (got {self.trim_us})")


@dataclass(frozen=True, slots=True, kw_only=True)
class MavlinkMap:
    """One vehicle's MAVLink, both ways. The defaults suit ArduSub in sea water.

    `rudder` is a linear mix of SERVO_OUTPUT_RAW channels, so that one plane, two planes or the thrusters of a
    finless vehicle are all said in the same way; empty means that the link carries no rudder.
    """

    system_id: int | None = None  # None: lock to the first autopilot's heartbeat
    component_id: int | None = 1  # None: the component of that heartbeat

    depth_source: DepthSource = "auto"  # auto: the best one heard within 3 s, pressure before height
    water_density: float = 1025.0  # kg/m3; fresh water 998
    gravity: float = 9.80665  # m/s2
    surface_pressure_hpa: float | None = (
        None  # None: the first sample if that can be the surface, else 1013.25
    )
    repeat_hold_s: float = 0.15  # an equal pressure younger than this is the same sample sent again

    pitch_sign: int = 1  # -1 for an autopilot mounted backwards
    pitch_rate: bool = True
    rudder: tuple[ServoTerm, ...] = ()
    csrv_id: int | None = (
        None  # in .BIN: the servo whose reported angle (CSRV.Pos, rad) is the rudder instead
    )
    csrv_sign: int = 1
    speed_source: SpeedSource = "none"

    attitude_rate_hz: float = 20.0  # requested from the vehicle; 0 leaves its own rate
    depth_rate_hz: float = 10.0
    servo_rate_hz: float = 20.0
    speed_rate_hz: float = 5.0

    own_system_id: int | None = None  # None: the vehicle's
    own_component_id: int = 191  # MAV_COMP_ID_ONBOARD_COMPUTER

    def __post_init__(self) -> None:
        for name in ("system_id", "component_id", "own_system_id", "own_component_id"):
            value = getattr(self, name)
            if value is not None and not 1 <= value <= 255:
                raise ValueError(f"{name} must be in 1..255 (got {value})")
        if self.own_system_id == 255:
            raise ValueError("own_system_id must not be 255, which hides a lost ground station (got 255)")
        if self.own_component_id == 1:
            raise ValueError("own_component_id must not be 1, the autopilot's (got 1)")
        if not 500.0 <= self.water_density <= 1500.0:
            raise ValueError(f"water_density must be in 500..1500 kg/m3 (got {self.water_density})")
        if not 9.0 <= self.gravity <= 10.0:
            raise ValueError(f"gravity must be in 9..10 m/s2 (got {self.gravity})")
        if self.surface_pressure_hpa is not None and not 300.0 <= self.surface_pressure_hpa <= 1200.0:
            raise ValueError(f"surface_pressure_hpa must be in 300..1200 (got {self.surface_pressure_hpa})")
        if not 0.0 <= self.repeat_hold_s <= 60.0:
            raise ValueError(f"repeat_hold_s must be in 0..60 (got {self.repeat_hold_s})")
        for name in ("pitch_sign", "csrv_sign"):
            if getattr(self, name) not in (1, -1):
                raise ValueError(f"{name} must be 1 or -1 (got {getattr(self, name)})")
        channels = [term.channel for term in self.rudder]
        if len(set(channels)) != len(channels):
            raise ValueError(f"rudder must name each channel once (got {channels})")
        for name in ("attitude_rate_hz", "depth_rate_hz", "servo_rate_hz", "speed_rate_hz"):
            value = getattr(self, name)
            if not 0.0 <= value <= 200.0:
                raise ValueError(f"{name} must be in 0..200 Hz (got {value})")
