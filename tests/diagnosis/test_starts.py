"""Where fits of sets begin: at the likeliest moment, in every valley that a lag or a bent base may hide."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.catalogue import named, structure_of
from host.catalogue.kin import AS_A_LEVER, moving_alike
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.prospects import probed, whitened_at
from host.diagnosis.fits.starts import (
    SLUGGISH,
    _with_depth_moved_alike,
    scanned,
    with_other_moments,
    with_usual_pitch,
)
from host.diagnosis.proof.deviations import deviations
from host.diagnosis.search.exchange import _is_close_kin
from host.dynamics.propagate import free_run, inputs_of
from host.likelihood.fit import Fit
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error
from host.recordings.recording import Array, Recording

AT_REST = np.array([0.0, 0.0, 0.0, 20.0, 0.0])
WEAKENED_AT = 31.3  # under a large plane angle, so that the recording can tell


def weakened(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    lost = -0.02 * plane * (time > WEAKENED_AT)
    return lost * BASE["b1"], lost * BASE["b2"], 0.0


def test_a_change_too_small_to_be_seen_from_another_moment_is_found() -> None:
    fitter = Fitter([hidden_dive(weakened)])
    found = fitter.grown(fitter.base, "rudder_effectiveness_change", [])
    values = dict(zip(found.fit.structure.names, found.fit.parameters, strict=True))
    assert values["effectiveness_time"] == pytest.approx(WEAKENED_AT, abs=0.5)
    assert values["effectiveness_step"] == pytest.approx(-0.02, abs=0.005)
    assert found.bic < fitter.base.bic - 20.0


def test_a_force_is_also_foretold_from_none_of_it() -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    starts = [values.tolist() for _, values in probed(fitter, fitter.base, named("heave_quadratic_drag"), [])]
    assert [0.0] in starts
    assert [-1.0] in starts
    lagging = [v.tolist() for _, v in probed(fitter, fitter.base, named("actuator_lag"), [])]
    assert [0.0] not in lagging


def test_a_moment_stays_where_it_was_while_another_stretch_is_settled() -> None:
    def weaker(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        lost = -0.004 * plane * (time > 60.0)
        return lost * BASE["b1"], lost * BASE["b2"], 0.0

    under_way = hidden_dive(weaker, seed=5, duration=120.0).between(21.0, 120.0)
    fitter = Fitter([under_way])
    first = [np.array([-0.004, 60.0])]
    found = fitter.polished(fitter.grown(fitter.base, "rudder_effectiveness_change", first))
    again = Fitter([under_way], known=found).refitted(found)
    index = again.fit.structure.names.index("effectiveness_time")
    assert again.fit.parameters[index] == pytest.approx(60.0, abs=2.0)
    assert again.bic < found.bic + 1.0


def test_a_moment_of_which_nothing_tells_is_uncertain_by_no_more_than_the_recording() -> None:
    plain = hidden_dive(seed=2)
    fitter = Fitter([replace(plain, rudder=np.where(plain.time > 30.0, 0.0, plain.rudder))])
    name = "rudder_effectiveness_change"
    start = fitter.point(frozenset({name}), fitter.base, name, np.array([-0.1, 60.0]))
    found = fitter.explained(frozenset({name}), fitter.carried_on(start))
    assert deviations(fitter, found)["effectiveness_time"] == plain.duration / np.sqrt(12.0)


def test_a_moment_that_lay_between_the_stretches_fitted_first_is_found_on_all_of_them() -> None:
    def lamed(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        lost = -0.5 * plane * (time > WEAKENED_AT)
        return lost * BASE["b1"], lost * BASE["b2"], 0.0

    fitter, names = Fitter([hidden_dive(lamed)]), frozenset({"rudder_effectiveness_change"})
    elsewhere = fitter.point(names, fitter.base, *names, np.array([-0.5, WEAKENED_AT + 9.0]))
    index = elsewhere.structure.names.index("effectiveness_time")
    assert fitter.carried_on(elsewhere).parameters[index] > WEAKENED_AT + 3.0
    unsettled = fitter.explained(names, output_error(elsewhere, fitter.inputs(names), fitter.free(names), 1))
    again = fitter.refitted(unsettled)
    assert again.fit.parameters[index] == pytest.approx(WEAKENED_AT, abs=0.1)
    assert 0.02 < deviations(fitter, again)["effectiveness_time"] < 0.1


def test_a_moment_is_found_under_forces_as_well() -> None:
    gusts = np.random.default_rng(8).standard_normal((2, 91))

    def blown(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        lost = -0.5 * plane * (time > WEAKENED_AT)
        force, moment = gusts[:, int(time)] * [0.004, 0.02]
        return lost * BASE["b1"] + force, lost * BASE["b2"] + moment, 0.0

    fitter, names = Fitter([hidden_dive(blown)]), frozenset({"rudder_effectiveness_change"})
    late = fitter.point(names, fitter.base, *names, np.array([-0.5, WEAKENED_AT + 40.0]))
    late = late.with_noise(np.array([*fitter.floor, *(0.05 * np.square(fitter.accelerations))]))
    found, index = scanned(fitter, late), late.structure.names.index("effectiveness_time")
    assert found.parameters[index] == pytest.approx(WEAKENED_AT, abs=1.0)
    assert np.array_equal(np.delete(found.parameters, index), np.delete(late.parameters, index))


def test_a_fit_that_ended_in_another_rest_of_the_plane_begins_again_at_the_right_moment() -> None:
    def lamed(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        lost = -0.5 * plane * (time > WEAKENED_AT)
        return lost * BASE["b1"], lost * BASE["b2"], 0.0

    fitter, names = Fitter([hidden_dive(lamed)]), frozenset({"rudder_effectiveness_change"})
    stuck, right = (
        fitter.explained(names, fitter.carried_on(fitter.point(names, fitter.base, *names, np.array(values))))
        for values in ([-0.5, WEAKENED_AT + 4.0], [-0.5, WEAKENED_AT])
    )
    assert stuck.fit.parameters[-1] > WEAKENED_AT + 3.0
    (again,) = with_other_moments(fitter, stuck)
    assert fitter.carried_on(again).parameters[-1] == pytest.approx(WEAKENED_AT, abs=0.1)
    assert with_other_moments(fitter, right) == []


def test_a_search_far_below_its_goal_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    def lamed(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        lost = -0.5 * plane * (time > WEAKENED_AT)
        return lost * BASE["b1"], lost * BASE["b2"], 0.0

    def counted(*arguments: Any) -> Fit:
        spent.append(output_error(*arguments))
        return spent[-1]

    fitter = Fitter([hidden_dive(lamed)])
    right = fitter.polished(fitter.grown(fitter.base, "rudder_effectiveness_change", []))
    monkeypatch.setattr("host.diagnosis.fits.fitter.output_error", counted)
    iterations = {}
    for goal in (None, right.fit):
        spent: list[Fit] = []
        found = fitter.grown(fitter.base, "pitch_quadratic_damping", [], None, goal)
        assert found.fit.log_likelihood < right.fit.log_likelihood - 1000.0
        iterations[goal is None] = sum(fit.iterations for fit in spent)
    assert iterations[False] < 0.5 * iterations[True]
    again = fitter.grown(fitter.base, "rudder_effectiveness_change", [], None, right.fit)
    assert again.bic < right.bic + 1.0


@pytest.mark.parametrize("has_forces", [False, True])
def test_residuals_are_the_same_without_their_slopes(has_forces: bool) -> None:
    fitter = Fitter([hidden_dive(duration=20.0)])
    fit = fitter.base.fit
    noise = np.array([*fit.noise[:2], 1e-4, 1e-4]) if has_forces else fit.noise
    explanation = replace(fitter.base, fit=replace(fit, noise=noise))
    point, inputs = fitter.point(frozenset(), explanation), fitter.inputs(frozenset(), has_forces)
    full, cost = whitened_at(point, inputs, explanation)
    short, same = whitened_at(point, inputs, explanation, has_slopes=False)
    assert same == pytest.approx(cost)
    np.testing.assert_allclose(short[0][0], full[0][0], atol=1e-9)
    assert short[0][1].shape == (2, 0, full[0][0].shape[1])


def test_a_moment_at_which_the_plane_rested_may_be_anywhere_in_that_rest() -> None:
    rest, moment = (40.0, 50.0), 47.0

    def lamed(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        lost = -plane * (1.0 if rest[0] <= time < rest[1] else 0.5 * (time > moment))
        return lost * BASE["b1"], lost * BASE["b2"], 0.0

    dive = hidden_dive(lamed)
    rests = (dive.time > rest[0] - 1e-6) & (dive.time < rest[1] - 1e-6)
    fitter, name = Fitter([replace(dive, rudder=np.where(rests, 0.0, dive.rudder))]), "effectiveness_time"
    found = fitter.grown(fitter.base, "rudder_effectiveness_change", [np.array([-0.5, 44.0])])
    value = dict(zip(found.fit.structure.names, found.fit.parameters, strict=True))[name]
    std = deviations(fitter, found)[name]
    assert rest[0] - 0.2 < value < rest[1] + 0.2
    assert abs(value - moment) < 2.0 * std
    assert 2.4 < std < 5.3


@pytest.mark.parametrize(("a1", "b1"), [(-25.0, 10.0), (-1e-4, 0.02)])
def test_a_base_without_a_usual_heave_is_no_place_to_begin(
    a1: float, b1: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    def coupled(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        return 0.8 * x[1], 0.0, 0.0

    fitter = Fitter([hidden_dive(coupled)])
    monkeypatch.setattr("host.diagnosis.fits.starts.may_be_bent", lambda *_: False)
    bent = fitter.base.fit.parameters.copy()
    bent[[0, 3]] = a1, b1
    parent = Explanation(fitter.base.names, replace(fitter.base.fit, parameters=bent), fitter.base.bic)
    found = fitter.polished(fitter.grown(parent, "heave_pitch_rate_coupling", []))
    assert found.fit.parameters[0] == pytest.approx(BASE["a1"], abs=0.1)
    assert found.fit.parameters[-1] == pytest.approx(0.8, abs=0.1)


def test_an_oscillation_starts_with_the_size_that_suits_its_period() -> None:
    # Within the steps of the depth what is too large by far tells nothing of what is right.
    def swell(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        return 0.0, 0.0, 4e-4 * np.sin(2.0 * np.pi * time / 140.0)

    dive = hidden_dive(swell, seed=2, duration=200.0, noise=0.1)
    fitter = Fitter([replace(dive, depth=0.02 * np.round(dive.depth / 0.02))])
    assert fitter.steps[1] > 0.0
    found = probed(fitter, fitter.base, named("internal_wave"), [])
    assert min(gain for gain, _ in found) > -1.0
    _, (sine, cosine, period) = max(found, key=lambda pair: pair[0])
    assert period == pytest.approx(140.0, rel=0.1)
    assert np.hypot(sine, cosine) == pytest.approx(4e-4, rel=0.3)


def rate_limited(rate: float) -> Recording:
    """A quick hull whose plane creeps from step to step of its command."""
    structure = structure_of(("actuator_rate_limit",))
    rng, h = np.random.default_rng(3), 0.2
    time = np.arange(0.0, 300.0, h)
    command = np.repeat(rng.choice([-0.027, 0.0, 0.027], 60), 25)
    plain = hidden_dive(duration=1.0)
    nan = np.full(time.size, np.nan)
    dive = replace(plain, time=time, rudder=command, depth=nan, pitch=nan, speed=nan, pitch_rate=nan, step=h)
    values = [*{**BASE, "a1": -0.5, "a2": -5.6, "a3": -0.24, "b1": -1.2, "b2": -3.8}.values(), 0.0, 0.0, rate]
    pitch, depth = free_run(np.array(values), AT_REST, inputs_of(dive, structure)).outputs
    return replace(
        dive,
        pitch=np.round((pitch + 1e-3 * rng.standard_normal(time.size)) / 2e-3) * 2e-3,
        depth=np.round((depth + 0.03 * rng.standard_normal(time.size)) / 0.1) * 0.1,
    )


def test_a_slow_plane_is_found_where_the_base_took_it_for_a_slow_hull(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fitter, name = Fitter([rate_limited(0.0063)]), "actuator_rate_limit"
    root = fitter.root
    assert root.fit.parameters[1] > SLUGGISH
    # From a plane so quick that its limit makes no difference no fit comes back.
    quick = fitter.point(root.names | {name}, root, name, np.array([50.0]))
    monkeypatch.setattr("host.diagnosis.fits.fitter.starts_of", lambda *_: [quick])
    found = fitter.grown(root, name, [])
    values = dict(zip(found.fit.structure.names, found.fit.parameters, strict=True))
    assert values["plane_rate"] == pytest.approx(0.0063, rel=0.03)
    assert values["a2"] == pytest.approx(-5.6, rel=0.3)


def test_a_hull_of_usual_damping_begins_as_it_is() -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    assert with_usual_pitch(fitter, fitter.root, "actuator_rate_limit", []) == []


def test_a_set_that_runs_away_without_an_effect_begins_anew_from_the_motion() -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    found = fitter.base
    for name in ("munk_moment", "heave_pitch_rate_coupling", "pitch_quadratic_damping"):
        found = fitter.grown(found, name, [])
    names, values = found.fit.structure.names, found.fit.parameters.copy()
    for name, value in {"c_qw": 50.0, "c_wq": 2.0, "c_qq": -10.0}.items():
        values[names.index(name)] = value  # a hull that turns broadside, which the damping alone holds
    held = replace(found, fit=replace(found.fit, parameters=values))
    start = fitter.point(held.names - {"pitch_quadratic_damping"}, held)
    assert not np.isfinite(fitter.fitted([start]).log_likelihood)
    assert fitter.excess(fitter.shrunk(held, "pitch_quadratic_damping").fit) < 1.1


def test_a_buoyancy_beside_a_lag_is_found_although_each_alone_is_far_off() -> None:
    structure = structure_of(("depth_dependent_buoyancy", "pitch_sensor_lag"))
    rows = replace(hidden_dive(duration=300.0), speed=np.full(3000, 1.0))
    rows.rudder[:30] = 0.0  # from where a lagging reading begins
    rows.rudder[:] *= 0.4
    hull = {"a1": -1.1, "a2": -7.9, "a3": -0.68, "b1": -0.42, "b2": -4.5, "u0": 1.0}
    known = {**hull, "heave_offset": 0.0, "pitch_offset": 0.0}
    known |= {"c_wz": 0.0025, "neutral_depth": 20.0, "pitch_lag_time": 1.04}
    values = np.array([known[name] for name in structure.names])
    pitch, depth = free_run(values, AT_REST, inputs_of(rows, structure)).outputs
    noise = np.array([[7e-4], [3e-3]]) * np.random.default_rng(2).standard_normal((2, rows.time.size))
    fitter = Fitter([replace(rows, pitch=pitch + noise[0], depth=depth + noise[1])])
    lagging = fitter.grown(fitter.root, "pitch_sensor_lag", [])
    assert fitter.excess(lagging.fit) > 5.0
    found = fitter.grown(lagging, "depth_dependent_buoyancy", [])
    assert fitter.excess(found.fit) < 1.5
    lag = dict(zip(found.fit.structure.names, found.fit.parameters.tolist(), strict=True))["pitch_lag_time"]
    assert lag == pytest.approx(1.04, rel=0.1)


@pytest.mark.parametrize("name", [*AS_A_LEVER])
def test_what_a_lever_arm_joins_moves_as_before(name: str) -> None:
    rows = hidden_dive(duration=30.0)
    rows = replace(rows, rudder=0.05 * rows.rudder)  # as far as an angle is its sine
    others = frozenset({"heave_pitch_rate_coupling", "munk_moment"})
    without, beside = structure_of(others), structure_of(others | {name})
    known = dict.fromkeys(without.names, 0.0) | BASE | {"a3": 0.0, "c_wq": 0.5, "c_qw": 0.7}
    moved = moving_alike(known, name, 0.8) | {AS_A_LEVER[name]: 0.8}
    before, after = (
        free_run(
            np.array([values[own] for own in structure.names]), AT_REST, inputs_of(rows, structure)
        ).outputs
        for values, structure in ((known, without), (moved, beside))
    )
    assert np.abs(after - before)[0].max() < 1e-6
    assert np.abs(after - before)[1].max() < 2e-4
    assert np.abs(before[1] - before[1].mean()).max() > 0.1
    assert moving_alike(moved, name, 0.3) is moved
    assert moving_alike(BASE, name, 0.3) is BASE


@pytest.mark.parametrize("is_lever", [True, False])
def test_a_lever_arm_moves_the_depth_as_what_the_pitch_acceleration_does_to_heave(is_lever: bool) -> None:
    rows = hidden_dive(duration=30.0)
    rows = replace(rows, rudder=0.1 * rows.rudder)  # as far as an angle is its sine
    base = Fitter([rows]).base
    pair = ["heave_pitch_acceleration_coupling", "depth_sensor_lever_arm"]
    others = frozenset({"heave_pitch_rate_coupling", "munk_moment"})
    name, other = pair if not is_lever else pair[::-1]
    structure = structure_of(others | {other})
    known = dict.fromkeys(structure.names, 0.0) | BASE | {"c_wq": 0.5, "c_qw": 0.7}
    known |= {"sensor_forward": 0.8} if other == "depth_sensor_lever_arm" else {"c_wa": -0.8}
    values = np.array([known[own] for own in structure.names])
    fit = replace(base.fit, structure=structure, parameters=values, free=np.ones(values.size, dtype=bool))
    rival, parent = Explanation(others | {other}, fit, 0.0), Explanation(others, base.fit, 0.0)
    fitter: Any = SimpleNamespace(
        point=lambda names, _, added, probe: Point(
            structure_of(names),
            np.array([(known | {AS_A_LEVER[added]: float(probe[0])})[n] for n in structure_of(names).names]),
            fit.initial,
            fit.levels,
        )
    )
    (start,) = _with_depth_moved_alike(fitter, rival, parent, name)
    run = free_run(values, AT_REST, inputs_of(rows, structure)).outputs
    same = free_run(start.parameters, AT_REST, inputs_of(rows, start.structure)).outputs
    assert np.abs(same - run)[0].max() < 1e-6
    assert np.abs(same - run)[1].max() < 2e-4
    assert np.abs(run[1] - run[1].mean()).max() > 0.1
    assert _with_depth_moved_alike(fitter, rival, parent, "depth_sensor_lag") == []
    assert _is_close_kin(name, other)
