"""The sentence about an identified model, and what it is made of."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from host.identification.identify import identify
from host.identification.plots import overview_plot
from host.identification.predict import Prediction, score
from host.identification.report import unit_of
from host.identification.verdict import free_runs, verdict
from host.vehicle import default_vehicle
from tools.accuracy.dive import Case, fly
from tools.accuracy.methods import recording_of


@pytest.fixture(scope="module")
def dive():
    return recording_of(fly(Case(duration=60.0), 1))


@pytest.fixture(scope="module")
def identified(dive):
    return identify([dive], default_vehicle())


def run_that(dive, pitch, depth):
    outputs = np.array([pitch, depth])
    return Prediction(recording=dive, outputs=outputs, score=score(outputs, [dive]))


def held_out(identified, *predictions):
    return verdict(replace(identified, held_out=list(predictions)))


def test_errors_of_several_runs_are_pooled(dive):
    found = free_runs([run_that(dive, dive.pitch + 0.01, dive.depth), run_that(dive, dive.pitch, dive.depth)])
    assert found.fit[0] == pytest.approx(100.0 * (1.0 - 0.01 / np.sqrt(2.0) / np.std(dive.pitch)))
    assert found.fit[1] == 100.0
    assert found.chi2[0] == pytest.approx(0.5e-4 / np.deg2rad(0.1) ** 2, rel=0.3)


def test_a_model_that_meets_what_it_never_saw_is_trusted(identified):
    found = verdict(identified)
    assert found.is_trusted
    assert found.sentence.startswith("All parameters are determined. Running freely over data it never saw")


def test_a_poor_free_run_is_said_to_be_one(identified, dive):
    found = held_out(identified, run_that(dive, 0.3 * dive.pitch, dive.depth))
    assert not found.is_trusted
    assert "does not carry this vehicle" in found.sentence
    assert "70 % of the pitch and 0 % of the depth motion" in found.sentence
    assert "`mils diagnose`" in found.sentence


def test_a_good_fit_far_above_the_noise_is_not_called_complete(identified, dive):
    found = held_out(identified, run_that(dive, dive.pitch, dive.depth + 0.15))
    assert not found.is_trusted
    assert "in depth 1" in found.sentence
    assert "times the sensors' noise" in found.sentence


def test_a_run_that_leaves_the_recording_is_said_to(identified, dive):
    found = held_out(identified, run_that(dive, dive.pitch, np.full_like(dive.depth, np.nan)))
    assert "its depth runs away" in found.sentence


def test_open_parameters_do_not_hide_a_poor_free_run(identified, dive):
    found = verdict(
        replace(identified, undetermined=["b1"], held_out=[run_that(dive, 0.0 * dive.pitch, dive.depth)])
    )
    assert "does not tell b1" in found.sentence
    assert "does not carry" in found.sentence


def test_without_a_stretch_to_run_or_motion_nothing_is_claimed(identified, dive):
    assert "No stretch could be run" in held_out(identified).sentence
    level = replace(dive, pitch=np.full_like(dive.pitch, 0.1), depth=np.full_like(dive.depth, 5.0))
    assert "Nothing moves" in held_out(identified, run_that(level, level.pitch, level.depth)).sentence


def test_an_actuator_without_a_scale_is_no_angle(dive):
    raw = replace(dive, has_angle=False)
    assert unit_of("b1", [dive]) == "m/s^2/rad"
    assert unit_of("b1", [raw]) == "m/s^2/actuator unit"
    assert unit_of("a1", [raw]) == "1/s"
    assert overview_plot(raw) != overview_plot(dive)


@pytest.mark.long
def test_many_short_stretches_are_held_out_too(dive):
    edges = np.arange(0.0, 61.0, 4.0)
    pieces = [dive.between(a, b) for a, b in pairwise(edges)]
    assert max(piece.time.size for piece in pieces) < 50
    found = identify(pieces, default_vehicle())
    assert len(found.held_out) == 4
