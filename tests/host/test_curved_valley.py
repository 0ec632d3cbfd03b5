"""A fit whose optimum lies far along a narrow, curved valley is followed there."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from host.catalogue import CATALOGUE, structure_of
from host.dynamics.equations import Effect
from host.dynamics.propagate import free_run, inputs_of
from host.likelihood import gauss_newton
from host.likelihood import output_error as subject
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error
from host.likelihood.straightened import PREFIXES, slopes, stepped
from host.recordings.recording import Recording

# A lag of the servo and a moment of heave: pitch damping, restoring and plane moment can rise together.
TRUTH = {
    "a1": -3.9, "a2": -7.0, "a3": -0.29, "b1": -0.65, "b2": -3.2, "u0": 3.2,
    "c_qw": 1.3, "c_qq": -3.5, "lag_time": 0.11,
}  # fmt: skip
NEAR_THE_OTHER_END = {"a2": -4.7, "a3": -0.206, "b1": -0.58, "b2": -2.37, "c_qw": 0.0, "c_qq": -2.6}


@pytest.fixture(scope="module")
def start_and_recording() -> tuple[Point, Recording]:
    rng = np.random.default_rng(5)
    rows, step = 1600, 0.125
    rudder, at = np.empty(rows), 0
    while at < rows:
        until = at + int(rng.uniform(8, 60))
        rudder[at:until] = rng.uniform(-0.06, 0.06)
        at = until
    nan = np.full(rows, np.nan)
    structure = structure_of(("munk_moment", "pitch_quadratic_damping", "actuator_lag"))
    blank = Recording(
        name="valley.csv", sha256="0" * 64, time=np.arange(rows) * step, depth=np.zeros(rows),
        pitch=np.zeros(rows), rudder=rudder, speed=np.full(rows, 3.2), pitch_rate=nan, step=step,
    )  # fmt: skip
    truth = np.array([TRUTH.get(name, 0.0) for name in structure.names])
    outputs = free_run(truth, np.array([0.0, 0.0, 0.0, 20.0, 0.0]), inputs_of(blank, structure)).outputs
    outputs += np.array([[2e-3], [9e-3]]) * rng.standard_normal(outputs.shape)
    recording = Recording(
        name="valley.csv", sha256="0" * 64, time=blank.time, depth=outputs[1], pitch=outputs[0],
        rudder=rudder, speed=blank.speed, pitch_rate=nan, step=step,
    )  # fmt: skip
    values = {**TRUTH, **NEAR_THE_OTHER_END, "lag_time": 0.08}
    parameters = np.array([values.get(name, 0.0) for name in structure.names])
    initial = [np.array([0.0, 0.0, outputs[0, 0], outputs[1, 0], 0.0])]
    return Point(structure, parameters, initial, np.array([4e-6, 8e-5, 0.0, 0.0])), recording


def _left(start: Point, recording: Recording, most: int, tolerance: float) -> float:
    """Log-likelihood that a fit leaves to that from the truth."""
    inputs, names = [inputs_of(recording, start.structure)], start.structure.names
    free = np.array([name not in ("u0", "heave_offset", "pitch_offset") for name in names])
    truth = replace(start, parameters=np.array([TRUTH.get(name, 0.0) for name in names]))
    best = output_error(truth, inputs, free, 200, 1e-9)
    return best.log_likelihood - output_error(start, inputs, free, most, tolerance).log_likelihood


def test_it_is_followed_to_its_end(start_and_recording: tuple[Point, Recording]) -> None:
    assert _left(*start_and_recording, 40, 0.005) < 0.1


def test_in_plain_coordinates_it_would_take_far_longer(
    start_and_recording: tuple[Point, Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gauss_newton, "slopes", lambda names, _: np.eye(len(names)))
    monkeypatch.setattr(gauss_newton, "stepped", lambda _, parameters, step: parameters + step)
    assert _left(*start_and_recording, 40, 0.005) > 0.5


def test_a_rough_fit_goes_on_while_much_is_promised(
    start_and_recording: tuple[Point, Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    start, recording = start_and_recording
    values = dict(zip(start.structure.names, start.parameters.tolist(), strict=True))
    values |= {"a1": 3.0 * values["a1"], "b1": 3.0 * values["b1"], "lag_time": 0.05}
    start = replace(start, parameters=np.array(list(values.values())))
    assert _left(start, recording, 25, 0.2) < 1.0
    monkeypatch.setattr(subject, "PROMISED", np.inf)
    assert _left(start, recording, 25, 0.2) > 2.0


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.name)
def test_coefficients_are_named_after_the_equation_that_they_go_with(effect: Effect) -> None:
    for damping, slot in (("a1", "heave"), ("a2", "pitch")):
        if any(parameter.name.startswith(PREFIXES[damping]) for parameter in effect.parameters):
            assert effect.slot == slot


@given(st.lists(st.floats(-0.5, 0.5), min_size=10, max_size=10))
def test_a_step_is_what_its_slopes_say_and_keeps_the_signs_of_damping(moves: list[float]) -> None:
    names = structure_of(("heave_quadratic_drag", "munk_moment")).names
    values = np.array([TRUTH.get(name, -0.4) for name in names])
    step = np.array(moves[: values.size])
    there = stepped(names, values, 1e-6 * step)
    np.testing.assert_allclose((there - values) / 1e-6, slopes(names, values) @ step, atol=1e-5)
    far = stepped(names, values, 20.0 * step)
    assert far[0] < 0.0
    assert far[1] < 0.0
    u0 = names.index("u0")
    assert far[u0] == (values + 20.0 * step)[u0]
