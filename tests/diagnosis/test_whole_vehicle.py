"""What every vehicle has acts on one that shows some of it, whether it is named or not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.catalogue import FAINT, ORDINARY, structure_of
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search.search import Search
from host.diagnosis.search.whole_vehicle import (
    beside_all,
    in_the_valley_of,
    is_real,
    whole,
    widened,
    with_all_ordinary,
)
from host.identification.uncertainty import covariance
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error
from host.likelihood.valleys import with_poles_swapped
from host.recordings.recording import Array, Recording

FEW = ("heave_pitch_rate_coupling", "munk_moment")
TURNED = {"c_wq": 0.8, "c_qw": 1.0}
SLOW = 1.0  # s, of the sensor of pitch


def real_hull(_: float, x: Array, __: float) -> tuple[float, float, float]:
    """Coupling, Munk moment and drag in pitch."""
    w, q, *_ = x
    return TURNED["c_wq"] * q, TURNED["c_qw"] * w - 3.0 * q * abs(q), 0.0


@cache
def recording() -> Recording:
    return hidden_dive(real_hull, duration=60.0)


@cache
def few() -> tuple[Fitter, Explanation]:
    """The recording with two of the three."""
    fitter = Fitter([recording()])
    best = fitter.base
    for name in FEW:
        best = fitter.grown(best, name, [])
    return fitter, fitter.polished(best)


def value(explanation: Explanation, name: str) -> float:
    return float(explanation.fit.parameters[explanation.fit.structure.names.index(name)])


def deviations_of(explanation: Explanation) -> dict[str, float]:
    spread = np.sqrt(np.diag(covariance(explanation.fit))).tolist()
    return dict(zip(explanation.fit.structure.names, spread, strict=True))


def test_a_vehicle_that_shows_two_of_them_is_real() -> None:
    assert is_real(frozenset(FEW))
    assert not is_real(frozenset({*FEW[:1], "pitch_sensor_lag"}))


def test_what_pays_beside_the_others_is_named_and_what_does_not_is_not() -> None:
    fitter, best = few()
    search = Search(fitter, Workers(fitter, 1), lambda _: None, fitter.base, fitter.root)
    found = whole(search, search.remember(best))
    assert found.names == {*FEW, "pitch_quadratic_damping"}
    assert found.bic < best.bic
    assert whole(search, found).names == found.names


def test_a_set_that_is_nobody_s_vehicle_is_left_alone() -> None:
    fitter = Fitter([hidden_dive(duration=30.0)])
    search = Search(fitter, Workers(fitter, 1), lambda _: None, fitter.base, fitter.root)
    assert whole(search, search.base) is search.base
    one = search.remember(fitter.grown(fitter.base, "pitch_sensor_lag", []))
    assert whole(search, one) is one


def test_what_is_not_named_bends_the_rest_and_the_intervals_tell() -> None:
    fitter, best = few()
    all_of_it = with_all_ordinary(fitter, best)
    assert all_of_it.names == {*FEW, *ORDINARY, *FAINT}
    std = deviations_of(best)
    wider = widened(std, best, all_of_it)
    truth = BASE | TURNED
    off = {name: abs(value(best, name) - true) / 1.96 for name, true in truth.items()}
    assert any(off[name] > std[name] for name in truth)
    assert all(off[name] < wider[name] for name in truth)
    assert all(wider[name] >= std[name] for name in std)
    assert wider["heave_offset"] == std["heave_offset"] == 0.0  # that is held


def test_what_is_named_as_it_is_stays_as_well_known_as_it_was() -> None:
    fitter, best = few()
    all_of_it = with_all_ordinary(fitter, best)
    std = deviations_of(all_of_it)
    wider = widened(std, all_of_it, all_of_it)
    free = [
        n for n, is_free in zip(all_of_it.fit.structure.names, all_of_it.fit.free, strict=True) if is_free
    ]
    assert [wider[name] for name in free] == pytest.approx([std[name] for name in free], rel=1e-6)


def test_a_moment_is_as_well_known_as_it_was() -> None:
    fitter, best = few()
    lost = fitter.grown(best, "rudder_effectiveness_change", [np.array([0.0, 30.0])])
    std = deviations_of(lost) | {"effectiveness_time": 0.1}
    all_of_it = with_all_ordinary(fitter, lost)
    shift = value(lost, "effectiveness_time") - value(all_of_it, "effectiveness_time")
    assert widened(std, lost, all_of_it)["effectiveness_time"] == pytest.approx(np.hypot(0.1, shift))


def test_what_the_recordings_tell_nothing_of_lies_between_its_bounds() -> None:
    fitter, best = few()
    all_of_it = with_all_ordinary(fitter, best)
    structure, information = all_of_it.fit.structure, all_of_it.fit.information.copy()
    k = structure.names.index("c_wq")
    information[k] = information[:, k] = 0.0
    information[k, k] = 1e-30
    blind = replace(all_of_it, fit=replace(all_of_it.fit, information=information))
    bounds = structure.parameters[k]
    most = (bounds.upper - bounds.lower) / np.sqrt(12.0)
    assert widened(deviations_of(best), best, blind)["c_wq"] == pytest.approx(most)


def point_of(explanation: Explanation) -> Point:
    fit = explanation.fit
    return Point(fit.structure, fit.parameters, fit.initial, fit.noise)


def slow_sensor() -> tuple[Fitter, Point]:
    """The hull with a slow sensor of pitch, and the truth."""
    rows = recording()
    pitch, last = np.empty(rows.pitch.size), 0.0
    for k, angle in enumerate(rows.pitch):
        last += (angle - last) * (1.0 - np.exp(-rows.step / SLOW))
        pitch[k] = last
    noise = np.deg2rad(0.05) * np.random.default_rng(1).standard_normal(pitch.size)
    fitter = Fitter([replace(rows, pitch=pitch + noise)])
    structure = structure_of((*FEW, "pitch_sensor_lag"))
    known = {**BASE, **TURNED, "heave_offset": 0.0, "pitch_offset": 0.0, "pitch_lag_time": SLOW}
    fit = fitter.base.fit
    return fitter, Point(
        structure, np.array([known[name] for name in structure.names]), fit.initial, fit.levels
    )


def test_the_whole_is_found_from_the_other_valley() -> None:
    fitter, true = slow_sensor()
    names = frozenset((*FEW, "pitch_sensor_lag"))
    right = fitter.explained(names, fitter.carried_on(true))
    swapped = with_poles_swapped(point_of(right))[0]
    wrong = fitter.explained(names, output_error(swapped, fitter.inputs(names), fitter.free(names), 0))
    assert abs(value(wrong, "pitch_lag_time") - SLOW) > 0.3
    all_of_it, theirs = with_all_ordinary(fitter, wrong), with_all_ordinary(fitter, right)
    lag = value(theirs, "pitch_lag_time")
    assert all_of_it.fit.log_likelihood == pytest.approx(theirs.fit.log_likelihood, abs=0.5)
    assert value(all_of_it, "pitch_lag_time") == pytest.approx(lag, abs=0.02)
    likelier = replace(wrong, fit=replace(wrong.fit, log_likelihood=right.fit.log_likelihood + 1.0))
    there = in_the_valley_of(fitter, all_of_it, likelier)
    assert value(there, "pitch_lag_time") == pytest.approx(value(right, "pitch_lag_time"), abs=0.02)
    by_far = replace(wrong, fit=replace(wrong.fit, log_likelihood=all_of_it.fit.log_likelihood))
    assert in_the_valley_of(fitter, all_of_it, by_far) is by_far
    assert in_the_valley_of(fitter, all_of_it, right) is right


def test_what_is_not_named_is_told_by_all_of_it_together() -> None:
    fitter, best = few()
    assert beside_all(fitter, best) is not None  # two of them are named
    one = fitter.polished(fitter.grown(fitter.base, "munk_moment", []))
    assert beside_all(fitter, one) is not None  # the others show
    textbook = Fitter([hidden_dive(lambda _, x, __: (0.0, 1.0 * x[0], 0.0), duration=60.0)])
    alone = textbook.polished(textbook.grown(textbook.base, "munk_moment", []))
    assert beside_all(textbook, alone) is None
    assert beside_all(textbook, textbook.base) is None
