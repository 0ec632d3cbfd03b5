"""The manoeuvre that tells an effect from its twin."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.diagnose import Diagnosis
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.manoeuvres import LONGEST, SHORTEST, library
from host.diagnosis.separation import SEPARATES, _Flight, separations


def with_twin(found: Diagnosis, twin: str) -> Diagnosis:
    return replace(found, effects=[replace(found.effects[0], twins=[twin])])


def test_manoeuvres_stay_within_the_recorded_angles(coupled: Diagnosis) -> None:
    flown = library(coupled.recordings, coupled.extended.fit.parameters)
    (recording,) = coupled.recordings
    centre = np.median(recording.rudder)
    assert len({one.name for one in flown}) == len(flown) >= 7
    for one in flown:
        assert SHORTEST <= one.duration <= LONGEST
        assert np.abs(one.rudder - centre).max() <= np.abs(recording.rudder - centre).max() + 1e-12
    still = [one.name for one in flown if np.ptp(one.rudder) == 0.0]
    assert still == ["level run"]


def test_a_plane_that_never_moved_gives_no_manoeuvre(coupled: Diagnosis) -> None:
    still = replace(coupled.recordings[0], rudder=np.zeros(coupled.recordings[0].time.size))
    assert library([still], coupled.extended.fit.parameters) == []


def test_a_model_is_not_told_from_itself(coupled: Diagnosis) -> None:
    for one in library(coupled.recordings, coupled.extended.fit.parameters):
        assert _Flight(coupled, coupled.extended, coupled.extended, one).predicted < 1e-6


def test_exact_twins_are_separated_by_no_manoeuvre_but_by_a_measured_speed(coupled: Diagnosis) -> None:
    # With u0 free a lever arm has the very transfer function of the coupling.
    (found,) = separations(with_twin(coupled, "depth_sensor_lever_arm"))
    assert found.manoeuvre is None
    assert found.predicted < 1.0
    assert "no plane movement at this speed" in found.sentence
    assert "with the speed recorded" in found.sentence


def test_the_chosen_manoeuvre_does_in_simulation_what_was_predicted(coupled: Diagnosis) -> None:
    (found,) = separations(with_twin(coupled, "depth_sensor_lag"))
    assert found.manoeuvre is not None
    assert found.predicted >= SEPARATES
    assert found.confirmed == pytest.approx(found.predicted, abs=4.0 * 2.0 * found.predicted**0.5)
    assert found.confirmed > 0.5 * SEPARATES
    assert found.manoeuvre.words in found.sentence
    assert found.difference.shape == (2, found.manoeuvre.rudder.size)


def test_a_manoeuvre_that_fails_in_simulation_is_not_recommended(
    coupled: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown = []

    def in_vain(flight: _Flight) -> float:
        flown.append(flight.manoeuvre.words)
        return -50.0

    monkeypatch.setattr(_Flight, "confirmed", in_vain)
    (found,) = separations(with_twin(coupled, "depth_sensor_lag"))
    assert found.manoeuvre is None
    assert found.confirmed == -50.0
    assert len(flown) == len(set(flown)) == 2
    assert f"{flown[-1]} promises to" in found.sentence
    assert "gave -50 of BIC" in found.sentence


def test_a_manoeuvre_that_turns_the_vehicle_over_once_repeated_is_not_recommended(
    coupled: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def repeated(_: Diagnosis, flight: _Flight, *__: Explanation) -> _Flight:
        asked.append(flight.predicted)
        if len(asked) == 1:
            flight.predicted = float("nan")
        return flight

    monkeypatch.setattr("host.diagnosis.separation._long_enough", repeated)
    (found,) = separations(with_twin(coupled, "depth_sensor_lag"))
    assert len(asked) == 2
    assert found.predicted == asked[1]
    assert "nan" not in found.sentence


def test_an_event_of_the_recording_cannot_be_flown_again(coupled: Diagnosis) -> None:
    (found,) = separations(with_twin(coupled, "ballast_change"))
    assert found.manoeuvre is None
    assert np.isnan(found.predicted)
    assert found.sentence


@pytest.mark.parametrize(
    ("name", "twin", "told"),
    [
        ("ballast_change", "current_change", "another speed"),
        ("rudder_offset_change", "trim_moment_change", "a sensor of the plane's own angle"),
        ("ballast_change", "net_buoyancy", "straight level runs before and after"),
    ],
)
def test_what_came_at_one_moment_is_told_by_another_measurement(
    coupled: Diagnosis, name: str, twin: str, told: str
) -> None:
    fitter = Fitter(coupled.recordings, known=coupled.extended)
    extended = fitter.grown(coupled.extended, name, [])
    named = replace(coupled.effects[0], name=name, twins=[twin])
    (found,) = separations(replace(coupled, extended=extended, effects=[named]))
    assert found.manoeuvre is None
    assert told in found.sentence


def test_a_dive_near_the_surface_is_flown_where_there_is_water(coupled: Diagnosis) -> None:
    dive = hidden_dive(duration=20.0)
    dive.depth[:] -= np.nanmin(dive.depth)
    shallow = replace(coupled, recordings=[dive])
    for one in library([dive], coupled.extended.fit.parameters):
        assert _Flight(shallow, coupled.extended, coupled.extended, one).outputs[1].min() > -1e-6
