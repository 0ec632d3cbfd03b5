"""A vehicle on which everything acts at once, as on a real one."""

from hidden_dive import hidden_dive

from host.diagnosis.diagnose import diagnose
from host.recording import Array

TRUE = {"c_wq": 0.6, "c_ww": -1.5, "c_w0": 0.03, "c_qw": 1.5, "c_qq": -6.0, "c_q0": 0.15}


def _everything(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    w, q, *_ = x
    force = TRUE["c_wq"] * q + TRUE["c_ww"] * w * abs(w) + TRUE["c_w0"]
    moment = TRUE["c_qw"] * w + TRUE["c_qq"] * q * abs(q) + TRUE["c_q0"]
    return force, moment, 0.0


def test_six_effects_at_once_are_named_with_their_sizes() -> None:
    said: list[str] = []
    found = diagnose([hidden_dive(_everything, seed=4)], said.append)
    assert "what every vehicle has" in said
    assert found.verdict == "explained"
    values = {name: value for effect in found.effects for name, value in effect.coefficients.items()}
    for name, truth in TRUE.items():
        value, std, _ = values[name]
        assert abs(value - truth) < 4.0 * std + 0.02 * abs(truth), name
