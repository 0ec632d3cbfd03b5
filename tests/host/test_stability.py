"""Whether a hull holds a straight run by itself, against the roots that are known."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from host.identification.stability import is_stable

HULL = {"a1": -1.0, "a2": -2.0, "a3": -0.5}


def fit(**values: float) -> Any:
    known = HULL | values
    structure = SimpleNamespace(names=tuple(known))
    return SimpleNamespace(structure=structure, parameters=np.array([*known.values()]))


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({}, True),
        ({"a3": 0.1}, False),  # what rights the hull turns it over
        ({"c_qw": 1.5, "c_wq": 1.0}, True),  # a1 a2 - a3 > c_qw c_wq
        ({"c_qw": 6.0, "c_wq": 1.0}, False),
        ({"c_qw": 6.0}, True),  # heave turns the hull, and nothing comes back
    ],
)
def test_a_hull_is_stable_where_all_its_poles_damp(values: dict[str, float], expected: bool) -> None:
    assert is_stable(fit(**values)) is expected
