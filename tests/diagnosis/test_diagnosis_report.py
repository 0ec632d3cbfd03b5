"""The page that a person reads."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.catalogue import BY_NAME
from host.catalogue.moments import SCANS
from host.diagnosis.against.comparison import Comparison, EffectDifference, compare
from host.diagnosis.against.other_side import side_of
from host.diagnosis.answer import Against, Answer
from host.diagnosis.diagnose import Diagnosis
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.judge import NamedEffect
from host.diagnosis.separation import separations
from host.diagnosis.told.pictures import layers_picture
from host.diagnosis.told.report import _dated, write_report


def page(answer: Answer, tmp_path: Path) -> str:
    write_report(answer, "boat", tmp_path / "report.html")
    return (tmp_path / "report.html").read_text()


def test_twins_are_shown_with_the_manoeuvre_that_decides(coupled: Diagnosis, tmp_path: Path) -> None:
    twins = ["depth_sensor_lever_arm", "depth_sensor_lag"]
    found = replace(coupled, effects=[replace(coupled.effects[0], twins=twins)])
    shown = page(Answer(found=found, separations=separations(found)), tmp_path)
    assert "This recording cannot tell it from depth sensor lever arm or depth sensor lag" in shown
    assert "No plane movement at this speed" in shown
    assert "Which manoeuvre decides" in shown
    assert shown.count("data:image/png;base64,") == 5
    assert "http" not in shown.replace("http-equiv", "")


@pytest.mark.parametrize(("is_alone", "told"), [(True, "alone would improve"), (False, "lost without each")])
def test_it_is_said_by_what_effects_are_ranked(
    coupled: Diagnosis, tmp_path: Path, is_alone: bool, told: str
) -> None:
    assert coupled.is_ranked_alone
    shown = page(Answer(found=replace(coupled, is_ranked_alone=is_alone)), tmp_path)
    assert told in shown


def test_nothing_missing_shows_no_shares(coupled: Diagnosis, tmp_path: Path) -> None:
    slots = dict.fromkeys(coupled.slots, 0.0)
    calm = replace(coupled, verdict="no_mismatch", effects=[], slots=slots, extended=coupled.base)
    shown = page(Answer(found=calm), tmp_path)
    assert "No mismatch" in shown
    assert "What was left out" not in shown
    assert shown.count("data:image/png;base64,") == 3


def test_after_an_alarm_it_is_said_what_changed_and_when_or_that_nothing_did(
    coupled: Diagnosis, tmp_path: Path
) -> None:
    alarmed = replace(coupled, recordings=[replace(r, alarms=(60.0,)) for r in coupled.recordings])
    assert "Near 60 s nothing was found to have changed" in page(Answer(found=alarmed), tmp_path)
    coefficients = {
        "current_step": (0.03, 0.001, "m/s"),
        "current_change_time": (47.2, 0.1, "s"),
        "carried_share": (0.5, 0.1, "1"),  # a detail after it
    }
    change = NamedEffect(name="current_change", delta_bic=99.0, coefficients=coefficients)
    shown = page(Answer(found=replace(alarmed, effects=[change])), tmp_path)
    assert "current change (at 47 s)" in shown
    assert "nothing was found to have changed" not in shown


@pytest.mark.parametrize("kind", ["model", "simulation"])
def test_the_other_side_is_set_beside_the_recording(coupled: Diagnosis, tmp_path: Path, kind: str) -> None:
    fitter = Fitter(coupled.recordings, known=coupled.extended)
    comparison = compare(fitter, coupled.extended, side_of(coupled.base))
    against = Against(kind=kind, name="theirs.csv", comparison=comparison)  # type: ignore[arg-type]
    shown = page(Answer(found=coupled, against=against), tmp_path)
    assert f"Your {kind} against the recording" in shown
    assert f"missing from the {kind}" in shown
    assert ("given model" in shown) == (kind == "model")


def test_of_a_measured_speed_no_coefficient_is_shown(coupled: Diagnosis, tmp_path: Path) -> None:
    held = {"speed_time": (10.0, 0.0), "c_ud": (0.0, 0.0), "c_uq": (0.0, 0.0)}
    told = {"speed_time": (6.5, 0.1), "c_ud": (1.9, 0.1), "c_uq": (0.0, 1e9)}
    surge = EffectDifference(name="speed_loss", status="same", recorded=held, given=told, evidence=0.0)
    against = Against(kind="simulation", name="s.csv", comparison=Comparison(effects=[surge], parameters=[]))
    assert "measured</td>" not in page(Answer(found=coupled, against=against), tmp_path)
    sailed = [replace(r, speed=np.full(r.time.size, 2.5)) for r in coupled.recordings]
    shown = page(Answer(found=replace(coupled, recordings=sailed), against=against), tmp_path)
    assert shown.count("<td>measured</td>") == 3
    assert "<td>6.5 +- 0.1</td>" in shown
    assert "<td>0 (open)</td>" in shown


def test_what_is_not_explained_is_not_recommended(coupled: Diagnosis, tmp_path: Path) -> None:
    shown = page(Answer(found=replace(coupled, verdict="unexplained")), tmp_path)
    assert "The nearest of the catalogue" in shown
    assert "Use extended_model.json" not in shown


@pytest.mark.parametrize("name", [*SCANS])
def test_each_change_has_one_moment_to_tell(name: str) -> None:
    coefficients = {p.name: (float(k), 0.1, p.unit) for k, p in enumerate(BY_NAME[name].parameters)}
    (time,) = (p.name for p in BY_NAME[name].parameters if p.name.endswith("_time"))
    told = _dated(NamedEffect(name=name, delta_bic=99.0, coefficients=coefficients))
    assert told.endswith(f"(at {coefficients[time][0]:.0f} s)")


def test_what_goes_with_the_depth_is_drawn_over_it(coupled: Diagnosis) -> None:
    assert layers_picture(coupled) == ""
    dive = hidden_dive(lambda _, x, __: (0.1 * np.tanh(x[3] - 15.0), 0.0, 0.0), duration=60.0)
    fitter = Fitter([dive])
    layered = fitter.grown(fitter.root, "unknown_force_in_layers", [])
    seldom = replace(dive, depth=np.where(np.arange(dive.time.size) % 2 == 0, dive.depth, np.nan))
    picture = layers_picture(replace(coupled, recordings=[seldom], extended=layered))
    assert picture.startswith("data:image/png;base64,")
