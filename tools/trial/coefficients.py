"""From the plant's units to the coefficients of motion per unit mass, where the form is the same."""

from tools.sitl.actuator import STALL_FLOOR, STALL_SLOPE
from tools.sitl.hull import GRAVITY
from tools.trial.hidden import Hidden, Setting


def true_coefficients(effect: Hidden, setting: Setting, sea_phase: tuple[float, float]) -> dict[str, float]:
    """The catalogue's coefficients of a hidden effect, by name, as the plant's equations fix them.

        w' = heave force / (m - Zwdot),  q' = moment / (Iy - Mqdot),  velocities at the starting speed u

    Empty where the plant's form is another: speed_loss (the plant balances thrust and drag, the catalogue's
    speed recovers exponentially), surface_waves (a spectrum with pressure, not one sine) and all that is
    outside the catalogue. Constant buoyancy acts along cos(pitch) in the plant: the same to second order.

    sea_phase    sine and cosine of the internal wave's phase at the start
    """
    vehicle = setting.vehicle
    hull, u = vehicle.hull, vehicle.speed
    size = effect.size(setting)
    heave, inertia = vehicle.heave_mass, vehicle.pitch_inertia
    match effect.name:
        case "heave_pitch_rate_coupling":
            return {"c_wq": size * (vehicle.surge_mass + hull.Zq) * u / heave}
        case "heave_quadratic_drag":
            return {"c_ww": -size / heave}
        case "net_buoyancy":
            return {"c_w0": -size / heave}
        case "depth_dependent_buoyancy":
            return {"c_wz": size / heave}
        case "ballast_change":
            return {"c_wb": size * GRAVITY / heave, "ballast_time": effect.at_s}
        case "pitch_quadratic_damping":
            return {"c_qq": -size / inertia}
        case "trim_moment":
            return {"c_q0": size / inertia}
        case "munk_moment":
            return {"c_qw": size * (hull.Xudot - hull.Zwdot) * u / inertia}
        case "rudder_stall":
            falls_to = (1.0 - STALL_FLOOR) / -STALL_SLOPE  # times the stall angle beyond it
            kept = {"stall_share": STALL_FLOOR} if setting.command > (1.0 + falls_to) * size else {}
            return {"stall_angle": size, "stall_loss": 1.0 - STALL_SLOPE} | kept
        case "rudder_effectiveness_change":
            return {"effectiveness_step": -size, "effectiveness_time": effect.at_s}
        case "internal_wave":
            sine, cosine = sea_phase
            return {
                "internal_sine": size * cosine,
                "internal_cosine": size * sine,
                "internal_period": effect.period_s,
            }
    same = _SAME_UNIT.get(effect.name)
    return {} if same is None else {same: size}


def lifted(base: dict[str, float], net_buoyancy: float, mass_kg: float) -> dict[str, float]:
    """The base coefficients beside a net buoyancy, N: it restores as well, as the plant's moment is zb B."""
    return base | {"a3": base["a3"] * (1.0 + net_buoyancy / (mass_kg * GRAVITY))}


def free_of_mass(effect: str, coefficients: dict[str, float]) -> dict[str, float]:
    """Those that hold for any hull: where heaving and turning share their masses, forces per mass do not.

    Nor does how far ahead a depth gauge sits, as any point of such a hull may be the one that is modelled.
    """
    if effect == "depth_sensor_lever_arm":
        return {}
    return {name: value for name, value in coefficients.items() if not name.startswith("c_")}


_SAME_UNIT = {
    "large_angle_restoring": "restoring_share",
    "large_angle_kinematics": "kinematics_share",
    "actuator_lag": "lag_time",
    "actuator_delay": "delay",
    "actuator_rate_limit": "plane_rate",
    "actuator_saturation": "plane_limit",
    "actuator_backlash": "backlash",
    "rudder_offset": "rudder_zero",
    "depth_sensor_lever_arm": "sensor_forward",
    "depth_sensor_lag": "depth_lag_time",
    "pitch_bias": "pitch_zero",
    "pitch_sensor_lag": "pitch_lag_time",
    "vertical_current": "current",
}
