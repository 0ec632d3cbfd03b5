"""What stands between the vehicle's motion and the recorded pitch and depth."""

import casadi as ca

from host.dynamics.equations import Chain, Effect, Parameter


def _felt_depth(c: Chain) -> ca.SX:
    """The depth where the sensor sits."""
    return c.zeta - c.p.get("sensor_forward", ca.SX(0)) * ca.sin(c.theta)


def _lever_arm(c: Chain) -> None:
    c.sensed_depth = c.sensed_depth - c.zeta + _felt_depth(c)


def _lagged_depth(c: Chain) -> None:
    c.sensed_depth = c.sensed_depth - _felt_depth(c) + c.extra["depth_lag"]


def _true_pitch(c: Chain) -> ca.SX:
    return c.theta


def _bias(c: Chain) -> None:
    c.sensed_pitch = c.sensed_pitch + c.p["pitch_zero"]


def _lagged_pitch(c: Chain) -> None:
    c.sensed_pitch = c.sensed_pitch - c.theta + c.extra["pitch_lag"]


EFFECTS = (
    Effect(
        name="depth_sensor_lever_arm",
        slot="sensor",
        parameters=(
            Parameter(name="sensor_forward", unit="m", lower=-20, upper=20, meaning="ahead of the centre"),
        ),
        sentence="The depth sensor sits ahead of or behind the centre of motion: pitching moves its reading.",
        equation="recorded depth = zeta - sensor_forward sin(theta)",
        manoeuvre="quick pitch reversals, which swing the sensor before the vehicle changes depth",
        probes=((0.3,), (-0.3,)),
        sense=_lever_arm,
    ),
    Effect(
        name="depth_sensor_lag",
        slot="sensor",
        parameters=(
            Parameter(name="depth_lag_time", unit="s", lower=0.03, upper=20, meaning="time constant"),
        ),
        sentence="The depth reading follows the depth with a lag (a filter, or a clogged port).",
        equation="recorded depth' = (zeta - recorded depth)/depth_lag_time, zeta that at the sensor",
        manoeuvre="quick reversals of a steep climb and dive",
        probes=((0.3,), (1.5,)),
        follows=(_felt_depth, "depth_lag_time"),
        sense=_lagged_depth,
        state="depth_lag",
        initial=_felt_depth,
    ),
    Effect(
        name="pitch_bias",
        slot="sensor",
        parameters=(Parameter(name="pitch_zero", unit="rad", lower=-0.5, upper=0.5, meaning="zero error"),),
        sentence="The pitch sensor is mounted or calibrated with a constant error.",
        equation="recorded pitch = theta + pitch_zero",
        manoeuvre="a level run with the depth constant: the true pitch is then w/u",
        probes=((0.01,),),
        sense=_bias,
    ),
    Effect(
        name="pitch_sensor_lag",
        slot="sensor",
        parameters=(
            Parameter(name="pitch_lag_time", unit="s", lower=0.03, upper=10, meaning="time constant"),
        ),
        sentence="The pitch reading follows the pitch with a lag (a slow attitude filter).",
        equation="recorded pitch' = (theta - recorded pitch)/pitch_lag_time",
        manoeuvre="quick pitch reversals with the depth recorded at a high rate",
        probes=((0.2,), (0.8,)),
        follows=(_true_pitch, "pitch_lag_time"),
        sense=_lagged_pitch,
        state="pitch_lag",
        initial=_true_pitch,
    ),
)
