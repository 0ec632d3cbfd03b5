"""What a recording cannot tell is said, by name, with the manoeuvre that tells it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from exact_dive import TABLE_1, Dive, fly

from host.dynamics.equations import BASE, NAMES
from host.dynamics.propagate import inputs_of
from host.identification.identifiability import ambiguity, left_open, open_combinations, undetermined
from host.identification.identify import identify
from host.identification.uncertainty import covariance, covariance_within
from host.likelihood.gauss_newton import Point
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.likelihood.output_error import output_error
from host.recordings.recording import Array, Recording
from host.vehicle import default_vehicle


def slow_swing(time: Array) -> Array:
    """A plane so slow that pitch is always settled: only the gain b2 / a3 shows."""
    return 0.25 * np.sin(2.0 * np.pi * time / 40.0)


def quick_reversals(time: Array) -> Array:
    """3-2-1-1 of 1 s, over and over."""
    return 0.25 * np.where(np.isin(time.astype(int) % 7, (0, 1, 2, 5)), 1.0, -1.0)


def flown(plane: Callable[[Array], Array], monkeypatch) -> Recording:  # type: ignore[no-untyped-def]
    monkeypatch.setattr(
        "exact_dive.multistep", lambda _rng, rows, step, _amplitude: plane(np.arange(rows) * step)
    )
    return fly(Dive())[0]


def test_a_slow_plane_shows_only_a_combination_and_quick_reversals_show_the_rest(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    slow = flown(slow_swing, monkeypatch)
    fit = fit_maximum_likelihood([slow])
    (combination,) = open_combinations(fit.parameters, covariance(fit), fit.free)
    assert set(combination.change) == {"a2", "a3", "b2"}
    assert set(combination.change) == set(undetermined(fit.parameters, covariance(fit), fit.free))
    assert "3-2-1-1" in combination.manoeuvre
    # Along it the gain b2 / a3 stays: both change by the same share.
    share = {name: combination.change[name] / fit.parameters[NAMES.index(name)] for name in ("a3", "b2")}
    assert abs(share["a3"] / share["b2"] - 1.0) < 0.1
    both = fit_maximum_likelihood([slow, flown(quick_reversals, monkeypatch)])
    assert open_combinations(both.parameters, covariance(both), both.free) == []
    assert undetermined(both.parameters, covariance(both), both.free) == []


def test_heave_damping_and_plane_force_are_named_together_after_a_short_dive() -> None:
    result = identify([fly(Dive(duration=8.0))[0]], default_vehicle())
    assert {"a1", "b1"} <= set(result.undetermined)
    assert any(note.startswith("b1 and a1 are known only together") for note in result.notes)


def test_a_good_dive_leaves_no_combination_open() -> None:
    result = identify([fly(Dive())[0]], default_vehicle())
    assert not any("known only together" in note or "Two answers" in note for note in result.notes)


def test_parameters_that_nothing_shows_are_no_combination() -> None:
    result = identify([fly(Dive(amplitude=0.0))[0]], default_vehicle())
    assert {"b1", "b2"} <= set(result.undetermined)
    assert not any("b2" in note and "known only together" in note for note in result.notes)


def test_two_valleys_are_told() -> None:
    """Little motion under much noise: a slow hull that climbs by its planes, or a fast one that pitches."""
    dive = Dive(seed=7, duration=40.0, amplitude=0.1, pitch_noise=0.01, depth_noise=0.05)
    result = identify([fly(dive)[0]], default_vehicle())
    assert result.fit is not None
    (rival,) = result.fit.rivals
    (note,) = [note for note in result.notes if note.startswith("Two answers")]
    assert "u0" in note
    # The other answer is a maximum as well: begun there, the search stays and ends almost as likely.
    start = Point(BASE, rival.parameters, result.fit.initial, result.fit.noise)
    again = output_error(start, [inputs_of(result.recordings[0])], result.fit.free)
    assert np.allclose(again.parameters[:6], rival.parameters[:6], rtol=0.1)
    assert abs(again.log_likelihood - result.fit.log_likelihood) < 3.0
    # Who reads a value and its deviation alone is warned as well.
    local, whole = covariance_within(result.fit), covariance(result.fit)
    assert whole[5, 5] > local[5, 5] + 0.04 * (rival.parameters[5] - result.fit.parameters[5]) ** 2
    more = fit_maximum_likelihood([fly(replace(dive, amplitude=0.25, duration=120.0))[0]])
    assert more.rivals == ()
    assert abs(more.parameters[5] / TABLE_1["u0"] - 1.0) < 0.3


def test_answers_that_differ_little_are_told_by_what_differs_most() -> None:
    known = np.array([*TABLE_1.values(), 0.0, 0.0])
    near = known * np.array([1.02, 1.0, 1.0, 1.05, 1.0, 1.01, 1.0, 1.0])
    sentence = ambiguity(known, near)
    assert f"b1 = {near[3]:.4g} instead of {known[3]:.4g}." in sentence
    assert "u0 =" not in sentence
    assert "differ in the effects alone" in ambiguity(known, known.copy())


def test_a_coefficient_at_the_edge_of_the_possible_is_told() -> None:
    stiff = (-0.63084, -60.0, -600.0, 0.41385, -300.0, 2.5)  # pitch damped beyond any hull
    result = identify([fly(Dive(vehicle=stiff, step=0.02, duration=40.0))[0]], default_vehicle())
    (note,) = [note for note in result.notes if note.startswith("At the edge")]
    assert "a2" in note
    assert not any(
        note.startswith("At the edge") for note in identify([fly(Dive())[0]], default_vehicle()).notes
    )


def test_what_a_recording_without_motion_leaves_open_is_said() -> None:
    known = np.array([-1.0, -2.0, -3.0, 0.5, -1.5, 1.5, 0.0, 0.0])
    stds = 0.01 * np.abs(known)
    assert left_open(known, stds) == ""
    stds[0] = 0.6
    assert "leaves a1 open" in left_open(known, stds)
    assert "plane steps of 1 to 8 s" in left_open(known, stds)
    stds[5] = 1.0
    assert "leaves a1, u0 open" in left_open(known, stds)
