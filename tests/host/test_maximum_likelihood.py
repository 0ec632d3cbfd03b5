from types import SimpleNamespace

import numpy as np
import pytest
from exact_dive import TABLE_1, Dive, fly
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from host.dynamics.equations import NAMES
from host.dynamics.propagate import free_run, inputs_of
from host.dynamics.sensitivities import innovations
from host.identification.identifiability import undetermined
from host.identification.uncertainty import covariance
from host.likelihood import start_values
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.likelihood.output_error import RUNAWAY, diverges

TRUTH = np.array([*TABLE_1.values(), 0.0, 0.0])


def deviations(fit, truth=TRUTH):  # type: ignore[no-untyped-def]
    std = np.sqrt(np.diag(covariance(fit)))
    free = fit.free
    return (fit.parameters[free] - truth[free]) / std[free]


def test_noise_free_recording_gives_the_vehicle_back() -> None:
    recording, _ = fly(Dive(pitch_noise=0.0, depth_noise=0.0, duration=60.0))
    fit = fit_maximum_likelihood([recording])
    assert fit.converged
    assert np.allclose(fit.parameters, TRUTH, rtol=1e-3, atol=2e-5)


def test_where_pitch_tells_nothing_a_start_that_runs_away_is_held(monkeypatch: pytest.MonkeyPatch) -> None:
    recording, _ = fly(Dive(duration=25.0))
    ran_away = SimpleNamespace(x=np.array([900.0, 5.0]), fun=0.0)
    monkeypatch.setattr(start_values, "minimize", lambda *_, **__: ran_away)
    (found, *_) = start_values.start_values([recording])
    assert np.isfinite(found[0]).all()


def test_a_long_dive_of_a_vehicle_that_hardly_restores_itself_is_no_runaway() -> None:
    slow = (-0.02, -1e-3, -3e-5, 0.01, 1e-4, 0.3)
    recording, states = fly(Dive(vehicle=slow, step=4.0, duration=3000.0, amplitude=0.3))
    inputs = [inputs_of(recording)]
    _, sensitivity = innovations(np.array([*slow, 0.0, 0.0]), np.append(states[:, 0], 0.0), inputs[0])
    assert np.abs(sensitivity).max() > RUNAWAY
    assert not diverges([(np.zeros(0), sensitivity)], inputs)
    diverging = np.array([*slow, 0.0, 0.0])
    diverging[2] = 1e-3
    _, sensitivity = innovations(diverging, np.append(states[:, 0], 0.0), inputs[0])
    assert diverges([(np.zeros(0), sensitivity)], inputs)


def test_noisy_recording_is_unbiased_where_car_regression_fails() -> None:
    recording, _ = fly(Dive(duration=300.0))
    fit = fit_maximum_likelihood([recording])
    assert fit.converged
    assert not fit.has_process_noise
    assert np.abs(deviations(fit)).max() < 4.0
    relative = np.abs(fit.parameters[:6] / TRUTH[:6] - 1.0)
    assert relative.max() < 0.05
    assert np.sqrt(fit.noise[:2]) == pytest.approx([np.deg2rad(0.1), 0.01], rel=0.05)


def test_offsets_and_a_moving_start_are_found() -> None:
    recording, states = fly(Dive(offsets=(0.02, 0.05), start=(0.2, -0.1, 0.1, 5.0)))
    fit = fit_maximum_likelihood([recording])
    assert np.abs(deviations(fit, np.array([*TABLE_1.values(), 0.02, 0.05]))).max() < 4.0
    assert np.allclose(fit.initial[0][:4], states[:, 0], atol=0.02)


def test_most_samples_missing_costs_accuracy_not_truth() -> None:
    recording, _ = fly(Dive(missing=0.6, duration=200.0))
    fit = fit_maximum_likelihood([recording])
    assert np.abs(deviations(fit)).max() < 4.0


def test_short_dives_add_up() -> None:
    dives = [fly(Dive(seed=seed, duration=20.0))[0] for seed in range(8)]
    alone = np.sqrt(np.diag(covariance(fit_maximum_likelihood(dives[:2]))))
    fit = fit_maximum_likelihood(dives)
    together = np.sqrt(np.diag(covariance(fit)))
    assert np.abs(deviations(fit)).max() < 4.0
    assert (together < 0.75 * alone).all()


def test_a_dive_that_is_measured_only_late_does_not_spoil_another() -> None:
    """Its initial state has died away by then, and must not be anything whatever."""
    first, _ = fly(Dive(seed=1))
    late, _ = fly(Dive(seed=2, start=(0.1, 0.1, 0.1, 20.0)))
    late.pitch[:700] = late.depth[:700] = np.nan
    fit = fit_maximum_likelihood([first, late], held={"heave_offset": 0.0, "pitch_offset": 0.0})
    assert all(np.abs(initial[1:3]).max() < 1.0 for initial in fit.initial)
    assert (np.abs(fit.parameters[:6] - TRUTH[:6]) < 4.0 * np.sqrt(np.diag(covariance(fit)))[:6]).all()


def test_measured_speed_replaces_u0() -> None:
    speed = 2.5 + 0.8 * np.sign(np.sin(np.arange(1200) / 90.0))
    recording, _ = fly(Dive(speed=speed))
    fit = fit_maximum_likelihood([recording])
    assert not fit.free[NAMES.index("u0")]
    assert np.abs(deviations(fit)).max() < 4.0


def test_unknown_forces_are_recognised_and_widen_the_deviations() -> None:
    recording, _ = fly(Dive(force_density=(1e-4, 1e-4), duration=200.0))
    fit = fit_maximum_likelihood([recording])
    assert fit.has_process_noise
    assert np.abs(deviations(fit)).max() < 4.0
    calm = fit_maximum_likelihood([fly(Dive(duration=200.0))[0]])
    assert covariance(fit)[0, 0] > 4.0 * covariance(calm)[0, 0]
    assert np.sqrt(fit.noise[2:]) == pytest.approx([1e-2, 1e-2], rel=0.5)


def test_a_plane_at_rest_leaves_the_plane_coefficients_open() -> None:
    recording, _ = fly(Dive(amplitude=0.0))
    fit = fit_maximum_likelihood([recording])
    assert {"b1", "b2"} <= set(undetermined(fit.parameters, covariance(fit), fit.free))


def test_an_excited_vehicle_leaves_nothing_open() -> None:
    fit = fit_maximum_likelihood([fly(Dive())[0]])
    assert undetermined(fit.parameters, covariance(fit), fit.free) == []


@settings(max_examples=8, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(
    a1=st.floats(-2.5, -0.15),
    frequency=st.floats(0.6, 4.0),
    damping=st.floats(0.25, 1.5),
    b1=st.floats(0.1, 1.5),
    gain=st.floats(0.3, 2.0),
    u0=st.floats(0.8, 4.0),
)
def test_any_ordinary_vehicle_moves_as_identified_without_a_guess(
    a1, frequency, damping, b1, gain, u0
) -> None:  # type: ignore[no-untyped-def]
    vehicle = (a1, -2.0 * damping * frequency, -(frequency**2), b1, -gain * frequency**2, u0)
    recording, states = fly(Dive(vehicle=vehicle, duration=150.0))
    fit = fit_maximum_likelihood([recording])
    # Coefficients may trade against one another where heave hides behind pitch; the motion may not.
    simulated = free_run(fit.parameters, fit.initial[0], inputs_of(recording)).states
    error = np.sqrt(np.mean((simulated - states) ** 2, axis=1))
    assert error[2] < 0.3 * np.deg2rad(0.1)
    assert error[3] < 0.3 * 0.01
