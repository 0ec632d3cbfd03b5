from dataclasses import replace

import numpy as np
import pytest
from exact_dive import TABLE_1, Dive, fly
from scipy.stats import multivariate_normal

from host.catalogue import structure_of
from host.dynamics.propagate import FIRST_LAG, free_run, inputs_of, longest_substep
from host.dynamics.sensitivities import innovations
from host.likelihood.kalman import kalman_pass
from host.recordings.recording import LED_IN

TRUTH = np.array([*TABLE_1.values(), 0.0, 0.0])


def test_free_run_equals_the_matrix_exponential() -> None:
    recording, states = fly(Dive(duration=60.0))
    simulated = free_run(TRUTH, np.append(states[:, 0], 0.0), inputs_of(recording)).states
    assert np.abs(simulated - states).max() < 2e-6


@pytest.mark.parametrize(("step", "substeps"), [(0.1, 1), (0.5, 1), (1.0, 2), (4.0, 2)])
def test_a_slow_vehicle_needs_few_sub_steps_however_seldom_it_is_recorded(step: float, substeps: int) -> None:
    slow = (-0.1, -0.2, -0.02, 0.03, -0.02, 0.5)
    recording, states = fly(Dive(vehicle=slow, step=step, duration=600.0))
    truth = np.array([*slow, 0.0, 0.0])
    inputs = inputs_of(recording, longest_substep=longest_substep(truth, step))
    assert inputs.substeps == substeps
    simulated = free_run(truth, np.append(states[:, 0], 0.0), inputs).states
    assert (np.abs(simulated - states).max(axis=1) < 1e-3 * np.ptp(states, axis=1)).all()


def test_free_run_follows_a_speed_that_changes_from_row_to_row() -> None:
    time = np.arange(4000) * 0.01
    rudder = np.repeat(0.2 * np.sign(np.sin(time[::10])), 10)
    fine = Dive(step=0.01, duration=40.0, rudder=rudder, speed=2.5 + 0.5 * np.sin(time / 3.0 + 0.005 / 3.0))
    recording, states = fly(fine)
    kept = recording.rudder[::10], states[:, ::10], 2.5 + 0.5 * np.sin(time[::10] / 3.0)
    coarse, _ = fly(Dive(duration=40.0, rudder=kept[0], speed=kept[2]))
    simulated = free_run(TRUTH, np.append(states[:, 0], 0.0), inputs_of(coarse)).states
    assert np.abs(simulated - kept[1]).max() < 2e-4


def test_sensitivities_equal_finite_differences() -> None:
    recording, states = fly(Dive(duration=30.0))
    inputs = inputs_of(recording)
    start = np.append(states[:, 0], 0.0)
    _, sensitivity = innovations(TRUTH, start, inputs)
    for index in range(TRUTH.size + 5):
        change = np.zeros(TRUTH.size + 5)
        change[index] = 1e-6
        moved = [
            free_run(TRUTH + s * change[: TRUTH.size], start + s * change[TRUTH.size :], inputs).outputs
            for s in (1.0, -1.0)
        ]
        slope = (moved[0] - moved[1]) / 2e-6
        assert np.allclose(sensitivity[:, index], slope, atol=1e-6 * max(1.0, np.abs(slope).max()))


def test_kalman_filter_without_process_noise_is_the_free_run() -> None:
    recording, states = fly(Dive(duration=30.0, missing=0.3))
    inputs = inputs_of(recording)
    run = kalman_pass(TRUTH, np.append(states[:, 0], 0.0), np.array([3e-6, 1e-4, 0.0, 0.0]), inputs)
    error, _ = innovations(TRUTH, np.append(states[:, 0], 0.0), inputs)
    assert np.allclose(run.error, error, atol=1e-12)
    assert np.allclose(run.gains, 0.0)


def test_a_plane_that_may_be_off_in_a_row_spreads_what_comes_after_it() -> None:
    recording, states = fly(Dive(duration=1.0))
    inputs, start = inputs_of(recording), np.append(states[:, 0], 0.0)
    noise, off = np.array([3e-6, 1e-4, 0.0, 0.0]), np.zeros(recording.time.size)
    off[3] = 0.02
    variance = kalman_pass(TRUTH, start, noise, replace(inputs, astray=off)).variance
    runs = (free_run(TRUTH, start, inputs.with_rudder(rudder)).outputs for rudder in (off, 0.0 * off))
    shift = np.subtract(*runs)[:, 4]  # linear: whatever else the plane does
    assert np.allclose(variance[:, :4], [[noise[0]], [0.0], [noise[1]]], rtol=1e-12)
    spread = np.outer(shift, shift) + np.diag(noise[:2])
    assert np.allclose(variance[:, 4], [spread[0, 0], spread[0, 1], spread[1, 1]], rtol=1e-9)


