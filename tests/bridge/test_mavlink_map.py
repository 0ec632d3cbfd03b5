"""The [mavlink] table refuses what cannot be meant."""

from typing import Any

import pytest

from bridge.mavlink_map import MavlinkMap, ServoTerm


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("system_id", 0),
        ("component_id", 256),
        ("own_system_id", 255),
        ("own_component_id", 1),
        ("water_density", 1.025),
        ("gravity", 32.0),
        ("surface_pressure_hpa", 101325.0),
        ("repeat_hold_s", -1.0),
        ("pitch_sign", 0),
        ("csrv_sign", 2),
        ("attitude_rate_hz", 400.0),
        ("depth_rate_hz", float("nan")),
        ("rudder", (ServoTerm(channel=1, rad_per_us=1.0), ServoTerm(channel=1, rad_per_us=2.0))),
    ],
)
def test_bad_setting_is_named_with_its_rule(setting: str, value: Any) -> None:
    with pytest.raises(ValueError, match=rf"^{setting} must .*\(got "):
        MavlinkMap(**{setting: value})


@pytest.mark.parametrize(
    ("setting", "value"),
    [("channel", 0), ("channel", 33), ("rad_per_us", 0.0), ("rad_per_us", float("inf")), ("trim_us", 0.0)],
)
def test_bad_servo_term_is_named_with_its_rule(setting: str, value: Any) -> None:
    with pytest.raises(ValueError, match=rf"^{setting} must .*\(got "):
        ServoTerm(**{"channel": 1, "rad_per_us": 1e-3, setting: value})
