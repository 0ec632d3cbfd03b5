"""All that every vehicle has at once: where the search begins with it, and where with single effects."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.catalogue import ALONG_THE_HULL, ORDINARY
from host.diagnosis import outset, plane_choice
from host.diagnosis import search as module
from host.diagnosis.diagnose import diagnose
from host.diagnosis.explanation import Explanation
from host.diagnosis.fitter import Fitter
from host.diagnosis.margins import LITTLE, MUCH
from host.diagnosis.outset import FAR_LESS, LOST, at_the_outset, leads_on
from host.diagnosis.plane_choice import Way, likelier_first
from host.diagnosis.search import Search
from host.read_recordings import read_recordings
from host.recording import Array
from host.vehicle import default_vehicle

SIMULATED = Path(__file__).parent.parent / "data" / "simulators" / "pvs_remus100__3211.csv"
FEW = frozenset({"actuator_lag", "free_trim"})
MANY = frozenset({*ORDINARY})


@pytest.fixture(scope="module")
def real() -> Fitter:
    """A simulator's REMUS 100, of which the base equations leave much."""
    return Fitter(read_recordings(SIMULATED, default_vehicle()))


def ballast(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return (0.15 if time > 30.0 else 0.0), 0.0, 0.0


def swell(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return 0.0, 0.0, 0.3 * np.sin(2.0 * np.pi * time / 20.0)


def test_of_a_real_vehicle_all_that_every_one_has_leaves_nothing(real: Fitter) -> None:
    found = at_the_outset(real)
    assert found is not None
    assert {*ORDINARY} < found.names
    assert real.excess(real.root.fit) > 10.0
    assert real.excess(found.fit) < LITTLE
    assert found.leaves_white


def test_where_something_else_acts_as_well_it_leaves_far_less(
    real: Fitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = at_the_outset(real)
    monkeypatch.setattr(Explanation, "leaves_white", property(lambda _: False))
    found = at_the_outset(real)
    assert told is not None
    assert found is not None
    assert found.names | {ALONG_THE_HULL} == told.names | {ALONG_THE_HULL}
    assert real.excess(found.fit) < FAR_LESS * real.excess(real.root.fit)


def test_a_textbook_vehicle_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    fitter = Fitter([hidden_dive()])
    assert fitter.excess(fitter.root.fit) < MUCH
    monkeypatch.setattr(fitter, "fitted", None)
    assert at_the_outset(fitter) is None


def test_where_it_leads_nowhere_something_may_have_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    fitter = Fitter([hidden_dive(ballast, duration=60.0)])
    assert fitter.excess(fitter.root.fit) > LOST
    found = at_the_outset(fitter)
    assert found is not None
    assert "ballast_change" in found.names
    assert found.leaves_white
    assert leads_on(fitter, found)
    monkeypatch.setattr(outset, "_beside_a_change", lambda fitter, _: fitter.root)
    nowhere = at_the_outset(fitter)
    assert nowhere is not None
    assert not leads_on(fitter, nowhere)


def test_water_that_swings_is_no_change_at_a_moment() -> None:
    fitter = Fitter([hidden_dive(swell, duration=60.0)])
    assert fitter.excess(fitter.root.fit) > LOST
    found = at_the_outset(fitter)
    assert found is not None
    assert not leads_on(fitter, found)


@pytest.mark.parametrize(
    ("pays", "left", "said"),
    [
        (MANY, 1.3, ["concluded"]),  # of white noise, whose size the sensors show too small
        (MANY, 1.1, ["concluded"]),
        (FEW, 1.0, ["singles", "concluded"]),
        (MANY, 1.4, ["singles", "concluded"]),
    ],
    ids=["white", "little", "few", "something left"],
)
def test_a_search_goes_on_with_many_or_begins_with_single_effects(
    pays: frozenset[str], left: float, said: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def found(names: frozenset[str]) -> Any:
        fit, white = SimpleNamespace(left=left), left == 1.3
        return SimpleNamespace(names=names, bic=0.0, fit=fit, leaves_white=white, lean=lambda: found(names))

    calls: list[str] = []
    monkeypatch.setattr(outset, "with_more", lambda _, best, **__: best)
    monkeypatch.setattr(outset, "pruned", lambda *_: found(pays))
    monkeypatch.setattr(module, "beam_search", lambda _: calls.append("singles"))
    monkeypatch.setattr(Search, "_concluded", lambda _: calls.append("concluded"))
    fitter: Any = SimpleNamespace(excess=lambda fit: fit.left)
    root, base = found(frozenset({"free_trim"})), found(frozenset())
    search = Search(fitter, cast("Any", None), lambda _: None, base, root, outset=found(MANY))
    search.run()
    assert calls == said
    assert bool(search.joint) is (said == ["concluded"])


def test_it_tells_which_way_the_plane_went(monkeypatch: pytest.MonkeyPatch) -> None:
    def way(root: float, there: float) -> Way:
        fitter = SimpleNamespace(root=SimpleNamespace(bic=root, fit=2.0 * MUCH), excess=lambda fit: fit)
        fitter.reduced, fitter.polished = lambda *_: SimpleNamespace(bic=there), lambda one: one
        return Way([], cast("Any", fitter))

    def order(*found: Way) -> list[int]:
        told = likelier_first([*found], lambda _: None, 1)
        return [[each.fitter for each in found].index(each.fitter) for each in told]

    whole: Any = SimpleNamespace(bic=-10.0, names=MANY, leaves_white=True, fit=0.1)
    held, moved, worse = way(-2.0, np.nan), way(-1.0, -11.0), way(-1.0, -9.0)
    monkeypatch.setattr(plane_choice, "at_the_outset", lambda *_: whole)
    monkeypatch.setattr(plane_choice, "plain_waves", None)  # nothing is left to see
    assert order(moved, held) == [0, 1]
    assert order(worse, held) == [1, 0]
    assert likelier_first([held], lambda _: None, 1)[0].outset is whole
    whole.leaves_white = False
    waves: Any = SimpleNamespace(bic=-20.0)
    monkeypatch.setattr(plane_choice, "plain_waves", lambda _: waves)
    monkeypatch.setattr(plane_choice, "_in_a_swell", lambda seen, _: seen)
    assert [each.outset for each in likelier_first([moved, held], lambda _: None, 1)] == [None, None]
    monkeypatch.setattr(plane_choice, "plain_waves", lambda _: None)
    monkeypatch.setattr(plane_choice, "_pushed_about", lambda *_: [])
    assert order(moved, held) == [0, 1]
    assert likelier_first([held], lambda _: None, 1)[0].outset is whole
    pushed: Any = SimpleNamespace(bic=-30.0)
    monkeypatch.setattr(plane_choice, "_pushed_about", lambda ways, *_: [ways[0]._replace(pushed=pushed)])
    (first,) = likelier_first([held], lambda _: None, 1)
    assert first.pushed is pushed  # which is asked where something is left
    assert first.outset is whole  # if it is not believed
    monkeypatch.setattr(plane_choice, "at_the_outset", lambda *_: None)
    monkeypatch.setattr(plane_choice, "by_single_effects", lambda found, *_: found[::-1])
    assert order(moved, held) == [1, 0]


def test_a_diagnosis_begins_with_it_and_ranks_what_pays(real: Fitter) -> None:
    said: list[str] = []
    found = diagnose(real.recordings, said.append)
    named = [effect.name for effect in found.effects]
    assert not any(line.startswith("1 effect") for line in said)
    assert found.verdict == "explained"
    assert "heave_pitch_rate_coupling" in named
    assert "munk_moment" not in named  # which this simulator has not
    assert not found.is_ranked_alone
    assert [name for name, _ in found.ranking] == named
