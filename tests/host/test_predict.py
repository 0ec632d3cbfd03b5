import json
from dataclasses import replace

import numpy as np
import pytest
from exact_dive import TABLE_1, Dive, fly

from host.dynamics.equations import NAMES
from host.errors import RecordingError
from host.identification.model import VehicleModel
from host.identification.predict import predict, score
from host.identification.simulate import simulate


def true_model() -> VehicleModel:
    values = {**dict.fromkeys(NAMES, 0.0), **TABLE_1}
    return VehicleModel(
        vehicle="boat",
        step=0.1,
        values=values,
        std=dict.fromkeys(NAMES, 0.0),
        noise={},
        valid_range={},
        provenance={},
    )


def test_the_true_model_predicts_down_to_the_noise() -> None:
    recording, _ = fly(Dive(start=(0.1, 0.05, 0.1, 12.0)))
    result = predict(true_model(), recording).score
    assert result.pitch_rmse_rad == pytest.approx(np.deg2rad(0.1), rel=0.1)
    assert result.depth_rmse_m < 0.02
    assert result.depth_fit_percent > 99.0
    assert result.samples == 1200


def test_a_free_run_does_not_look_beyond_the_first_five_seconds() -> None:
    recording, _ = fly(Dive())
    later = recording.time >= 5.0
    changed = replace(
        recording,
        pitch=np.where(later, 0.3, recording.pitch),
        depth=np.where(later, 0.0, recording.depth),
    )
    assert np.array_equal(predict(true_model(), recording).outputs, predict(true_model(), changed).outputs)


def test_a_wrong_model_scores_worse_in_free_run() -> None:
    recording, _ = fly(Dive())
    model = true_model()
    wrong = replace(model, values={**model.values, "b2": 0.8 * model.values["b2"]})
    assert predict(wrong, recording).score.pitch_rmse_rad > 5 * predict(model, recording).score.pitch_rmse_rad


def test_no_depth_at_the_start_is_an_error_that_says_so() -> None:
    recording, _ = fly(Dive(duration=20.0))
    blind = replace(recording, depth=np.where(recording.time < 6.0, np.nan, recording.depth))
    with pytest.raises(RecordingError, match="no depth in the first 5 s"):
        predict(true_model(), blind)


def test_score_against_a_channel_that_does_not_vary_is_null_in_json() -> None:
    recording, _ = fly(Dive(duration=20.0))
    still = replace(recording, depth=np.full_like(recording.depth, 3.0))
    document = json.loads(json.dumps(score(np.zeros((2, 200)), [still]).as_json(), allow_nan=False))
    assert document["depth_fit_percent"] is None
    assert document["depth_rmse_m"] == pytest.approx(3.0)


def test_simulation_starts_at_rest_where_nothing_was_measured() -> None:
    recording, _ = fly(Dive(duration=20.0))
    nothing = np.full_like(recording.depth, np.nan)
    run = simulate(true_model(), replace(recording, depth=nothing, pitch=nothing))
    assert np.array_equal(run.run.states[:, 0], np.zeros(4))
    assert np.abs(run.run.states[2]).max() > 0.01
