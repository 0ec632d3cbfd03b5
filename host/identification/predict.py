"""Free-run prediction of a recording: the only honest score of a model."""

from dataclasses import asdict, dataclass

import numpy as np

from host.dynamics.propagate import Inputs, begun_at, free_run, inputs_of
from host.dynamics.sensitivities import innovations
from host.errors import RecordingError
from host.identification.model import VehicleModel
from host.recordings.outliers import without_outliers
from host.recordings.plane_between_rows import with_moving_plane
from host.recordings.recording import Array, Recording

SETTLING_SPAN = 5.0  # s from the start, from which alone the initial state is estimated


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """How well a free run meets a recording.

    fit % = 100 (1 - ||y - yhat|| / ||y - mean(y)||); NaN where a channel does not vary or was not measured.
    """

    depth_rmse_m: float
    pitch_rmse_rad: float
    depth_fit_percent: float
    pitch_fit_percent: float
    samples: int

    def as_json(self) -> dict[str, float | int | None]:
        """The keys of `mils predict --json`; JSON has no NaN, so an undefined figure is null."""
        return {
            name: None if isinstance(value, float) and not np.isfinite(value) else value
            for name, value in asdict(self).items()
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """Outputs pitch, depth (2, N) of the free run beside the recording, and the score."""

    recording: Recording
    outputs: Array
    score: Score


def predict(model: VehicleModel, recording: Recording) -> Prediction:
    """Runs the model freely on the recording's rudder; only the first 5 s fix the initial state.

    A spike among these is not learnt from; the score is against the values as they were measured.
    """
    driven = with_moving_plane(recording) if model.has_moving_plane else recording
    (cleaned,) = without_outliers([driven])
    inputs = inputs_of(cleaned, model.structure)
    opening = cleaned.between(recording.time[0], recording.time[0] + SETTLING_SPAN)
    if opening.time.size < 4:
        opening = cleaned.between(recording.time[0], recording.time[min(4, recording.time.size - 1)])
    initial = estimate_initial_state(model.parameters, opening, inputs)
    run = free_run(model.parameters, initial, inputs)
    return Prediction(recording=recording, outputs=run.outputs, score=score(run.outputs, [recording]))


def estimate_initial_state(parameters: Array, opening: Recording, whole: Inputs) -> Array:
    """Weighted least squares for [w, q, theta, zeta, u / u0 - 1] at the first row of `opening`.

    The equations are linear in the state, so Gauss-Newton steps from the first measurements end at once.
    Weights: 0.1 deg and 1 cm; 0.5 m/s, 0.5 rad/s and a tenth of the speed, of prior, hold what a few samples
    leave open.
    """
    rows = opening.time.size
    inputs = Inputs(
        structure=whole.structure,
        drive=whole.drive[:, :rows],
        measured=whole.measured[:, :rows],
        present=whole.present[:, :rows],
        substeps=whole.substeps,
    )
    seen = inputs.present.sum(axis=1) > 0.0
    if not seen.all():
        lacking = "pitch" if not seen[0] else "depth"
        raise RecordingError(
            f"{opening.name}: no {lacking} in the first {SETTLING_SPAN:g} s, from which the free run starts"
        )
    first = [float(inputs.measured[i, inputs.present[i] > 0.0][0]) for i in range(2)]
    centre = begun_at(*first)
    prior = np.diag(np.array([0.5, 0.5, 0.2, 2.0, 0.1]) ** -2.0)
    weight = np.array([np.deg2rad(0.1), 0.01]) ** -2.0
    x = centre.copy()
    for _ in range(3):
        error, sensitivity = innovations(parameters, x, inputs)
        S = sensitivity[:, parameters.size :]
        H = np.einsum("oik,o,ojk->ij", S, weight, S) + prior
        g = np.einsum("oik,o,ok->i", S, weight, error) + prior @ (centre - x)
        x = x + np.linalg.solve(H, g)
    return x


def score(outputs: Array, recordings: list[Recording]) -> Score:
    """Scores simulated pitch and depth (2, N) against what was measured in the recordings, end to end."""
    pitch = np.concatenate([recording.pitch for recording in recordings])
    depth = np.concatenate([recording.depth for recording in recordings])
    pitch_rmse, pitch_fit, pitch_samples = _channel(pitch, outputs[0])
    depth_rmse, depth_fit, depth_samples = _channel(depth, outputs[1])
    return Score(
        depth_rmse_m=depth_rmse,
        pitch_rmse_rad=pitch_rmse,
        depth_fit_percent=depth_fit,
        pitch_fit_percent=pitch_fit,
        samples=max(pitch_samples, depth_samples),
    )


def _channel(measured: Array, simulated: Array) -> tuple[float, float, int]:
    present = np.isfinite(measured)
    y = measured[present]
    if y.size == 0:
        return np.nan, np.nan, 0
    with np.errstate(over="ignore", invalid="ignore"):
        error = float(np.sqrt(np.mean((y - simulated[present]) ** 2)))
    spread = float(np.std(y))
    fit = 100.0 * (1.0 - error / spread) if spread > 0.0 else np.nan
    return error, fit, int(y.size)
