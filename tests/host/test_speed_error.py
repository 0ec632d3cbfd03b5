"""What errors of the speed do to depth is whitened, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from host.dynamics.equations import NAMES
from host.dynamics.propagate import free_run, inputs_of
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.noise.drift import Whitening
from host.noise.speed import smoothed_speed
from host.noise.speed_error import speed_error, speed_errors
from host.recordings.recording import Array, Recording

BASE = np.array([-0.63084, -3.38699, -8.19858, 0.41385, -3.94120, 1.5, 0.0, 0.0])
DEPTH_NOISE, PITCH_NOISE, SPEED_NOISE = 0.005, 0.001, 0.05


def dive(rng: np.random.Generator, rows: int = 1500) -> Recording:
    """A dive of known coefficients whose speed wanders, behind noisy sensors at 5 Hz."""
    h, nothing = 0.2, np.full(rows, np.nan)
    rudder = np.repeat(rng.uniform(-0.3, 0.3, rows // 25), 25)
    true = Recording(
        name="dive.csv",
        sha256="0" * 64,
        time=np.arange(rows) * h,
        depth=nothing,
        pitch=nothing,
        rudder=rudder,
        speed=1.5 + np.cumsum(0.005 * rng.standard_normal(rows)),
        pitch_rate=nothing,
        step=h,
    )
    inputs = inputs_of(true)
    inputs.drive[1] = true.speed  # as it was, not smoothed
    pitch, depth = free_run(BASE, np.array([0.0, 0.0, 0.0, 20.0, 0.0]), inputs).outputs
    return replace(
        true,
        pitch=pitch + PITCH_NOISE * rng.standard_normal(rows),
        depth=depth + DEPTH_NOISE * rng.standard_normal(rows),
        speed=true.speed + SPEED_NOISE * rng.standard_normal(rows),
    )


def filter_of(recording: Recording) -> Whitening:
    found = speed_error(recording, DEPTH_NOISE**2)
    assert found is not None
    return Whitening(found)


def covariance_of(recording: Recording) -> Array:
    """Of the depth residuals, over the sensor's variance: from the definition, all rows at once."""
    _, variance, decay = smoothed_speed(recording.speed)
    rows = recording.time.size
    apart = np.abs(np.subtract.outer(np.arange(rows), np.arange(rows)))
    integral = np.tril(np.tile(-recording.pitch * recording.intervals, (rows, 1)), -1)
    return np.asarray(np.eye(rows) + integral @ (variance * decay**apart) @ integral.T / DEPTH_NOISE**2)


@pytest.mark.parametrize("lost", [0.0, 0.3])
def test_it_whitens_as_the_whole_covariance_does(lost: float) -> None:
    rng = np.random.default_rng(5)
    recording = dive(rng, 200)
    missing = rng.random(200) < lost
    recording = replace(recording, depth=np.where(missing, np.nan, recording.depth))
    values = rng.standard_normal((3, 200))
    error = filter_of(recording)
    white = np.where(missing, 0.0, error.whitened(np.where(missing, 0.0, values)))
    known = ~missing
    covariance = covariance_of(recording)[np.ix_(known, known)]
    expected = values[:, known] @ np.linalg.solve(covariance, values[:, known].T)
    np.testing.assert_allclose(white @ white.T, expected, rtol=1e-8)
    assert 2.0 * error.charge == pytest.approx(float(np.linalg.slogdet(covariance)[1]))


def test_there_is_none_without_a_sensor_or_where_it_makes_no_difference() -> None:
    recording = dive(np.random.default_rng(6), 300)
    blind = replace(recording, speed=np.full(300, np.nan))
    assert speed_error(blind, DEPTH_NOISE**2) is None
    assert speed_error(recording, 100.0) is None
    assert speed_error(replace(recording, speed=np.full(300, 1.5)), DEPTH_NOISE**2) is None
    assert speed_error(replace(recording, pitch=np.full(300, np.nan)), DEPTH_NOISE**2) is None


def test_intervals_hold_when_the_speed_sensor_is_noisy() -> None:
    apart, left = [], []
    for seed in range(12):
        fit = fit_maximum_likelihood([dive(np.random.default_rng(seed))], noise_model="output_error")
        std = np.sqrt(np.diag(np.linalg.inv(fit.information[np.ix_(fit.free, fit.free)])))
        apart.append(((fit.parameters - BASE)[fit.free] / std)[: NAMES.index("u0")])
        left.append(np.sqrt(fit.noise[1]) / DEPTH_NOISE)
    assert 0.6 < float(np.sqrt(np.mean(np.square(apart)))) < 1.4
    assert float(np.mean(left)) == pytest.approx(1.0, abs=0.15)


def test_rounded_depth_that_errors_of_the_speed_move_is_no_longer_told_by_intervals() -> None:
    recording = dive(np.random.default_rng(3))
    coarse = replace(recording, depth=np.round(recording.depth, 1))
    steps = np.array([0.01, 0.1])
    (error,), told = speed_errors([coarse], 0.1**2 / 12.0, steps)
    assert error is not None
    assert told.tolist() == [0.01, 0.0]
    still = replace(coarse, speed=np.full(coarse.time.size, 1.5))
    assert speed_errors([still], 0.1**2 / 12.0, steps) == ([None], steps)
