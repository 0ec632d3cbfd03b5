"""From judged recordings to figures, tables and the page."""

import json
from dataclasses import replace
from io import StringIO
from pathlib import Path

import pytest
from hand_made import answer, diagnosis, effect, recorded
from rich.console import Console

from tools.trial.judge import Judged, judge
from tools.trial.page import bar, print_score, write_json, write_page
from tools.trial.score import Rate, Score, score


def five() -> list[Judged]:
    cases = [
        (answer(number=1), diagnosis(effect("trim_moment", c_q0=(0.021, 0.001)))),
        (answer(number=2), diagnosis(effect("net_buoyancy", "trim_moment"), slot="heave")),
        (answer("two", ("trim_moment", "net_buoyancy"), number=3), diagnosis(effect("net_buoyancy"))),
        (answer("none", (), number=4), diagnosis(verdict="no_mismatch")),
        (answer("outside", ("rotating_mass",), number=5), diagnosis(verdict="unexplained")),
    ]
    judged = [judge(truth, recorded(), said, seconds=10.0 * truth.number) for truth, said in cases]
    return [*judged, judge(answer(number=6), recorded(), None)]


def rates(result: Score) -> dict[str, tuple[int, int]]:
    return {rate.name: (rate.hits, rate.count) for rate in [*result.rates, *result.bands]}


def test_score_counts_each_question_over_its_own_cases() -> None:
    result = score(five())
    found = rates(result)
    assert found["one hidden: named first"] == (1, 3)
    assert found["one hidden: named first or in a class of at most 3"] == (2, 3)
    assert found["two hidden: both named"] == (0, 1)
    assert found["nothing hidden: something named"] == (0, 1)
    assert found["outside physics: unexplained or partly explained"] == (1, 1)
    assert found["slot located right"] == (2, 4)
    assert found["no longer than 300 s at 10 Hz: diagnosed in 60 s, on one core"] == (6, 6)
    assert found["95 % intervals of effects hold the truth"] == (1, 1)
    assert found["one hidden, misfit 300-2000: named first"] == (1, 3)
    assert result.failed == ["dive_0006"]
    assert result.confusion[("trim_moment", "net_buoyancy")] == 1
    assert result.confusion[("trim_moment", "nothing")] == 1
    assert result.confusion[("nothing", "nothing")] == 1
    assert result.longest_seconds == 50.0
    assert result.errors["c_q0"][0] == pytest.approx(0.05)


@pytest.mark.parametrize(("bic", "missed"), [(-100.0, 1), (-115.0, 0)])
def test_what_the_search_missed_is_told_from_ties(bic: float, missed: int) -> None:
    true = {"depth_rmse_m": 0.1, "pitch_rmse_rad": 0.01, "bic": -120.0}
    said = diagnosis(effect("net_buoyancy")) | {"bic": bic}
    judged = [judge(answer(), recorded(), said, true_heldout=true)]
    found = rates(score(judged))
    assert found["hidden: missed by the search, as the true set is likelier by 6 of BIC"] == (missed, 1)


def test_a_failure_with_nothing_hidden_is_not_silence() -> None:
    result = score([judge(answer("none", ()), recorded(), None)])
    assert rates(result)["nothing hidden: something named"] == (1, 1)


def test_only_recordings_of_ordinary_length_are_timed() -> None:
    one = five()[0]
    judged = [replace(one, rows=rows, seconds=s) for rows, s in ((3000, 60.0), (3000, 61.0), (3001, 9.0))]
    name = "no longer than 300 s at 10 Hz: diagnosed in 60 s, on one core"
    assert rates(score(judged))[name] == (1, 2)


def test_bars_and_intervals_of_rates() -> None:
    assert Rate(name="", hits=92, count=100, least=0.92).is_met
    assert Rate(name="", hits=91, count=100, least=0.92).is_met is False
    assert Rate(name="", hits=3, count=100, most=0.02).is_met is False
    assert Rate(name="", hits=0, count=0, most=0.02).is_met is None
    assert Rate(name="", hits=5, count=10).is_met is None
    low, high = Rate(name="", hits=50, count=100).interval
    assert (low, high) == pytest.approx((0.4038, 0.5962), abs=1e-3)
    assert Rate(name="", hits=0, count=0).interval == (0.0, 1.0)
    assert bar(Rate(name="", hits=0, count=1, least=0.93, most=0.97)) == "93 % - 97 %"
    assert bar(Rate(name="", hits=0, count=1, most=0.02)) == "<= 2 %"


def test_slots_are_not_judged_beside_what_every_vehicle_has() -> None:
    laden = judge(answer(usual=["actuator_lag"]), recorded(), diagnosis(effect("trim_moment")))
    assert rates(score([laden]))["slot located right"] == (0, 0)
    assert rates(score([*five(), laden]))["slot located right"] == (2, 4)


def test_tables_page_and_file_say_the_same(tmp_path: Path) -> None:
    judged = five()
    result = score(judged)
    said = StringIO()
    print_score(result, Console(file=said, width=120))
    assert "one hidden: named first" in said.getvalue()
    assert "missed" in said.getvalue()
    write_json(tmp_path / "trial.json", 7, "abc", result, judged)
    content = json.loads((tmp_path / "trial.json").read_text())
    assert content["seed"] == 7
    assert len(content["judged"]) == 6
    assert content["rates"][0]["hits"] == 1
    write_page(tmp_path / "trial.html", 7, "abc", result, judged, ["heave_quadratic_drag"], ["LAUV"])
    page = (tmp_path / "trial.html").read_text()
    assert "trim_moment named net_buoyancy: 1" in page
    assert "real ones have (heave_quadratic_drag)" in page
    assert "like a published one (LAUV)" in page
    assert "http" not in page.replace("http-equiv", "")


def test_a_row_of_the_matrix_holds_names_that_were_never_hidden(tmp_path: Path) -> None:
    judged = [judge(answer(), recorded(), diagnosis(effect("heave_pitch_acceleration_coupling")))]
    write_page(tmp_path / "trial.html", 7, "abc", score(judged), judged, [], [])
    page = (tmp_path / "trial.html").read_text()
    assert "trim_moment named heave_pitch_acceleration_coupling: 1" in page


def test_a_trial_without_recordings_has_no_figures() -> None:
    result = score([])
    assert result.recordings == 0
    assert all(rate.is_met is None for rate in result.rates)
