import json
from pathlib import Path

import pytest

from host.dynamics.equations import NAMES
from host.errors import RecordingError
from host.identification.model import VehicleModel, read_model, write_model


def model() -> VehicleModel:
    return VehicleModel(
        vehicle="boat",
        step=0.1,
        values={name: -0.5 - index for index, name in enumerate(NAMES)},
        std=dict.fromkeys(NAMES, 0.01),
        noise={"pitch_rad": 0.002, "depth_m": 0.01},
        valid_range={"pitch_rad": (-0.2, 0.3)},
        provenance={"version": "1", "recordings": [{"name": "a.csv", "sha256": "00"}]},
    )


def test_model_round_trip(tmp_path: Path) -> None:
    write_model(model(), tmp_path / "model.json")
    assert read_model(tmp_path / "model.json") == model()


def test_model_file_holds_what_the_format_promises(tmp_path: Path) -> None:
    write_model(model(), tmp_path / "model.json")
    document = json.loads((tmp_path / "model.json").read_text())
    assert document["schema"] == 1
    assert document["step_s"] == 0.1
    assert document["parameters"]["a1"] == {"value": -0.5, "std": 0.01, "unit": "1/s"}
    assert document["effects"] == []
    assert document["provenance"]["recordings"][0]["sha256"] == "00"


def test_offsets_may_be_left_out(tmp_path: Path) -> None:
    write_model(model(), tmp_path / "model.json")
    document = json.loads((tmp_path / "model.json").read_text())
    del document["parameters"]["heave_offset"], document["parameters"]["pitch_offset"]
    (tmp_path / "model.json").write_text(json.dumps(document))
    assert read_model(tmp_path / "model.json").values["heave_offset"] == 0.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.update(schema=7), "schema must be 1 (got 7)"),
        (lambda d: d["parameters"].pop("a3"), "parameters.a3.value must be a number"),
        (lambda d: d["parameters"]["b1"].update(value="x"), "parameters.b1.value must be a number"),
        (lambda d: d["parameters"]["b1"].update(value=None), "parameters.b1.value must be a number"),
        (lambda d: d.pop("step_s"), "is not a complete model file"),
        (lambda d: d.update(effects=[{"name": "warp"}]), "an effect this version does not know (warp)"),
        (lambda d: d.update(effects=[{"name": "munk_moment"}]), "effects.munk_moment.c_qw.value must be"),
    ],
)
def test_incomplete_model_says_what_is_wrong(tmp_path: Path, change, message: str) -> None:  # type: ignore[no-untyped-def]
    write_model(model(), tmp_path / "model.json")
    document = json.loads((tmp_path / "model.json").read_text())
    change(document)
    (tmp_path / "model.json").write_text(json.dumps(document))
    with pytest.raises(RecordingError) as caught:
        read_model(tmp_path / "model.json")
    assert message in str(caught.value)


def test_what_is_no_json_is_no_model(tmp_path: Path) -> None:
    (tmp_path / "model.json").write_bytes(b"\xff\x00")
    with pytest.raises(RecordingError, match="is not a model file"):
        read_model(tmp_path / "model.json")
