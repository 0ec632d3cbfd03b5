"""A model that the user holds, set against a recording as it is."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hidden_dive import BASE

from host.diagnosis.against.given_model import against_model
from host.diagnosis.diagnose import Diagnosis
from host.diagnosis.told.files import write_extended_model
from host.dynamics.equations import NAMES
from host.identification.model import VehicleModel, read_model
from host.vehicle import default_vehicle
from tools.cli import main


def given(found: Diagnosis, effects: dict[str, dict[str, float]], **changed: float) -> VehicleModel:
    """The paper's coefficients as a model file states them, with these effects."""
    values = dict.fromkeys(NAMES, 0.0) | BASE | changed
    return VehicleModel(
        vehicle="boat",
        step=found.recordings[0].step,
        values=values,
        std=dict.fromkeys(NAMES, 0.0),
        noise={},
        valid_range={},
        provenance={},
        effects=[
            {"name": name, "parameters": {k: {"value": v, "std": 0.0, "unit": ""} for k, v in own.items()}}
            for name, own in effects.items()
        ],
    )


def test_the_true_model_lacks_nothing(coupled: Diagnosis) -> None:
    answer = against_model(coupled, given(coupled, {"heave_pitch_rate_coupling": {"c_wq": 0.8}}), "m.json")
    assert answer.found.verdict == "no_mismatch"
    assert answer.found.effects == []
    assert answer.found.base_misfit.chi2 < 1.5


def test_an_effect_the_model_lacks_is_missing_and_its_force_is_shown(coupled: Diagnosis) -> None:
    answer = against_model(coupled, given(coupled, {}), "m.json")
    (effect,) = answer.found.effects
    assert effect.name == "heave_pitch_rate_coupling"
    assert answer.found.slots["heave"] == pytest.approx(1.0)
    assert answer.found.base_misfit.chi2_depth > 3.0
    # What acted beside the model is 0.8 q, most of it: the estimate follows the pitch's own rate.
    pitch_rate = np.gradient(coupled.recordings[0].pitch, 0.1)
    smooth = np.convolve(pitch_rate, np.ones(9) / 9, mode="same")
    assert np.corrcoef(answer.found.force.values[0], smooth)[0, 1] > 0.7


def test_where_seconds_are_foretold_so_are_those_of_the_model(coupled: Diagnosis) -> None:
    found = replace(coupled, horizon=2.0)
    true, lacking = (
        against_model(found, given(found, effects), "m.json").found.base_misfit
        for effects in ({"heave_pitch_rate_coupling": {"c_wq": 0.8}}, {})
    )
    whole = against_model(coupled, given(coupled, {}), "m.json").found.base_misfit
    assert true.chi2 < 1.5
    assert true.chi2 < lacking.chi2 < 0.8 * whole.chi2


def test_where_forces_act_a_filter_carries_the_model_too(
    coupled: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    def anew(*_: object) -> None:
        raise AssertionError("what was found is carried into each stretch, the model begins anew")

    monkeypatch.setattr("host.diagnosis.proof.scoring.free_run_errors", anew)
    found = replace(coupled, has_sea=True)
    true, lacking = (
        against_model(found, given(found, effects), "m.json").found.base_misfit
        for effects in ({"heave_pitch_rate_coupling": {"c_wq": 0.8}}, {})
    )
    assert true.chi2 < 1.5
    assert lacking.chi2_depth > 2.0 * true.chi2_depth


def test_a_coefficient_that_differs_is_told_with_both_values(coupled: Diagnosis) -> None:
    answer = against_model(coupled, given(coupled, {"heave_pitch_rate_coupling": {"c_wq": 0.2}}), "m.json")
    assert answer.against is not None
    (sentence,) = answer.against.sentences
    assert "is in the model, but with c_wq = 0.2 m/s instead of" in sentence
    assert answer.found.verdict == "explained"


def test_an_effect_that_is_too_much_in_the_model(coupled: Diagnosis) -> None:
    effects = {"heave_pitch_rate_coupling": {"c_wq": 0.8}, "heave_quadratic_drag": {"c_ww": -3.0}}
    answer = against_model(coupled, given(coupled, effects), "m.json")
    assert answer.against is not None
    (superfluous,) = answer.against.comparison.named("superfluous")
    assert superfluous.name == "heave_quadratic_drag"
    assert superfluous.given["c_ww"] == (-3.0, 0.0)
    assert answer.found.verdict == "explained"


def test_a_base_coefficient_that_is_off(coupled: Diagnosis) -> None:
    model = given(coupled, {"heave_pitch_rate_coupling": {"c_wq": 0.8}}, a2=-3.0)
    answer = against_model(coupled, model, "m.json")
    assert answer.against is not None
    assert [p.name for p in answer.against.comparison.parameters if p.is_different] == ["a2"]
    assert answer.found.slots["pitch"] == pytest.approx(1.0)


def test_what_else_a_vehicle_may_have_makes_its_coefficients_less_certain(coupled: Diagnosis) -> None:
    doubtful = replace(coupled, std=coupled.std | {"c_wq": 0.5, "a2": 0.5})
    model = given(coupled, {"heave_pitch_rate_coupling": {"c_wq": 0.2}}, a2=-3.0)
    answer = against_model(doubtful, model, "m.json")
    assert answer.against is not None
    (effect,) = answer.against.comparison.effects
    assert effect.status == "same"
    assert effect.recorded["c_wq"][1] == 0.5
    assert not any(p.is_different for p in answer.against.comparison.parameters)


def test_a_trim_offset_of_the_model_is_buoyancy_too_much(coupled: Diagnosis) -> None:
    model = given(coupled, {"heave_pitch_rate_coupling": {"c_wq": 0.8}}, heave_offset=0.05)
    answer = against_model(coupled, model, "m.json")
    assert answer.against is not None
    assert [e.name for e in answer.against.comparison.named("superfluous")] == ["net_buoyancy"]


def test_the_extended_model_of_a_diagnosis_lacks_nothing(coupled: Diagnosis, tmp_path: Path) -> None:
    write_extended_model(coupled, default_vehicle(), tmp_path / "m.json")
    model = read_model(tmp_path / "m.json")
    # Its uncertainty is left out, or a difference would hide behind it.
    exact = replace(model, std=dict.fromkeys(NAMES, 0.0))
    assert against_model(coupled, exact, "m.json").found.verdict == "no_mismatch"


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ("depth", "is not a model file"),
        (json.dumps({"schema": 9}), "schema must be 1"),
        (None, "No such file"),
    ],
)
def test_a_bad_model_file_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str | None, complaint: str
) -> None:
    if content is not None:
        (tmp_path / "m.json").write_text(content)
    (tmp_path / "dive.csv").write_text("time_s,depth_m,pitch_rad,rudder_rad\n")
    command = ["diagnose", str(tmp_path / "dive.csv"), "--model", str(tmp_path / "m.json"), "--quiet"]
    assert main(command) == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert error.count("\n") == 1
