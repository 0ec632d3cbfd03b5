"""The paper's regression on CAR rows, over recordings: by batch least squares, and by the live estimator.

Both see measured signals on both sides of the equation, so sensor noise biases them (errors in variables);
they are here to compare with the paper and with what runs on the vehicle.
"""

from dataclasses import replace
from typing import Literal

import numpy as np

from firmware_model.car import DEPTH_LAGS, PITCH_LAGS, CarRow
from firmware_model.conversion import physical_from_car, physical_std_from_car
from firmware_model.estimator import make_estimator
from firmware_model.sample import Sample
from host.errors import RecordingError
from host.recordings.recording import Array, Recording
from host.vehicle import Vehicle

ESTIMATED = ("a1", "a2", "a3", "b1", "b2")


def samples_of(recording: Recording) -> list[Sample]:
    """The recording on the grid of its step: each row at its nearest instant, the first where two meet."""
    instants = np.rint((recording.time - recording.time[0]) / recording.step).astype(int)
    _, first = np.unique(instants, return_index=True)
    step_us = round(recording.step * 1e6)
    return [
        Sample(
            t_us=int(instants[i]) * step_us,
            depth=float(recording.depth[i]),
            pitch=float(recording.pitch[i]),
            rudder=float(recording.rudder[i]),
            speed=float(recording.speed[i]),
            pitch_rate=float(recording.pitch_rate[i]),
        )
        for i in first
    ]


def car_least_squares(
    recordings: list[Recording], vehicle: Vehicle
) -> tuple[dict[str, float], dict[str, float]]:
    """Values and standard deviations by name from ordinary least squares on every complete row."""
    pitch = _regress(recordings, PITCH_LAGS, "pitch")
    depth = _regress(recordings, DEPTH_LAGS, "depth")
    speeds = np.concatenate([recording.speed for recording in recordings])
    u0 = float(np.nanmean(speeds)) if recordings[0].has_speed else vehicle.speed
    h = recordings[0].step
    beta_covariance = depth[1].tolist()
    values = physical_from_car(pitch[0].tolist(), depth[0].tolist(), u0, h, beta_covariance)
    std = physical_std_from_car(
        pitch[0].tolist(), depth[0].tolist(), u0, h, pitch[1].tolist(), beta_covariance
    )
    return (
        _with_nuisance({name: getattr(values, name) for name in ESTIMATED}, u0),
        _with_nuisance({name: getattr(std, name) for name in ESTIMATED}, 0.0),
    )


def _regress(
    recordings: list[Recording], lags: tuple[tuple[int, ...], tuple[int, ...]], output: str
) -> tuple[Array, Array]:
    if len({round(recording.step, 6) for recording in recordings}) > 1:
        raise RecordingError(
            f"{recordings[-1].name}: step {recordings[-1].step:g} s differs from {recordings[0].step:g} s; "
            "CAR coefficients belong to one step, use --method ml or --each"
        )
    rows, targets = [], []
    for recording in recordings:
        row = CarRow(*lags)
        # Depth integrates, so its rows may count from any datum; the first depth keeps them well conditioned.
        measured = getattr(recording, output)
        datum = float(measured[np.isfinite(measured)][0]) if output == "depth" else 0.0
        last = None
        for sample in samples_of(recording):
            missed = 0 if last is None else round((sample.t_us - last) * 1e-6 / recording.step) - 1
            for _ in range(min(missed, row.span)):
                row.push(np.nan, np.nan)
            last = sample.t_us
            y = getattr(sample, output) - datum
            if row.is_complete and np.isfinite(y):
                rows.append(list(row.phi))
                targets.append(y)
            row.push(y, sample.rudder)
    count = len(lags[0]) + len(lags[1])
    if len(rows) <= count:
        raise RecordingError(
            f"{recordings[0].name}: only {len(rows)} complete rows for {output}, {count + 1} are needed; "
            "too many samples are missing for CAR regression, use --method ml"
        )
    table, y = np.array(rows), np.array(targets)
    solution = np.linalg.lstsq(table, y, rcond=None)[0]
    variance = float(np.sum((y - table @ solution) ** 2)) / (y.size - count)
    return solution, variance * np.linalg.pinv(table.T @ table)


def run_estimator(
    recordings: list[Recording], vehicle: Vehicle, method: Literal["robust", "mils"] = "mils"
) -> tuple[dict[str, float], dict[str, float], dict[str, Array]]:
    """Values, standard deviations and the history by name of an estimator that runs on the vehicle."""
    config = replace(vehicle.estimator, method=method, step=recordings[0].step, speed=vehicle.speed)
    estimator = make_estimator(config)
    seen = 0
    history: dict[str, list[float]] = {name: [] for name in ESTIMATED}
    for recording in recordings:
        estimator.forget_rows()
        for sample in samples_of(recording):
            estimator.update(sample)
            seen += 1
            if seen % 10 == 0:
                estimate = estimator.estimate()
                for name in ESTIMATED:
                    history[name].append(estimate.values[name])
    estimate = estimator.estimate()
    values = {name: estimate.values[name] for name in ESTIMATED}
    std = {name: float(estimate.std[name]) for name in ESTIMATED}
    values |= {
        "u0": estimate.u0,
        "heave_offset": estimate.heave_offset,
        "pitch_offset": estimate.pitch_offset,
    }
    std |= {"u0": 0.0, "heave_offset": 0.0, "pitch_offset": 0.0}
    if method == "robust":
        std |= {name: float(estimate.std[name]) for name in ("heave_offset", "pitch_offset")}
        std["u0"] = 0.0 if recordings[0].has_speed else float(estimate.std["u0"])
        if np.isfinite(estimate.c_wq):
            values["c_wq"], std["c_wq"] = estimate.c_wq, float(estimate.std["c_wq"])
    return values, std, {name: np.array(series) for name, series in history.items()}


def _with_nuisance(values: dict[str, float], u0: float) -> dict[str, float]:
    return {**values, "u0": u0, "heave_offset": 0.0, "pitch_offset": 0.0}
