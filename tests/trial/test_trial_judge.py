"""Hand-made diagnoses against hand-made answers."""

import pytest
from hand_made import answer, diagnosis, effect, recorded

from tools.trial.answers import Answer
from tools.trial.judge import Judged, judge


def judged(answered: Answer, *effects: dict[str, object], **said: str) -> Judged:
    return judge(answered, recorded(), diagnosis(*effects, **said))  # type: ignore[arg-type]


def test_named_first_outright() -> None:
    found = judged(answer(), effect("trim_moment"))
    assert found.is_first
    assert found.is_in_class
    assert found.is_exact
    assert found.is_slot_right
    assert not found.admits


def test_named_within_a_class_of_three_but_not_of_four() -> None:
    found = judged(answer(), effect("net_buoyancy", "trim_moment", "pitch_bias"))
    assert not found.is_first
    assert found.is_in_class
    assert not found.is_exact
    large = judged(answer(), effect("net_buoyancy", "trim_moment", "pitch_bias", "rudder_offset"))
    assert not large.is_in_class


def test_named_second_is_neither_first_nor_in_its_class() -> None:
    found = judged(answer(), effect("net_buoyancy"), effect("trim_moment"))
    assert not found.is_first
    assert not found.is_in_class
    assert found.are_named
    assert not found.is_exact


def test_both_of_two() -> None:
    two = answer("two", ("trim_moment", "net_buoyancy"))
    assert judged(two, effect("net_buoyancy"), effect("trim_moment")).are_named
    half = judged(two, effect("trim_moment"))
    assert not half.are_named
    assert half.is_first
    twins = judged(two, effect("trim_moment"), effect("vertical_current", "net_buoyancy"))
    assert not twins.are_named
    assert twins.are_in_class


def test_nothing_hidden() -> None:
    none = answer("none", ())
    silent = judged(none, verdict="no_mismatch")
    assert silent.is_exact
    assert silent.is_first is None
    assert silent.is_slot_right is None
    assert not judged(none, effect("trim_moment")).is_exact


@pytest.mark.parametrize(
    ("verdict", "admits"),
    [("unexplained", True), ("partly_explained", True), ("explained", False), ("no_mismatch", False)],
)
def test_outside_physics(verdict: str, admits: bool) -> None:
    found = judged(answer("outside", ("rotating_mass",)), verdict=verdict)
    assert found.admits == admits
    assert not found.is_exact
    assert found.is_slot_right


def test_slot_of_the_largest_share_and_none_where_nothing_is_located() -> None:
    assert not judged(answer(), effect("trim_moment"), slot="surge").is_slot_right
    nowhere = diagnosis(effect("trim_moment"))
    nowhere["location"]["slots"] = {"heave": 0.0, "pitch": 0.0}
    assert not judge(answer(), recorded(), nowhere).is_slot_right


def test_a_missing_diagnosis_is_a_wrong_answer() -> None:
    found = judge(answer(), recorded(), None)
    assert found.has_failed
    assert not found.is_first
    assert not found.is_slot_right
    assert found.over_floor is None


def test_held_out_error_over_the_noise() -> None:
    found = judged(answer(), effect("trim_moment"))
    assert found.over_floor == pytest.approx(((1.02**2 + 1.01**2) / 2) ** 0.5)
    assert found.base_over_floor == pytest.approx(5.0)


def test_held_out_error_over_the_true_structure() -> None:
    true = {"depth_rmse_m": 0.1, "pitch_rmse_rad": 0.01}
    said = diagnosis(effect("net_buoyancy"))
    wrong = judge(answer(), recorded(), said, true_heldout=true)
    assert wrong.over_truth == pytest.approx(((1.02**2 + 1.01**2) / 2) ** 0.5)
    assert judge(answer(), recorded(), said).over_truth is None
    assert judged(answer(), effect("trim_moment")).over_truth == 1.0


