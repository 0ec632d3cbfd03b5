"""A model flown on given plane movement, without looking at anything else but where it starts."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from host.dynamics.propagate import Run, begun_at, free_run, inputs_of
from host.identification.model import VehicleModel
from host.identification.predict import SETTLING_SPAN, estimate_initial_state
from host.noise.speed import smoothed_speed
from host.recordings.outliers import without_outliers
from host.recordings.plane_between_rows import with_moving_plane
from host.recordings.recording import Array, Recording

COLUMNS = ("time_s", "depth_m", "pitch_rad", "rudder_rad", "speed_mps", "pitch_rate_radps", "heave_mps")


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulation:
    """A free run at the rows of `time`, with the rudder and speed that drove it."""

    time: Array
    run: Run
    rudder: Array
    speed: Array


def simulate(model: VehicleModel, recording: Recording) -> Simulation:
    """Free run on the recording's rudder.

    It starts where the first 5 s of depth and pitch say; at rest at depth 0 where these are not recorded.
    """
    driven = with_moving_plane(recording) if model.has_moving_plane else recording
    (cleaned,) = without_outliers([driven])
    inputs = inputs_of(cleaned, model.structure)
    opening = cleaned.between(recording.time[0], recording.time[0] + SETTLING_SPAN)
    if np.isfinite(opening.depth).any() and np.isfinite(opening.pitch).any():
        initial = estimate_initial_state(model.parameters, opening, inputs)
    else:
        initial = begun_at(0.0, 0.0)
    rows = recording.time.size
    speed = smoothed_speed(cleaned.speed).speed if cleaned.has_speed else np.full(rows, model.values["u0"])
    return Simulation(
        time=recording.time,
        run=free_run(model.parameters, initial, inputs),
        rudder=recording.rudder,
        speed=speed,
    )


def write_simulation(runs: list[Simulation], path: Path) -> None:
    """Writes SIM.csv in the project's own recording format, with pitch rate and heave added."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for run in runs:
            (w, q, *_), (pitch, depth) = run.run.states, run.run.outputs
            table = np.column_stack([run.time, depth, pitch, run.rudder, run.speed, q, w])
            writer.writerows([f"{value:.9g}" for value in row] for row in table)
