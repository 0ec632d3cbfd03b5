"""What a real vehicle does and the paper's linear one does not: a switch for each, all off by default."""

from dataclasses import dataclass, field, fields
from typing import Any

from tools.sitl.strict import require


@dataclass(frozen=True, slots=True, kw_only=True)
class Timed:
    """An effect that begins in the middle of the run."""

    size: float = 0.0
    at_s: float = 0.0

    def __post_init__(self) -> None:
        require(self.at_s >= 0.0, "at_s", "be >= 0 s", self.at_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class InternalWave:
    """Slow sinusoidal vertical motion of the water, the same at every depth the vehicle visits."""

    size: float = 0.0  # m/s, amplitude of the vertical water velocity
    period_s: float = 120.0

    def __post_init__(self) -> None:
        require(self.period_s > 0.0, "period_s", "be > 0 s", self.period_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceWaves:
    """Irregular head seas of a narrow spectrum; their motion decays with depth as exp(-k z)."""

    size: float = 0.0  # m, significant wave height
    period_s: float = 6.0  # of the spectral peak
    components: int = 12

    def __post_init__(self) -> None:
        require(self.size >= 0.0, "size", "be >= 0 m", self.size)
        require(self.period_s > 0.0, "period_s", "be > 0 s", self.period_s)
        require(1 <= self.components <= 200, "components", "be in 1..200", self.components)


def _size(unit: str) -> Any:
    return field(default=0.0, metadata={"unit": unit})


@dataclass(frozen=True, slots=True, kw_only=True)
class Effects:
    """Sizes of all effects; 0 switches one off. A "share" of 1 is the whole physical term of this hull.

    heave     heave_pitch_rate_coupling, heave_quadratic_drag, net_buoyancy (up), depth_dependent_buoyancy
              (lost per metre below the start), ballast_change (kg taken on at a time)
    pitch     pitch_quadratic_damping, trim_moment (nose up), munk_moment, large_angle_restoring
    motion    large_angle_kinematics, speed_loss (surge momentum balance in place of a constant speed)
    actuator  see tools.sitl.actuator; rudder_effectiveness_change is the share of force lost
    sensor    depth_sensor_lever_arm (ahead of the centre of gravity), pitch_bias, first-order lags
    water     vertical_current (down), internal_wave, surface_waves
    """

    heave_pitch_rate_coupling: float = _size("share")
    heave_quadratic_drag: float = _size("kg/m")
    net_buoyancy: float = _size("N")
    depth_dependent_buoyancy: float = _size("N/m")
    ballast_change: Timed = field(default=Timed(), metadata={"unit": "kg"})
    pitch_quadratic_damping: float = _size("kg m2")
    trim_moment: float = _size("N m")
    munk_moment: float = _size("share")
    large_angle_restoring: float = _size("share")
    large_angle_kinematics: float = _size("share")
    speed_loss: float = _size("share")
    actuator_lag: float = _size("s")
    actuator_delay: float = _size("s")
    actuator_rate_limit: float = _size("rad/s")
    actuator_saturation: float = _size("rad")
    actuator_backlash: float = _size("rad")
    rudder_offset: float = _size("rad")
    rudder_stall: float = _size("rad")
    rudder_effectiveness_change: Timed = field(default=Timed(), metadata={"unit": "share"})
    depth_sensor_lever_arm: float = _size("m")
    depth_sensor_lag: float = _size("s")
    pitch_bias: float = _size("rad")
    pitch_sensor_lag: float = _size("s")
    vertical_current: float = _size("m/s")
    internal_wave: InternalWave = field(default=InternalWave(), metadata={"unit": "m/s"})
    surface_waves: SurfaceWaves = field(default=SurfaceWaves(), metadata={"unit": "m"})

    def __post_init__(self) -> None:
        for name in (
            "heave_quadratic_drag",
            "pitch_quadratic_damping",
            "actuator_lag",
            "actuator_delay",
            "actuator_rate_limit",
            "actuator_saturation",
            "actuator_backlash",
            "rudder_stall",
            "depth_sensor_lag",
            "pitch_sensor_lag",
        ):
            require(getattr(self, name) >= 0.0, name, "be >= 0", getattr(self, name))
        require(self.actuator_delay <= 10.0, "actuator_delay", "be <= 10 s", self.actuator_delay)

    def at_work(self, t_s: float) -> dict[str, tuple[float, str]]:
        """Size and unit of every effect that acts at the time `t_s`, by name."""
        active = {}
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, Timed) and t_s < value.at_s:
                continue
            size = value if isinstance(value, float) else value.size
            if size != 0.0:
                active[item.name] = (size, item.metadata["unit"])
        return active


REALISTIC: dict[str, float] = {
    "heave_pitch_rate_coupling": 1.0,
    "large_angle_restoring": 1.0,
    "large_angle_kinematics": 1.0,
    "actuator_lag": 0.1,
}
"""What every real vehicle has; the flavour "realistic" starts from these, the flavour "linear" from none."""