def test_the_lead_of_the_true_structure_tells_a_missed_search_from_a_tie() -> None:
    true = {"depth_rmse_m": 0.1, "pitch_rmse_rad": 0.01, "bic": -120.0}
    said = diagnosis(effect("net_buoyancy")) | {"bic": -100.0}
    assert judge(answer(), recorded(), said, true_heldout=true).truth_lead == pytest.approx(20.0)
    assert judge(answer(), recorded(), said).truth_lead is None
    assert judged(answer(), effect("trim_moment")).truth_lead == 0.0
    at_sea = answer(hidden=("surface_waves",), slots=["environment"])
    assert judge(at_sea, recorded(), said, true_heldout=true).truth_lead is None


def test_held_out_noise_is_that_of_the_spans_where_they_are_told() -> None:
    told = diagnosis(effect("trim_moment"))
    told["extended"]["heldout"]["spans_s"] = [[0.4, 0.6]]
    measured = recorded()
    measured["pitch_rad"][1] += 0.03  # now off by 0.02 there
    assert judge(answer(), measured, told).over_floor == pytest.approx((((1.02) ** 2 + 0.505**2) / 2) ** 0.5)


def test_coefficients_and_their_intervals() -> None:
    model = {"parameters": {"a1": {"value": -0.6, "std": 0.02}, "u0": {"value": 2.01, "std": 0.01}}}
    said = diagnosis(effect("trim_moment", c_q0=(0.021, 0.001)))
    found = judge(answer(), recorded(), said, model)
    (trim,) = found.effect_coefficients
    assert trim.is_covered
    assert trim.error == pytest.approx(0.05)
    assert {c.name: c.is_covered for c in found.base_coefficients} == {"a1": False, "u0": True}
    given = judge(answer(outing={"has_speed": True}), recorded(), said, model)
    assert [c.name for c in given.base_coefficients] == ["a1"]


def test_coefficients_that_go_with_speed_are_not_judged_where_it_varies() -> None:
    truth = {"munk_moment": {"c_qw": 1.0}}
    said = diagnosis(effect("munk_moment", c_qw=(0.7, 0.1)))
    steady = answer(hidden=("munk_moment",), coefficients=truth)
    slowing = answer(hidden=("munk_moment",), coefficients=truth, usual=["speed_loss"])
    assert len(judge(steady, recorded(), said).effect_coefficients) == 1
    assert not judge(slowing, recorded(), said).effect_coefficients


def test_buoyancy_beyond_the_weight_restores_as_well() -> None:
    light = answer(
        hidden=("net_buoyancy",), base={"a3": -1.0}, sizes={"net_buoyancy": 0.981},
        outing={"has_speed": False, "mass_kg": 1.0},
    )  # fmt: skip
    model = {"parameters": {"a3": {"value": -1.1, "std": 0.01}}}
    found = judge(light, recorded(), diagnosis(effect("net_buoyancy"), slot="heave"), model)
    assert [c.truth for c in found.base_coefficients] == [pytest.approx(-1.1, rel=1e-3)]


def test_coefficients_count_only_where_the_whole_truth_was_named_and_have_a_deviation() -> None:
    two = answer("two", ("trim_moment", "net_buoyancy"))
    assert not judged(two, effect("trim_moment", c_q0=(0.021, 0.001))).effect_coefficients
    assert not judged(answer(), effect("trim_moment", c_q0=(0.021, 0.0))).effect_coefficients
    lost = effect("trim_moment")
    lost["coefficients"]["c_q0"] = {"value": 0.02, "std": None, "unit": "1"}
    assert not judged(answer(), lost).effect_coefficients


def test_what_every_vehicle_has_may_be_named_or_not() -> None:
    laden = answer(usual=["actuator_lag", "heave_quadratic_drag"])
    found = judged(laden, effect("heave_quadratic_drag"), effect("trim_moment"))
    assert found.named == ["trim_moment"]
    assert found.is_first
    assert found.is_exact
    assert found.is_slot_right is None
    assert judged(laden, effect("trim_moment")).is_exact
    assert not judged(laden, effect("munk_moment"), effect("trim_moment")).is_first
    assert judged(answer("none", (), usual=["actuator_lag"]), effect("actuator_lag")).is_exact
