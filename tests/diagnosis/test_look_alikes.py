"""Points of other valleys that move much alike: poles, lags and forces in each other's place."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.catalogue import structure_of
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.starts import with_usual_heave
from host.dynamics.propagate import free_run, inputs_of
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error
from host.likelihood.valleys import (
    ALMOST_AS_LIKELY,
    has_usual_heave,
    other_valleys,
    with_depth_lag_swapped,
    with_force_mirrored,
    with_poles_swapped,
    with_stall_moved,
)

AT_REST = np.array([0.0, 0.0, 0.0, 20.0, 0.0])


@pytest.mark.parametrize("name", ["pitch_sensor_lag", "actuator_lag"])
@pytest.mark.parametrize("others", [{}, {"munk_moment": 1.5}])
def test_a_lag_and_a_pole_of_pitch_may_trade_places(name: str, others: dict[str, float]) -> None:
    rows, structure = hidden_dive(duration=30.0), structure_of((*others, name))
    rows.rudder[:5] = 0.0  # from where a lagging plane begins
    slow = {**BASE, "a2": -5.0, "a3": -4.0}  # poles at -1 and -4 1/s
    own = [*slow.values(), 0.0, 0.0, *others.values(), 0.5]
    point = Point(structure, np.array(own), [AT_REST], np.zeros(4))
    inputs = inputs_of(rows, structure)
    true = free_run(point.parameters, AT_REST, inputs).outputs
    swapped = [one for one in with_poles_swapped(point) if one.parameters[-1] != 0.5]  # others move heave's
    assert sorted(one.parameters[-1] for one in swapped) == pytest.approx([0.25, 1.0])
    for one in swapped:
        run = free_run(one.parameters, AT_REST, inputs).outputs
        np.testing.assert_allclose(run[0], true[0], atol=2e-4)
        assert np.abs(one.parameters[:6] - point.parameters[:6]).max() > 0.1


def test_a_lag_may_trade_places_with_a_pole_that_heave_and_pitch_share() -> None:
    rows = hidden_dive(duration=30.0)
    structure = structure_of(("munk_moment", "heave_pitch_rate_coupling", "pitch_sensor_lag"))
    rows.rudder[:5] = 0.0  # from where a lagging reading begins
    turned = {"heave_offset": 0.0, "pitch_offset": 0.0, "c_qw": 1.0, "c_wq": 1.9, "pitch_lag_time": 3.0}
    known = {**BASE, "a1": -0.39, "a2": -2.1, "a3": -4.7, "b1": 0.9, **turned}
    point = Point(structure, np.array([known[name] for name in structure.names]), [AT_REST], np.zeros(4))
    inputs = inputs_of(rows, structure)
    true = free_run(point.parameters, AT_REST, inputs).outputs
    (swapped,) = with_poles_swapped(point)  # the other two poles swing
    assert 1.0 < swapped.parameters[-1] < 1.5
    run = free_run(swapped.parameters, AT_REST, inputs).outputs
    np.testing.assert_allclose(run[0], true[0], atol=2e-4)
    assert np.abs(run[1] - true[1]).max() > 0.1
    (again,) = with_poles_swapped(swapped)
    np.testing.assert_allclose(again.parameters, point.parameters, rtol=1e-9)


def test_heave_that_turns_the_hull_and_a_pole_of_pitch_may_trade_places() -> None:
    rows, structure = hidden_dive(duration=30.0), structure_of(("munk_moment",))
    slow = {**BASE, "a1": -0.7, "a2": -5.0, "a3": -4.0}  # poles of pitch at -1 and -4 1/s
    point = Point(structure, np.array([*slow.values(), 0.0, 0.0, 0.0]), [AT_REST], np.zeros(4))
    inputs = inputs_of(rows, structure)
    true = free_run(point.parameters, AT_REST, inputs).outputs
    swapped = with_poles_swapped(point)
    assert sorted(one.parameters[0] for one in swapped) == pytest.approx([-4.0, -1.0])
    for one in swapped:
        run = free_run(one.parameters, AT_REST, inputs).outputs
        np.testing.assert_allclose(run[0], true[0], atol=2e-4)
        assert np.abs(run[1] - true[1]).max() > 0.01


def test_heave_and_the_lag_of_a_depth_sensor_may_trade_places() -> None:
    rows, structure = (
        hidden_dive(duration=30.0),
        structure_of(("depth_sensor_lag", "heave_pitch_rate_coupling")),
    )
    rows.rudder[:5] = 0.0  # from where a lagging reading begins
    known = {**BASE, "heave_offset": 0.0, "pitch_offset": 0.0, "c_wq": 0.7, "depth_lag_time": 0.5}
    point = Point(structure, np.array([known[n] for n in structure.names]), [AT_REST], np.zeros(4))
    inputs = inputs_of(rows, structure)
    true = free_run(point.parameters, AT_REST, inputs).outputs
    (swapped,) = with_depth_lag_swapped(point)
    assert swapped.parameters[0] == pytest.approx(-2.0)
    assert swapped.parameters[-1] == pytest.approx(-1.0 / BASE["a1"])
    run = free_run(swapped.parameters, AT_REST, inputs).outputs
    np.testing.assert_allclose(run, true, atol=2e-4)
    (again,) = with_depth_lag_swapped(swapped)
    np.testing.assert_allclose(again.parameters, point.parameters, rtol=1e-9)


@pytest.mark.parametrize(("b1", "mirrored"), [(0.5, -0.5), (-0.02, 0.394)])
def test_a_hull_turned_by_its_heave_does_not_say_which_way_its_plane_pushes(
    b1: float, mirrored: float
) -> None:
    rows, structure = hidden_dive(duration=30.0), structure_of(("munk_moment",))
    own = {**BASE, "b1": b1}
    point = Point(structure, np.array([*own.values(), 0.0, 0.0, 1.0]), [AT_REST], np.zeros(4))
    inputs = inputs_of(rows, structure)
    true = free_run(point.parameters, AT_REST, inputs).outputs
    (other,) = with_force_mirrored(point)
    assert other.parameters[3] == pytest.approx(mirrored, abs=1e-3)
    run = free_run(other.parameters, AT_REST, inputs).outputs
    np.testing.assert_allclose(run[0], true[0], atol=1e-6)
    assert np.abs(run[1] - true[1]).max() > 0.1
    without = Point(structure_of(()), point.parameters[:-1], [AT_REST], np.zeros(4))
    assert with_force_mirrored(without) == []


def test_a_plane_thought_to_push_the_wrong_way_is_turned_round(monkeypatch: pytest.MonkeyPatch) -> None:
    rows, structure = hidden_dive(duration=90.0), structure_of(("munk_moment",))
    true = np.array([*{**BASE, "a1": -1.5, "b1": 0.7}.values(), 0.0, 0.0, 5.0])
    pitch, depth = free_run(true, AT_REST, inputs_of(rows, structure)).outputs
    rng = np.random.default_rng(2)
    noise = np.array([[2e-3], [4e-3]]) * rng.standard_normal((2, rows.time.size))
    fitter = Fitter([replace(rows, pitch=pitch + noise[0], depth=depth + noise[1])])
    monkeypatch.setattr("host.diagnosis.fits.starts.may_be_bent", lambda *_: False)
    wrong = fitter.base.fit.parameters.copy()
    wrong[[0, 3]] = -0.8, -0.05
    parent = Explanation(fitter.base.names, replace(fitter.base.fit, parameters=wrong), fitter.base.bic)
    found = fitter.polished(fitter.grown(parent, "munk_moment", [np.array([-12.0])]))
    assert found.fit.parameters[3] == pytest.approx(0.7, abs=0.1)
    assert found.fit.parameters[-1] == pytest.approx(5.0, abs=0.7)


@pytest.mark.parametrize("b1", [0.4, -0.4])
def test_a_heave_that_hardly_moves_begins_again_with_a_plane_that_pushes_either_way(b1: float) -> None:
    slow = Point(
        structure_of(()), np.array([-0.02, -3.4, -8.2, 0.02, -4.0, 2.5, 0.0, 0.0]), [AT_REST], np.zeros(4)
    )
    assert [tuple(start.parameters[[0, 3]]) for start in with_usual_heave(slow)] == [
        (-1.0, -0.4),
        (-1.0, 0.4),
    ]
    fast = replace(slow, parameters=np.array([-20.0, -3.4, -8.2, 20.0 * b1, -4.0, 2.5, 0.0, 0.0]))
    (start,) = with_usual_heave(fast)
    assert tuple(start.parameters[[0, 3]]) == pytest.approx((-1.0, b1))


def test_a_vehicle_that_stands_still_begins_again_at_a_usual_speed() -> None:
    standing = np.array([-0.2, -9.5, -1.8, 0.9, -3.0, 0.0, 0.0, 0.0])
    still = Point(structure_of(()), standing, [AT_REST], np.zeros(4))
    slow = replace(still, parameters=np.where(np.arange(8) == 5, 0.3, standing))  # a glider
    assert not has_usual_heave(still)
    assert has_usual_heave(slow)
    assert [tuple(start.parameters[[0, 5]]) for start in with_usual_heave(still)] == [(-1.0, 1.5)] * 2


def test_the_depth_tells_which_of_the_poles_is_the_lag() -> None:
    structure, names = structure_of(("pitch_sensor_lag",)), frozenset({"pitch_sensor_lag"})
    slow = np.array([*{**BASE, "a2": -5.0, "a3": -4.0}.values(), 0.0, 0.0, 0.5])
    rows = hidden_dive(duration=60.0)
    rows = replace(rows, speed=np.full(rows.time.size, BASE["u0"]))  # with it heave has one valley only
    pitch, depth = free_run(slow, AT_REST, inputs_of(rows, structure)).outputs
    rng = np.random.default_rng(1)
    noise = np.array([[1e-3], [5e-3]]) * rng.standard_normal((2, rows.time.size))
    fitter = Fitter([replace(rows, pitch=pitch + noise[0], depth=depth + noise[1])])
    inputs, free = fitter.inputs(names), fitter.free(names)
    start = Point(structure, slow, [AT_REST], np.zeros(4))
    for swapped in with_poles_swapped(start):
        wrong = output_error(swapped, inputs, free)
        best = max([wrong, *other_valleys(wrong, inputs)], key=lambda fit: fit.log_likelihood)
        assert best.parameters[-1] == pytest.approx(0.5, abs=0.05)


def test_reversals_of_one_size_hardly_tell_where_a_plane_stalls() -> None:
    structure, names = (
        structure_of(("rudder_stall", "actuator_lag")),
        frozenset({"rudder_stall", "actuator_lag"}),
    )
    stall = {"lag_time": 0.1, "stall_angle": 0.25, "stall_loss": 1.4, "stall_share": 0.5}
    known = {**BASE, "heave_offset": 0.0, "pitch_offset": 0.0, **stall}
    true = np.array([known[name] for name in structure.names])
    rows = hidden_dive(duration=90.0)
    rows = replace(rows, rudder=0.5 * np.sign(rows.rudder), speed=np.full(rows.time.size, BASE["u0"]))
    pitch, depth = free_run(true, AT_REST, inputs_of(rows, structure)).outputs
    rng = np.random.default_rng(3)
    noise = np.array([[1e-3], [5e-3]]) * rng.standard_normal((2, rows.time.size))
    fitter = Fitter([replace(rows, pitch=pitch + noise[0], depth=depth + noise[1])])
    angle = structure.names.index("stall_angle")
    other = with_stall_moved(Point(structure, true, [AT_REST], np.zeros(4)))
    assert [one.parameters[angle] for one in other] == pytest.approx([0.15, 0.1875, 0.3375, 0.425])
    for one in other:
        size, loss = 2.0 * 0.25, one.parameters[structure.names.index("stall_loss")]
        lift = one.parameters[3] * (size - loss * (size - one.parameters[angle]))
        assert lift == pytest.approx(BASE["b1"] * 0.25 * (2.0 - 1.4))
    wrong = output_error(other[0], fitter.inputs(names), fitter.free(names))
    assert wrong.parameters[angle] < 0.2
    best = max(other_valleys(wrong, fitter.inputs(names)), key=lambda fit: fit.log_likelihood)
    right = output_error(
        Point(structure, true, [AT_REST], np.zeros(4)), fitter.inputs(names), fitter.free(names)
    )
    assert wrong.log_likelihood < right.log_likelihood - 4.0
    assert best.log_likelihood > right.log_likelihood - ALMOST_AS_LIKELY
    assert with_stall_moved(Point(structure_of(()), true[:8], [AT_REST], np.zeros(4))) == []


def test_a_pitch_that_swings_has_no_pole_to_trade() -> None:
    point = Point(
        structure_of(("pitch_sensor_lag",)), np.array([*BASE.values(), 0.0, 0.0, 0.5]), [AT_REST], np.zeros(4)
    )
    assert with_poles_swapped(point) == []
