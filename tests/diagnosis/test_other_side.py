"""A recording told in the words of another side, a model or a simulator."""

import pytest
from hidden_dive import BASE, hidden_dive

from host.diagnosis.against.comparison import compare
from host.diagnosis.against.other_side import Side, in_words_of, side_of
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter

OFFSETS = {"heave_offset": 0.0, "pitch_offset": 0.0}


def side(**effects: float) -> Side:
    """The plant of the dives with these coefficients of effects, all exactly known."""
    names = {"c_wq": "heave_pitch_rate_coupling", "c_ww": "heave_quadratic_drag"}
    values = {name: (value, 0.0) for name, value in (BASE | OFFSETS | effects).items()}
    return Side(names=frozenset(names[name] for name in effects), values=values)


@pytest.fixture(scope="module")
def fitter() -> Fitter:
    return Fitter([hidden_dive(lambda _, x, __: (0.8 * x[1], 0.0, 0.0), seed=1)])


@pytest.fixture(scope="module")
def mistaken(fitter: Fitter) -> Explanation:
    """A set that does the work of the coupling, as far as it can."""
    explanation = fitter.base
    for name in ("munk_moment", "actuator_lag", "depth_sensor_lever_arm"):
        explanation = fitter.polished(fitter.grown(explanation, name, []))
    return explanation


def test_where_the_other_side_as_it_stands_meets_the_recording_nothing_differs(
    fitter: Fitter, mistaken: Explanation
) -> None:
    found = compare(fitter, mistaken, side(c_wq=0.8))
    assert found.is_equal
    (same,) = found.effects
    assert (same.name, same.status) == ("heave_pitch_rate_coupling", "same")


def test_a_side_that_is_off_by_more_than_our_own_freedom_differs(fitter: Fitter) -> None:
    own = fitter.polished(fitter.grown(fitter.base, "heave_pitch_rate_coupling", []))
    assert not compare(fitter, own, side()).is_equal
    assert not compare(fitter, own, side(c_wq=1.2)).is_equal


def test_of_what_nothing_is_known_on_the_other_side_there_is_no_difference(fitter: Fitter) -> None:
    own = fitter.polished(fitter.grown(fitter.base, "heave_pitch_rate_coupling", []))
    assert [effect.status for effect in compare(fitter, own, side()).effects] == ["missing"]
    assert not compare(fitter, own, side(), untold=own.names).effects


def test_ours_give_way_to_what_does_their_work(fitter: Fitter, mistaken: Explanation) -> None:
    told = in_words_of(fitter, mistaken, side(c_wq=1.2))
    assert told.names == {"heave_pitch_rate_coupling"}
    value, std = side_of(told).values["c_wq"]
    assert value == pytest.approx(0.8, abs=4.0 * std)


def test_what_the_other_side_lacks_stays_beside_its_own_effects(fitter: Fitter) -> None:
    own = fitter.polished(fitter.grown(fitter.base, "heave_pitch_rate_coupling", []))
    told = in_words_of(fitter, own, side(c_ww=-2.0))
    assert told.names == {"heave_pitch_rate_coupling", "heave_quadratic_drag"}
