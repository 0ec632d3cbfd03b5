"""The methods that are compared: each takes a dive to values and standard deviations of a1 ... b2, u0."""

import os
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from firmware_model.config import EstimatorConfig, MilsConfig, RobustConfig
from firmware_model.estimator import make_estimator
from firmware_model.sample import Sample
from host.errors import RecordingError
from host.identification.identify_car import car_least_squares
from host.identification.uncertainty import covariance
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.recordings.recording import Recording
from host.vehicle import vehicle_from_table
from tools.accuracy.dive import NAMES, Array, Case, Dive

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

Answer = tuple[Array, Array]
Method = Callable[[Dive], Answer]
PRIOR_SPEED = 2.0
"""m/s, what a vehicle file might say where the truth is 2.5."""
NOTHING = np.full(6, np.nan)


def recording_of(dive: Dive) -> Recording:
    """The dive as a recording on the bench."""
    speed = dive.case.vehicle[5] if dive.case.tells_speed else np.nan
    kept = _rows_of(dive)
    return Recording(
        name="dive",
        sha256="0" * 64,
        time=dive.time[kept],
        depth=dive.depth[kept],
        pitch=dive.pitch[kept],
        rudder=dive.rudder[kept],
        speed=np.full(kept.size, speed),
        pitch_rate=np.full(kept.size, np.nan),
        step=dive.case.step,
    )


def samples_of(dive: Dive) -> list[Sample]:
    """The dive as samples on the vehicle."""
    step_us = round(dive.case.step * 1e6)
    speed = dive.case.vehicle[5] if dive.case.tells_speed else float("nan")
    return [
        Sample(
            t_us=k * step_us,
            depth=float(dive.depth[k]),
            pitch=float(dive.pitch[k]),
            rudder=float(dive.rudder[k]),
            speed=speed,
        )
        for k in _rows_of(dive).tolist()
    ]


def _rows_of(dive: Dive) -> NDArray[np.int_]:
    """The rows that there are."""
    if dive.case.loses_rows:
        return np.flatnonzero(np.isfinite(dive.pitch))
    return np.arange(dive.time.size)


def live(config: EstimatorConfig, dive: Dive) -> Answer:
    """An estimator of the vehicle after the last sample."""
    estimator = make_estimator(config)
    for sample in samples_of(dive):
        estimator.update(sample)
    estimate = estimator.estimate()
    return (
        np.array([estimate.values[name] for name in NAMES]),
        np.array([estimate.std[name] for name in NAMES]),
    )


def robust(dive: Dive, **settings: object) -> Answer:
    """The noise-proof live estimator, told a wrong speed."""
    own = RobustConfig(**settings)  # type: ignore[arg-type]
    return live(EstimatorConfig(step=dive.case.step, speed=PRIOR_SPEED, robust=own), dive)


def mils(dive: Dive, innovation_length: int) -> Answer:
    """Multi-innovation least squares on CAR rows; it cannot estimate the speed and is told the true one."""
    own = MilsConfig(innovation_length=innovation_length)
    config = EstimatorConfig(method="mils", step=dive.case.step, speed=dive.case.vehicle[5], mils=own)
    values, std = live(config, dive)
    values[5] = std[5] = np.nan
    return values, std


def least_squares(dive: Dive) -> Answer:
    """Least squares on all CAR rows, told the true speed."""
    vehicle = vehicle_from_table({"name": "dive", "speed": dive.case.vehicle[5]}, file="dive")
    try:
        values, std = car_least_squares([recording_of(dive)], vehicle)
    except RecordingError:  # too few complete rows
        return NOTHING, NOTHING
    return (
        np.array([*(values[name] for name in NAMES[:5]), np.nan]),
        np.array([*(std[name] for name in NAMES[:5]), np.nan]),
    )


def maximum_likelihood(dive: Dive) -> Answer:
    """Maximum likelihood on the bench."""
    fit = fit_maximum_likelihood([recording_of(dive)])
    return fit.parameters[:6].copy(), np.sqrt(np.diag(covariance(fit)))[:6]


METHODS: dict[str, Method] = {
    "car least squares": least_squares,
    "RLS (mils p = 1)": lambda dive: mils(dive, 1),
    "MILS (mils p = 5)": lambda dive: mils(dive, 5),
    "live (robust p = 1)": robust,
    "live (robust p = 5)": lambda dive: robust(dive, innovation_length=5),
    "bench (ml)": maximum_likelihood,
    "live (robust, drift = 0.05)": lambda dive: robust(dive, drift=0.05),
}
REGRESSIONS = tuple(METHODS)[:3]
COMPARED = tuple(METHODS)[:6]
LIVE = "live (robust p = 1)"
FOLLOWING = "live (robust, drift = 0.05)"

DRIFTING = "a1 ... b2 drift by 20 to 30 %"
CASES: dict[str, Case] = {
    "10 Hz, 0.1 deg, 1 cm": Case(),
    "5 Hz": Case(step=0.2),
    "20 Hz": Case(step=0.05),
    "50 Hz": Case(step=0.02),
    "0.02 deg, 2 mm": Case(pitch_noise=float(np.deg2rad(0.02)), depth_noise=0.002),
    "0.5 deg, 5 cm": Case(pitch_noise=float(np.deg2rad(0.5)), depth_noise=0.05),
    "30 % lost at random": Case(missing=0.3),
    "60 % lost at random": Case(missing=0.6),
    "60 % lost in bursts of 2 s": Case(missing=0.6, burst=2.0),
    "30 % of rows lost, the plane with them": Case(missing=0.3, loses_rows=True),
    "60 % of rows lost, the plane with them": Case(missing=0.6, loses_rows=True),
    "offsets of sensors and trim": Case(offsets=(0.03, 0.2)),
    "measured speed, c_wq estimated": Case(tells_speed=True),
    DRIFTING: Case(duration=600.0, drift=(1.3, 0.8, 0.7, 1.25, 0.8)),
}
"""The first is the case in which all methods are compared; the live estimator flies them all, the last
with its parameters free to drift."""
