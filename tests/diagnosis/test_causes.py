"""What makes coefficients differ together: the masses of a vehicle, its plane, what rights it."""

from itertools import combinations

import numpy as np
import pytest

from host.diagnosis.against.causes import CAUSES, Value, causes
from host.diagnosis.against.comparison import Comparison, ParameterDifference, as_json, sentences

VEHICLE = {"a1": -0.6, "a2": -1.5, "a3": -0.3, "b1": 0.4, "b2": -2.0}
ALONE = [name for name in CAUSES if name not in ("heave_damping", "pitch_damping")]


def pairs(std: float = 0.02, **factors: float) -> dict[str, tuple[Value, Value]]:
    """The vehicle, and as it would be with these causes so many times as large."""
    found = {}
    for name, value in VEHICLE.items():
        other = value * np.prod([factor ** CAUSES[cause].get(name, 0) for cause, factor in factors.items()])
        found[name] = ((value, std * abs(value)), (float(other), 0.0))
    return found


@pytest.mark.parametrize("name", CAUSES)
@pytest.mark.parametrize("factor", [0.6, 1.5])
def test_one_cause_is_found_by_what_it_does(name: str, factor: float) -> None:
    (found,) = causes(pairs(**{name: factor}))
    assert found.name == name
    assert found.ratio == pytest.approx(factor)
    assert 0.0 < found.std < 0.05 * factor


@pytest.mark.parametrize("names", list(combinations(ALONE, 2)))
def test_two_causes_are_found(names: tuple[str, str]) -> None:
    found = causes(pairs(**{names[0]: 0.7, names[1]: 1.6}))
    assert {one.name: pytest.approx(one.ratio) for one in found} == {names[0]: 0.7, names[1]: 1.6}


def test_what_is_no_larger_than_its_deviation_is_no_cause() -> None:
    assert causes(pairs(std=0.2, righting_moment=1.4)) == []
    assert causes(pairs()) == []


def test_a_coefficient_of_no_size_or_another_sign_says_nothing() -> None:
    known = pairs(pitch_inertia=0.5)
    known["a3"] = ((-0.3, 0.2), (-0.31, 0.2))
    known["b1"] = ((0.4, 0.01), (-0.4, 0.01))
    (found,) = causes(known)
    assert (found.name, found.ratio) == ("pitch_inertia", pytest.approx(0.5))
    assert causes({"a3": known["a3"]}) == []


def test_of_two_that_do_as_well_neither_is_told() -> None:
    stiff = pairs(righting_moment=0.5)
    assert causes({"a3": stiff["a3"]}) == []  # the inertia would do as well
    (told,) = causes({name: stiff[name] for name in ("a3", "b2")})
    assert told.name == "righting_moment"


def compared(*different: str, **factors: float) -> Comparison:
    parameters = [
        ParameterDifference(name=name, recorded=here, given=there, is_different=name in different)
        for name, (here, there) in (pairs(**factors) | {"u0": ((2.0, 0.0), (2.0, 0.0))}).items()
    ]
    return Comparison(effects=[], parameters=parameters)


def test_a_comparison_tells_the_cause_beside_the_coefficients() -> None:
    found = compared("a3", righting_moment=0.5)
    assert sentences(found, "simulation")[1:] == [
        "That is as if the simulation had 0.5 +- 0.018 times the righting moment that the recording shows."
    ]
    (cause,) = as_json(found, "simulation")["causes"]
    assert (cause["name"], cause["ratio"]) == ("righting_moment", pytest.approx(0.5))


def test_where_nothing_differs_or_the_speed_does_no_cause_is_told() -> None:
    assert not compared(righting_moment=0.5).causes
    assert not compared("a3", "u0", righting_moment=0.5).causes
    assert not compared("a1", righting_moment=0.5).causes
