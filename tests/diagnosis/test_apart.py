"""Stretches of a dive in which other physics acts, and is gone again."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hidden_dive import Extra, hidden_dive, nothing

from host.catalogue import structure_of
from host.diagnosis import plane_choice
from host.diagnosis.diagnose import _apart, _on_all
from host.diagnosis.fits.patience import patience
from host.diagnosis.judge import Judged
from host.diagnosis.plane_choice import Way, likelier_first
from host.diagnosis.proof.scoring import Misfit
from host.diagnosis.proof.verdict import Verdict
from host.diagnosis.search import apart
from host.diagnosis.search import short_runs as pieces
from host.diagnosis.search.apart import stretches_apart
from host.diagnosis.search.short_runs import short_runs
from host.recordings.left_out import Span
from host.recordings.recording import Array, Recording

BEGINS, ENDS = 100.0, 140.0  # s


def turning(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    is_turning = BEGINS < time < ENDS
    return 0.2 * is_turning, (0.5 + 2.0 * x[0]) * is_turning, 0.0


def lightened(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return -0.2 * (time > 2.0 * BEGINS), 0.0, 0.0


def everywhere(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return 0.0, 1.5 * np.sin(time), 0.0


def turning_often(time: float, x: Array, plane: float) -> tuple[float, float, float]:
    """Every 100 s; and always something slight that nothing explains."""
    is_turning = 85.0 < time % 100.0 < 97.0
    moment = (0.8 + 3.0 * x[0]) * is_turning + 0.01 * np.sin(1.3 * time)
    return 0.3 * is_turning * (1.0 + 5.0 * plane), moment, 0.0


def spans_of(recordings: list[Recording]) -> list[Span]:
    short = short_runs(recordings)
    return [] if short is None else stretches_apart(short).spans


@pytest.mark.parametrize(
    ("extra", "is_apart"),
    [
        pytest.param(turning, True, marks=pytest.mark.long),
        pytest.param(lightened, False, marks=pytest.mark.long),
        pytest.param(everywhere, False, marks=pytest.mark.long),
        (nothing, False),
    ],
)
def test_a_turn_is_apart_and_what_stays_is_not(extra: Extra, is_apart: bool) -> None:
    spans = spans_of([hidden_dive(extra, duration=250.0)])
    assert bool(spans) == is_apart
    if is_apart:
        ((start, end),) = spans
        assert BEGINS - pieces.PIECE < start < BEGINS + 2.0
        assert ENDS - 2.0 < end < ENDS + 1.5 * pieces.PIECE


@pytest.mark.long
def test_a_sensor_that_was_silent_for_a_while_is_no_stretch_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "_with_an_effect", lambda *_: None)
    dive = hidden_dive(turning, duration=250.0)
    dive.pitch[300:600], dive.depth[:20] = np.nan, np.nan
    ((start, end),) = spans_of([dive])
    assert BEGINS - pieces.PIECE < start < end < ENDS + 1.5 * pieces.PIECE


@pytest.mark.long
def test_what_an_effect_would_explain_is_not_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    short = short_runs([hidden_dive(turning, duration=250.0)])
    assert short is not None
    monkeypatch.setattr(apart, "_with_an_effect", lambda *_: short.whole)
    assert stretches_apart(short) == ([], short.whole)
    monkeypatch.setattr(apart, "form_gains", lambda *_: {"unknown_force_w_w": np.inf})
    assert stretches_apart(short) == ([], None)
    # Of what goes with the depth the catalogue may hold an effect, which is asked first.
    layered = {"unknown_force_w_w": 0.0, "unknown_force_in_layers": np.inf}
    monkeypatch.setattr(apart, "form_gains", lambda *_: layered)
    assert stretches_apart(short) == ([], short.whole)
    monkeypatch.setattr(apart, "_with_an_effect", lambda *_: None)
    assert stretches_apart(short) == ([], None)


@pytest.mark.long
def test_what_most_pieces_tell_is_found_though_the_others_bend_all() -> None:
    short = short_runs([hidden_dive(turning_often, duration=306.0)])
    assert short is not None
    taught = apart._as_most_tell(short.fitter, short.whole, 1)
    assert taught is not None
    left_out = {round(p.time[0]) for p in short.pieces} - {round(p.time[0]) for p in taught.pieces}
    assert left_out == {77, 179, 281}


@pytest.mark.long
def test_little_that_is_left_is_no_turn_and_what_runs_away_explains_no_piece(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    short = short_runs([hidden_dive(duration=250.0)])
    assert short is not None
    assert apart._as_most_tell(short.fitter, short.whole, 1) is None
    whole = short.whole
    moved = whole.fit.parameters.copy()
    moved[whole.fit.structure.names.index("a2")] = 30.0  # a hull that drives its own pitch
    away = replace(whole, fit=replace(whole.fit, parameters=moved))
    assert np.isinf(apart._left_by(short.pieces, away)).all()
    # So does a hull that hardly heaves, as what each piece begins with does for whatever pushes it.
    idle = whole.fit.parameters.copy()
    idle[whole.fit.structure.names.index("a1")] = -0.001
    still = replace(whole, fit=replace(whole.fit, parameters=idle))
    monkeypatch.setattr(apart, "best_of_all", lambda *_: still)
    monkeypatch.setattr(apart, "BENT", 0.0)
    assert np.isinf(apart._of_some(short.fitter, np.arange(6), whole)[1]).all()
    monkeypatch.setattr(apart, "_taught_by", lambda *_: pytest.fail("nothing is taught by such a hull"))
    assert apart._as_most_tell(short.fitter, short.whole, 1) is None


def test_no_more_pieces_are_drawn_once_the_search_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Any] = []
    monkeypatch.setattr(apart, "_of_some", lambda *given: drawn.append(given))
    fitter: Any = SimpleNamespace(recordings=[None] * 12, excess=lambda _: 2.0 * apart.BENT)
    whole: Any = SimpleNamespace(fit=None)
    with patience(0.0):
        assert apart._as_most_tell(fitter, whole, 1) is None
    assert len(drawn) == 1


def test_short_recordings_several_and_alarms_are_taken_whole() -> None:
    dive = hidden_dive(turning, duration=250.0)
    assert spans_of([dive.between(0.0, 150.0)]) == []
    assert spans_of([dive, replace(dive, name="other.csv")]) == []
    assert spans_of([replace(dive, alarms=(BEGINS,))]) == []


@pytest.mark.long
def test_of_a_long_recording_some_pieces_teach_and_all_are_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    dive = hidden_dive(turning, duration=500.0)
    taught: list[int] = []
    fitted = pieces.best_of_all
    monkeypatch.setattr(apart, "_with_an_effect", lambda *_: None)
    monkeypatch.setattr(pieces, "MOST_ROWS", dive.time.size - 1)
    monkeypatch.setattr(pieces, "SPREAD", dive.time.size // 2)
    monkeypatch.setattr(
        pieces,
        "best_of_all",
        lambda fitter, like=None: taught.append(len(fitter.recordings)) or fitted(fitter, like),
    )
    ((start, end),) = spans_of([dive])
    assert taught[0] == 10
    assert BEGINS - pieces.PIECE < start < BEGINS + 2.0
    assert ENDS - 2.0 < end < ENDS + 1.5 * pieces.PIECE


@pytest.mark.parametrize(
    ("spans", "is_for_good"),
    [
        ([(25.0, 75.0), (225.0, 250.0)], False),
        ([(25.0, 50.0), (225.0, 250.0)], False),
        ([(0.0, 25.0), (225.0, 250.0)], False),
        ([(0.0, 25.0), (200.0, 250.0)], True),
        ([(0.0, 75.0)], True),
        ([(0.0, 75.0), (100.0, 125.0)], True),
        ([(225.0, 250.0)], True),
        ([(200.0, 225.0)], False),
    ],
)
def test_what_lasts_until_the_end_or_from_the_start_is_for_good_unless_something_else_did(
    spans: list[tuple[float, float]], is_for_good: bool
) -> None:
    assert apart._is_for_good(spans, [hidden_dive(duration=250.0)]) == is_for_good


@pytest.mark.long
def test_a_turn_at_the_end_is_apart_if_there_was_one_before() -> None:
    def often(time: float, x: Array, plane: float) -> tuple[float, float, float]:
        return turning(100.0 + time % 150.0 - 75.0, x, plane)

    def at_last(time: float, x: Array, plane: float) -> tuple[float, float, float]:
        return turning(100.0 + time - 225.0, x, plane)

    _, (start, end) = spans_of([hidden_dive(often, seed=4, duration=250.0)])
    assert 225.0 - pieces.PIECE < start < 230.0
    assert end == pytest.approx(250.0)
    assert spans_of([hidden_dive(at_last, seed=4, duration=250.0)]) == []


def test_what_is_apart_is_left_out_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    dive = hidden_dive(duration=250.0)
    fitter: Any = SimpleNamespace(root=SimpleNamespace(bic=0.0), excess=lambda _: 9.0, at_first={})
    whole: Any = SimpleNamespace(bic=0.0, fit=None, names=structure_of(()).effect_names, leaves_white=False)
    rest: list[Any] = []

    def begun(recordings: Any) -> list[Way]:
        rest.append(recordings)
        return [Way(recordings, fitter)]

    monkeypatch.setattr(plane_choice, "ways", begun)
    monkeypatch.setattr(plane_choice, "one_that_says_all", lambda *_: None)
    monkeypatch.setattr(plane_choice, "one_says_most", lambda *_: False)
    monkeypatch.setattr(plane_choice, "beside_what_leads", lambda _, one, __: one)
    monkeypatch.setattr(plane_choice, "short_runs", lambda *_: rest)
    monkeypatch.setattr(plane_choice, "stretches_apart", lambda *_: apart.Apart([(BEGINS, ENDS)]))
    monkeypatch.setattr(plane_choice, "at_the_outset", lambda _: None if rest else whole)
    monkeypatch.setattr(plane_choice, "plain_waves", lambda _: None)
    monkeypatch.setattr(plane_choice, "_led", lambda *_: [])
    (way,) = likelier_first([Way([dive], cast("Any", fitter))], lambda _: None, 1, may_leave_out=True)
    assert way.apart == ((BEGINS, ENDS),)
    assert [piece.time[[0, -1]].round(1).tolist() for piece in rest[0]] == [[0.0, 99.9], [140.0, 249.9]]
    assert rest[0][0].notes == ("other physics acts, and left out: 100 to 140 s",)
    assert "From 100 to 140 s other physics acts" in _apart(way)
    assert _apart(Way([dive], cast("Any", fitter))) == ""
    misfit = Misfit(depth_rmse_m=1.0, pitch_rmse_rad=1.0, chi2_depth=1.0, chi2_pitch=1.0)

    def judged(verdict: Verdict) -> Judged:
        return Judged(misfit, misfit, [], frozenset(), verdict, {})

    assert _on_all(judged("explained"), way) == "partly_explained"
    assert _on_all(judged("no_mismatch"), way) == "partly_explained"
    assert _on_all(judged("explained"), way._replace(apart=(), is_astray=True)) == "partly_explained"
    assert _on_all(judged("unexplained"), way) == "unexplained"
    assert _on_all(judged("explained"), Way([dive], cast("Any", fitter))) == "explained"
