"""With what a diagnosis begins where a similar vehicle is known."""

from types import SimpleNamespace
from typing import Any

import pytest

from host.diagnosis.explain import _alike
from host.diagnosis.margins import LARGEST_SET, LITTLE

MANY = frozenset(f"effect {number}" for number in range(LARGEST_SET + 1))


def explanation(names: frozenset[str], has_process_noise: bool = False) -> Any:
    return SimpleNamespace(names=names, fit=SimpleNamespace(has_process_noise=has_process_noise))


def fitter_that_leaves(excess: float) -> Any:
    return SimpleNamespace(refitted=lambda one: one, excess=lambda _: excess)


def test_a_set_of_many_effects_that_leaves_little_is_begun_with() -> None:
    like = explanation(MANY)
    assert _alike(fitter_that_leaves(LITTLE - 0.1), like) == [like]


@pytest.mark.parametrize(
    ("like", "excess"),
    [
        (None, 1.0),
        (explanation(MANY), LITTLE + 0.1),  # the vehicles differ by more than a member
        (explanation(frozenset({"actuator_lag"})), 1.0),  # searched for as quickly
        (explanation(MANY, has_process_noise=True), 1.0),  # a simulation has no sea
    ],
    ids=["unknown", "far", "few", "in a sea"],
)
def test_else_the_search_begins_anew(like: Any, excess: float) -> None:
    assert _alike(fitter_that_leaves(excess), like) == []
