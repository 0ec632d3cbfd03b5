"""A vehicle on which everything acts at once, as on a real one."""

import json
from pathlib import Path

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.diagnosis.diagnose import diagnose
from host.diagnosis.told.files import write_extended_model
from host.recordings.recording import Array
from tools.bench import load_vehicle

LAG = 0.8  # s

TRUE = {"c_wq": 0.6, "c_ww": -1.5, "c_w0": 0.03, "c_qw": 1.5, "c_qq": -6.0, "c_q0": 0.15}


def _everything(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    w, q, *_ = x
    force = TRUE["c_wq"] * q + TRUE["c_ww"] * w * abs(w) + TRUE["c_w0"]
    moment = TRUE["c_qw"] * w + TRUE["c_qq"] * q * abs(q) + TRUE["c_q0"]
    return force, moment, 0.0


@pytest.mark.long
def test_six_effects_at_once_are_named_with_their_sizes() -> None:
    said: list[str] = []
    found = diagnose([hidden_dive(_everything, seed=4)], said.append)
    assert "what every vehicle has" in said
    assert found.verdict == "explained"
    values = {name: value for effect in found.effects for name, value in effect.coefficients.items()}
    for name, truth in TRUE.items():
        value, std, _ = values[name]
        assert abs(value - truth) < 4.0 * std + 0.02 * abs(truth), name


@pytest.mark.long
def test_a_recording_that_begins_as_the_plane_is_put_over_names_no_more_than_the_servo(
    tmp_path: Path,
) -> None:
    rows = hidden_dive()
    begins, delta = np.empty(rows.time.size), 0.0  # where the servo is as each command comes
    for k, command in enumerate(rows.rudder):
        begins[k] = delta
        delta = command + (delta - command) * np.exp(-rows.step / LAG)

    def servo(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        k = min(int(time / rows.step), rows.time.size - 1)
        angle = rows.rudder[k] + (begins[k] - rows.rudder[k]) * np.exp(-(time - rows.time[k]) / LAG)
        return BASE["b1"] * (angle - plane), BASE["b2"] * (angle - plane), 0.0

    assert abs(rows.rudder[0]) > 0.1
    found = diagnose([hidden_dive(servo)])
    assert [effect.name for effect in found.effects] == ["actuator_lag"]
    assert found.effects[0].coefficients["lag_time"][0] == pytest.approx(LAG, rel=0.05)
    assert "plane_before" in found.extended.names
    write_extended_model(found, load_vehicle(None), tmp_path / "model.json")
    written = json.loads((tmp_path / "model.json").read_text())
    assert [effect["name"] for effect in written["effects"]] == ["actuator_lag"]
