"""The noise models of the bench against dense algebra, and against recordings made to mistake them."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from exact_dive import TABLE_1, Dive, fly
from scipy.signal import lfilter

from host.dynamics.propagate import free_run, inputs_of
from host.identification.identify import identify
from host.identification.uncertainty import covariance
from host.likelihood.ascent import _Scoring, place
from host.likelihood.coloured_noise import WanderingSensors, coloured_noise
from host.likelihood.filter_error import RandomForces, filter_error
from host.likelihood.gauss_newton import Point
from host.likelihood.kalman import KalmanPass
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.likelihood.waves import SHAPE, in_waves, in_waves_from, is_sea, passes_in_waves, whitened_in_waves
from host.vehicle import default_vehicle

TRUTH = np.array([*TABLE_1.values(), 0.0, 0.0])


def wandering(rows: int, deviation: float, time: float, seed: int) -> np.ndarray:
    kept = np.exp(-0.1 / time)
    kicks = np.random.default_rng(seed).standard_normal(rows) * deviation * np.sqrt(1.0 - kept**2)
    return np.asarray(lfilter([1.0], [1.0, -kept], kicks))


def with_wandering_depth(duration: float = 150.0):  # type: ignore[no-untyped-def]
    recording, _ = fly(Dive(duration=duration))
    recording.depth[:] += wandering(recording.time.size, 0.03, 2.0, 5)
    return recording


def test_likelihood_of_wandering_sensors_equals_dense_algebra_with_samples_missing() -> None:
    recording, states = fly(Dive(duration=6.0, missing=0.3))
    inputs = inputs_of(recording)
    noise = np.array([3e-6, 1e-4, 2e-6, 9e-4, 0.4, 2.0])
    here = place(
        Point(inputs.structure, TRUTH, [np.append(states[:, 0], 0.0)], noise), WanderingSensors([inputs])
    )
    residual = inputs.measured - free_run(TRUTH, np.append(states[:, 0], 0.0), inputs).outputs
    apart = np.abs(recording.time[:, None] - recording.time)
    dense = 0.0
    for i in range(2):
        seen = inputs.present[i] > 0.0
        R = noise[2 + i] * np.exp(-apart / noise[4 + i]) + noise[i] * np.eye(apart.shape[0])
        R, e = R[np.ix_(seen, seen)], residual[i, seen]
        dense -= 0.5 * (np.linalg.slogdet(R)[1] + e @ np.linalg.solve(R, e))
    assert here.likelihood == pytest.approx(dense, rel=1e-9)


def test_a_trial_that_runs_away_among_wandering_sensors_is_refused() -> None:
    recording, states = fly(Dive(duration=600.0, step=0.5))
    inputs = inputs_of(recording)
    diverging = TRUTH.copy()
    diverging[1:3] = -1e-4, 5.0
    noise = np.array([3e-6, 1e-4, 2e-6, 9e-4, 0.4, 2.0])
    there = place(
        Point(inputs.structure, diverging, [np.append(states[:, 0], 0.0)], noise), WanderingSensors([inputs])
    )
    assert there.likelihood == -np.inf


def test_wandering_depth_is_not_taken_for_force() -> None:
    fit = fit_maximum_likelihood([with_wandering_depth()])
    assert fit.has_coloured_noise
    assert not fit.has_process_noise
    assert np.sqrt(fit.wander[1, 0]) == pytest.approx(0.03, rel=0.3)
    assert fit.wander[1, 1] == pytest.approx(2.0, rel=0.5)
    std = np.sqrt(np.diag(covariance(fit)))
    assert (np.abs(fit.parameters - TRUTH) < 4.0 * std).all()


def test_a_coarse_depth_sensor_costs_accuracy_not_truth() -> None:
    recording, _ = fly(Dive(duration=200.0))
    recording.depth[:] = 0.1 * np.round(recording.depth / 0.1)
    fit = fit_maximum_likelihood([recording])
    assert not fit.has_process_noise
    std = np.sqrt(np.diag(covariance(fit)))
    assert (np.abs(fit.parameters - TRUTH) < 4.0 * std).all()
    assert (np.abs(fit.parameters[:6] / TRUTH[:6] - 1.0) < 0.15).all()


@pytest.mark.parametrize("which", ["forces", "wandering"])
def test_no_noise_level_can_be_moved_uphill(which: str) -> None:
    if which == "forces":
        recording, _ = fly(Dive(duration=100.0, force_density=(1e-3, 1e-3)))
    else:
        recording = with_wandering_depth(100.0)
    inputs = [inputs_of(recording)]
    start = fit_maximum_likelihood([recording], noise_model="output_error")
    if which == "forces":
        fit, model = filter_error(start, inputs), RandomForces(inputs)
        noise = fit.noise
    else:
        fit, model = coloured_noise(start, inputs), WanderingSensors(inputs)
        noise = np.concatenate([fit.noise[:2], fit.wander[:2, 0], fit.wander[:2, 1]])
    point = Point(fit.structure, fit.parameters, fit.initial, noise)
    top = place(point, model).likelihood
    assert top == pytest.approx(fit.log_likelihood, abs=1e-6)
    for level in range(noise.size):
        for factor in (0.8, 1.25):
            moved = noise.copy()
            moved[level] *= factor
            assert (
                place(point.with_noise(moved), model).likelihood < top + 0.1
            )  # what the last step may leave


def sway(recording, frequency: float, damping: float, force: float, seed: int) -> None:  # type: ignore[no-untyped-def]
    """Adds what waves of a band do: a heave force of this deviation, m/s^2, and as much pitch, rad/s^2."""
    rng, rows = np.random.default_rng(seed), recording.time.size
    radius = np.exp(-damping * frequency * 0.1)
    swing = [1.0, -2.0 * radius * np.cos(frequency * 0.1), radius**2]
    waves = np.array(
        [np.asarray(lfilter([1.0], swing, rng.standard_normal(rows + 600)))[600:] for _ in range(2)]
    )
    waves *= force / waves.std(axis=1, keepdims=True)
    a1, a2, a3, _, _, u0 = TABLE_1.values()
    w = q = theta = zeta = 0.0
    for k in range(rows):  # the motion that the waves add; small steps, for the hull is linear
        recording.pitch[k] += theta
        recording.depth[k] += zeta
        for _ in range(10):
            w, q, theta, zeta = (
                w + 0.01 * (a1 * w + waves[0, k]),
                q + 0.01 * (a2 * q + a3 * theta + waves[1, k]),
                theta + 0.01 * q,
                zeta + 0.01 * (w - u0 * theta),
            )


def test_waves_are_found_with_their_frequency_and_bias_nothing() -> None:
    recording, _ = fly(Dive(duration=150.0))
    frequency = 1.2
    sway(recording, frequency, damping=0.1, force=0.02, seed=8)
    fit = fit_maximum_likelihood([recording])
    assert fit.has_process_noise
    assert fit.waves[0] == pytest.approx(frequency, rel=0.1)
    assert fit.waves[1] == pytest.approx(0.1, abs=0.07)
    std = np.sqrt(np.diag(covariance(fit)))
    assert (np.abs(fit.parameters - TRUTH) < 4.0 * std).all()
    # A fit that goes on from there, in the same waves, finds nothing more, and its innovations are the same.
    inputs = [inputs_of(recording)]
    assert is_sea(fit)
    ran_away = [0.0, 0.0]
    for broad_or_slow in ([1.0, 0.4], [0.3, 0.1], [4.0, 0.1], ran_away):
        assert not is_sea(replace(fit, waves=np.array([*broad_or_slow, 0.0, 1.0, 1.0])))
    turned = replace(
        fit, waves=np.array([0.8, 0.04, 14.0, 1e-7, 2e-7]), noise=np.array([1e-6, 1e-4, 0.0, 0.0])
    )
    assert not is_sea(turned)  # water that turns the vehicle so rises by half of what the depth errs by
    assert is_sea(replace(turned, noise=np.array([1e-6, 1e-3, 0.0, 0.0])))  # that would not show
    assert is_sea(replace(turned, waves=np.array([0.8, 0.04, 1.0, 1e-5, 2e-7])))
    here = Point(fit.structure, fit.parameters, fit.initial, fit.levels)
    again = in_waves_from(here, inputs, fit.free, holds_noise=True)
    np.testing.assert_allclose(again.levels, fit.levels, rtol=1e-12)
    assert again.log_likelihood == pytest.approx(fit.log_likelihood, abs=0.1)
    white, sensitivity = whitened_in_waves(here, inputs)[0]
    np.testing.assert_allclose(white, np.nan_to_num(fit.whitened[0]), atol=1e-9)
    assert sensitivity.shape == (2, fit.parameters.size + 5, recording.time.size)
    # So they are by its own gains, handed in; and by those of other waves they are not.
    own, states = passes_in_waves(here, inputs), fit.structure.states
    by_gains, slopes = whitened_in_waves(here, inputs, own, states)[0]
    np.testing.assert_allclose(by_gains, white, atol=1e-9)
    np.testing.assert_allclose(slopes, sensitivity, rtol=1e-6, atol=1e-6)
    other = passes_in_waves(here.with_noise(here.noise * np.array([1, 1, 2, 1, 1, 1, 1])), inputs)
    assert not np.allclose(whitened_in_waves(here, inputs, other, states)[0][0], white, atol=1e-3)


def test_one_wave_in_depth_and_pitch_leaves_speed_and_damping_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    recording, _ = fly(Dive(duration=150.0))
    rng = np.random.default_rng(3)
    met, phase = rng.uniform(1.0, 1.5, 12), rng.uniform(0.0, 2.0 * np.pi, 12)
    _, a2, a3, _, _, u0 = TABLE_1.values()
    q = theta = zeta = 0.0
    for k in range(recording.time.size):  # the motion that the waves add; small steps, for the hull is linear
        recording.pitch[k] += theta
        recording.depth[k] += zeta
        for h in recording.time[k] + 0.01 * np.arange(10):
            climb, slope = np.sin(met * h + phase).sum(), np.cos(met * h + phase).sum()
            q, theta, zeta = (
                q + 0.01 * (a2 * q + a3 * theta - 0.05 * slope),
                theta + 0.01 * q,
                zeta + 0.01 * (0.03 * climb - u0 * theta),
            )
    fit = fit_maximum_likelihood([recording])
    frequency, damping, turn = fit.waves[:3]
    assert frequency == pytest.approx(1.25, rel=0.1)
    assert damping < 0.3
    assert turn == pytest.approx(-0.05 / (0.03 * 1.25) / -a2, rel=0.15)
    std = np.sqrt(np.diag(covariance(fit)))
    assert (np.abs(fit.parameters - TRUTH) < 4.0 * std).all()
    assert fit.parameters[5] == pytest.approx(u0, rel=0.05)
    # Two waves that know nothing of one another, as likely as can be, are less likely than the one.
    unknown = [replace(each, lower=0.0, upper=0.0) if each.name == "wave_turn" else each for each in SHAPE]
    monkeypatch.setattr("host.likelihood.waves.SHAPE", tuple(unknown))
    turning = fit.levels[5] * (frequency * turn) ** 2
    apart = Point(fit.structure, fit.parameters, fit.initial, np.array([*fit.levels[:6], turning]))
    two = in_waves_from(apart, [inputs_of(recording)], fit.free)
    assert two.waves[2] == 0.0
    assert two.log_likelihood < fit.log_likelihood - 20.0


def test_weak_waves_are_found_where_white_forces_tell_nothing() -> None:
    recording, _ = fly(Dive(duration=200.0))
    rng = np.random.default_rng(5)
    met, phase = rng.uniform(1.0, 1.5, 12), rng.uniform(0.0, 2.0 * np.pi, 12)
    recording.pitch[:] += 3e-4 * np.sin(np.outer(recording.time, met) + phase).sum(axis=1)
    calm = fit_maximum_likelihood([recording], noise_model="output_error")
    none = replace(calm, noise=np.array([*calm.noise[:2], 1e-16, 1e-16]))
    inputs = [inputs_of(recording)]
    fit = in_waves(none, inputs)
    assert is_sea(fit)
    assert fit.waves[0] == pytest.approx(1.25, rel=0.15)
    assert fit.log_likelihood > calm.log_likelihood + 40.0


def test_wandering_is_told_and_kept_in_the_model() -> None:
    result = identify([with_wandering_depth()], default_vehicle())
    assert any(note.startswith("The sensors' errors wander") and "depth" in note for note in result.notes)
    assert result.model.noise["depth_wander_m"] == pytest.approx(0.03, rel=0.3)
    assert result.model.noise["depth_wander_s"] == pytest.approx(2.0, rel=0.5)


def test_a_noise_level_that_loses_the_recording_where_it_is_moved_stays() -> None:
    recording, states = fly(Dive(duration=6.0))
    inputs, noise = inputs_of(recording), np.array([3e-6, 1e-4, 1e-3, 1e-3])

    class Brittle(RandomForces):
        def passes(self, point: Point) -> list[KalmanPass]:
            runs = super().passes(point)
            if point.noise[3] == noise[3]:
                return runs
            return [replace(run, variance=np.full_like(run.variance, np.inf)) for run in runs]

    model = Brittle([inputs])
    here = place(Point(inputs.structure, TRUTH, [np.append(states[:, 0], 0.0)], noise), model)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        moved = _Scoring(here, model).trial(1e-3)
    assert moved[3] == noise[3]
    assert np.isfinite(moved).all()
    assert (moved[:3] != noise[:3]).all()


def test_waves_far_below_the_noise_are_found_by_the_band_in_which_they_swing() -> None:
    recording, _ = fly(Dive(duration=150.0, seed=9))
    sway(
        recording, 1.0, damping=0.01, force=0.002, seed=9
    )  # a quarter of the depth's noise, a seventh of pitch's
    inputs = [inputs_of(recording)]
    white = filter_error(fit_maximum_likelihood([recording], noise_model="output_error"), inputs)
    swaying = in_waves(white, inputs)
    assert is_sea(swaying)
    assert swaying.waves[0] == pytest.approx(1.0, rel=0.05)
    assert swaying.log_likelihood > white.log_likelihood + 5.0
