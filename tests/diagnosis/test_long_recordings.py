"""A long recording is searched in an excerpt, then judged as a whole."""

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.diagnose import diagnose
from host.diagnosis.recordings import spans
from host.recordings.recording import Array


def _coupled(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    # A coupling throughout, and 1 cm/s^2 of weight taken on late: most of an excerpt does not see it.
    return 0.8 * x[1] + 0.01 * (time > 170.0), 0.0, 0.0


def test_what_is_short_is_its_own_excerpt() -> None:
    teaching = spans.divide([hidden_dive()]).teaching
    assert spans.excerpt(teaching) is teaching


def test_an_excerpt_is_of_the_pieces_where_the_plane_moves_most(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spans, "LONG", 1500)
    monkeypatch.setattr(spans, "EXCERPT", 600)
    monkeypatch.setattr(spans, "PIECE", 300)
    first, second = hidden_dive(duration=90.0), hidden_dive(duration=90.0, seed=1)
    first.rudder[:550] = 0.0
    second.rudder[310:] *= 0.1
    pieces = spans.excerpt([first, second])
    assert [piece.time.size for piece in pieces] == [300, 300]
    assert [piece.time[0] for piece in pieces] == pytest.approx([60.0, 0.0], abs=0.2)  # as in the recordings
    at = np.searchsorted(first.time, pieces[0].time)
    np.testing.assert_array_equal(pieces[0].depth, first.depth[at])


def test_what_leads_is_a_shorter_one_of_what_is_half_as_long_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spans, "LED", 600)
    monkeypatch.setattr(spans, "LED_PIECE", 300)
    dive = hidden_dive(duration=91.0)
    dive.rudder[:300] *= 0.1
    short = [dive.between(0.0, 89.95)]
    assert spans.led_excerpt(short) is short
    assert [piece.time[0] for piece in spans.led_excerpt([dive])] == pytest.approx([30.3, 60.7], abs=0.2)


def test_what_is_not_measured_comes_last(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spans, "LONG", 500)
    monkeypatch.setattr(spans, "EXCERPT", 300)
    monkeypatch.setattr(spans, "PIECE", 300)
    dive = hidden_dive(duration=90.0)
    dive.rudder[300:] *= 0.1
    dive.depth[:300] = np.nan
    (piece,) = spans.excerpt([dive])
    assert piece.time[0] >= 30.0 - 1e-6


def test_what_teaches_begins_where_something_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spans, "LONG", 500)
    monkeypatch.setattr(spans, "EXCERPT", 400)
    monkeypatch.setattr(spans, "PIECE", 300)
    dive = hidden_dive(duration=90.0)
    dive.depth[:340], dive.pitch[:360] = np.nan, np.nan
    first, second = spans.excerpt([dive])
    assert [first.time[0], second.time[0]] == pytest.approx([34.0, 60.0], abs=0.2)
    assert np.isfinite(first.depth[0])


def test_a_run_that_begins_while_another_judges_begins_after(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spans, "LONGEST_RUN", 30.0)  # s, of 90: the first span judges from 22.5 to 31.5 s
    dive = hidden_dive(duration=90.0)
    divided = spans.divide([dive])
    assert [run.time[0] for run in divided.teaching] == pytest.approx([0.0, 31.5, 60.0], abs=0.2)
    for run, unseen in zip(divided.teaching, divided.unseen, strict=True):
        np.testing.assert_array_equal(unseen.time, run.time)
        assert np.isfinite(run.depth[0])
        assert not (np.isfinite(run.depth) & np.isfinite(unseen.depth)).any()


@pytest.mark.long
def test_a_long_recording_is_diagnosed_from_its_excerpt(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spans, "LONG", 1500)
    monkeypatch.setattr(spans, "EXCERPT", 800)
    monkeypatch.setattr(spans, "PIECE", 400)
    said: list[str] = []
    found = diagnose([hidden_dive(_coupled, duration=240.0)], said.append)
    assert said.index("an excerpt") < said.index("the whole")
    assert found.verdict == "explained"
    effects = {effect.name: effect.coefficients for effect in found.effects}
    assert effects.keys() == {"heave_pitch_rate_coupling", "ballast_change"}
    value, std, _ = effects["heave_pitch_rate_coupling"]["c_wq"]
    assert abs(value - 0.8) < 4.0 * std
    assert found.ranking[0][1] > 0.0