def test_kalman_likelihood_equals_the_dense_gaussian() -> None:
    """The filter's product of innovations must be the joint density of all measurements."""
    recording, states = fly(Dive(duration=1.2, force_density=(0.02, 0.05)))
    inputs = inputs_of(recording)
    noise = np.array([3e-6, 1e-4, 0.02, 0.05])
    run = kalman_pass(TRUTH, np.append(states[:, 0], 0.0), noise, inputs)
    rows = recording.time.size
    filtered = 0.0
    for k in range(rows):
        S = np.array([[run.variance[0, k], run.variance[1, k]], [run.variance[1, k], run.variance[2, k]]])
        filtered += multivariate_normal.logpdf(run.error[:, k], cov=S)
    mean = free_run(TRUTH, np.append(states[:, 0], 0.0), inputs).outputs
    A = _transition_by_differences(inputs)
    Q = np.diag([noise[2], noise[3], 0.0, 0.0]) * recording.step
    step_noise = A @ (Q / 2) @ A.T + Q / 2
    joint = np.zeros((2 * rows, 2 * rows))
    P = np.zeros((4, 4))
    covariances = []
    for _ in range(rows):
        covariances.append(P)
        P = A @ P @ A.T + step_noise
    for i in range(rows):
        for j in range(i, rows):
            block = (np.linalg.matrix_power(A, j - i) @ covariances[i])[2:, 2:]
            joint[2 * j : 2 * j + 2, 2 * i : 2 * i + 2] = block
            joint[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] = block.T
    joint += np.diag(np.tile(noise[:2], rows))
    dense = multivariate_normal.logpdf(inputs.measured.T.ravel(), mean.T.ravel(), joint)
    assert abs(dense - filtered) < 1e-6 * abs(dense)


def _transition_by_differences(inputs):  # type: ignore[no-untyped-def]
    base = free_run(TRUTH, np.zeros(5), inputs).states[:, 1]
    return np.column_stack([free_run(TRUTH, unit, inputs).states[:, 1] - base for unit in np.eye(5)[:4]])


SERVO = ("actuator_lag", "actuator_rate_limit", "actuator_backlash", "actuator_delay")
SLOW = {"lag_time": 0.8, "plane_rate": 0.3, "backlash": 0.05, "delay": 0.45}


@pytest.mark.parametrize("named", [SERVO[:1], SERVO[1:2], SERVO[2:3], SERVO[3:], SERVO[::3], SERVO[:2]])
def test_a_stretch_begins_with_its_plane_where_the_rows_before_lead_it(named: tuple[str, ...]) -> None:
    structure = structure_of(named)
    values = np.array([*TRUTH, *(SLOW[name] for name in structure.names[TRUTH.size :])])
    recording, states = fly(Dive(duration=60.0))
    whole = free_run(values, np.append(states[:, 0], 0.0), inputs_of(recording, structure))
    moves = np.flatnonzero(np.diff(recording.rudder)) + 2
    first = int(moves[moves > 100][0])  # in the middle of a movement, 6 s into the recording and more
    part = recording.between(float(recording.time[first]), np.inf)
    begun = np.append(whole.states[:4, first], 0.0)
    led = free_run(values, begun, inputs_of(part, structure)).outputs
    assert np.abs(led - whole.outputs[:, first:]).max() < 2e-3 * np.ptp(whole.outputs, axis=1).min()
    alone = free_run(values, begun, inputs_of(replace(part, before=np.zeros((2, 0))), structure)).outputs
    assert np.abs(alone - whole.outputs[:, first:]).max() > 0.01 * np.ptp(whole.outputs, axis=1).min()


def test_sensitivities_know_what_led_the_plane_to_where_a_stretch_begins() -> None:
    structure = structure_of(("actuator_lag", "actuator_backlash"))
    values = np.array([*TRUTH, *(SLOW[name] for name in structure.names[TRUTH.size :])])
    recording, states = fly(Dive(duration=30.0))
    moves = np.flatnonzero(np.diff(recording.rudder))
    moved = int(moves[moves > 100][0]) + 3
    inputs = inputs_of(recording.between(float(recording.time[moved]), np.inf), structure)
    start = np.append(states[:, moved], 0.0)
    _, sensitivity = innovations(values, start, inputs)
    for index in range(values.size):
        change = 1e-6 * (np.arange(values.size) == index)
        apart = [free_run(values + sign * change, start, inputs).outputs for sign in (1.0, -1.0)]
        slope = (apart[0] - apart[1]) / 2e-6
        assert np.allclose(sensitivity[:, index], slope, atol=2e-4 * max(1.0, np.abs(slope).max()))


def test_commands_before_a_stretch_are_those_of_the_recording() -> None:
    recording, _ = fly(Dive(duration=30.0))
    structure = structure_of(("actuator_delay",))
    whole = inputs_of(recording, structure).drive
    part = recording.between(12.0, 20.0).between(14.0, 18.0)
    rows = (recording.time >= 14.0) & (recording.time < 18.0)
    lags = slice(FIRST_LAG, None)
    assert np.array_equal(inputs_of(part, structure).drive[lags], whole[lags, rows])
    assert part.before[0].min() == pytest.approx(14.0 - LED_IN)
    changed = inputs_of(part, structure).with_rudder(np.zeros(part.time.size)).drive
    assert np.array_equal(changed[-1, :5], whole[-1, rows][:5])
