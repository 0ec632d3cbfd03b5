"""A search that is to end early, and what it then says."""

from contextlib import suppress
from math import inf
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.diagnose import CUT_SHORT, _on_all, diagnose
from host.diagnosis.fits.patience import is_over, patience, was_cut
from host.diagnosis.search.outset import goes_on_from
from tools.commands.diagnose import _seconds


@pytest.mark.parametrize(
    ("duration", "minutes", "limit"),
    [(60.0, None, 240.0), (1100.0, None, 480.0), (60.0, 0.5, 30.0), (60.0, 0.0, inf)],
)
def test_long_recordings_have_longer_and_none_is_no_limit(
    duration: float, minutes: float | None, limit: float
) -> None:
    rows: Any = SimpleNamespace(time=np.arange(0.0, duration, 0.1))
    assert _seconds([rows], minutes) == limit


def test_there_is_no_limit_unless_one_is_set() -> None:
    assert not is_over()
    with patience(3600.0):
        assert not is_over()
    with patience(0.0):
        assert is_over()
    assert not was_cut()


def test_a_limit_within_a_limit_leaves_the_outer_one_as_it_was() -> None:
    with patience(3600.0):
        with patience(0.0):
            assert is_over()
        assert not is_over()


def test_a_search_is_cut_only_where_something_was_to_be_asked_later() -> None:
    with patience(0.0):
        assert not was_cut()
        assert is_over()
        assert was_cut()


def test_a_search_without_time_answers_with_what_one_effect_tells_and_says_so() -> None:
    with patience(0.0):
        found = diagnose([hidden_dive(lambda _, x, __: (0.8 * x[1], 0.0, 0.0), seed=1)])
    assert found.verdict == "explained"  # one effect leaves nothing
    assert CUT_SHORT in found.remaining
    assert [effect.name for effect in found.effects] == ["heave_pitch_rate_coupling"]


@pytest.mark.parametrize("limit", [0.0, 3600.0])
def test_nothing_more_joins_once_the_time_is_over(limit: float) -> None:
    best: Any = SimpleNamespace(fit=None, names=frozenset({"munk_moment"}))
    asked: list[str] = []
    search: Any = SimpleNamespace(
        fitter=SimpleNamespace(excess=lambda _: 9.0),
        on_progress=lambda _: None,
        joint=set(),
        remember=lambda one: one,
        gains=lambda _: asked.append("gains"),
        workers=SimpleNamespace(results=list),
    )
    found: list[bool] = []
    with patience(limit), suppress(AttributeError):  # it goes on, and the stub has no more
        found.append(goes_on_from(search, best))
    assert found == [True] * (limit == 0.0)
    assert asked == ["gains"] * (limit > 0.0)


@pytest.mark.parametrize(
    ("effects", "limit", "verdict"),
    [
        (4, 0.0, "explained"),
        (5, 0.0, "partly_explained"),
        (5, 3600.0, "explained"),
    ],
)
def test_many_effects_are_no_whole_answer_before_all_was_asked(
    effects: int, limit: float, verdict: str
) -> None:
    judged: Any = SimpleNamespace(verdict="explained", effects=["..."] * effects)
    way: Any = SimpleNamespace(apart=(), is_astray=False)
    with patience(limit):
        is_over()
        assert _on_all(judged, way) == verdict
