"""A measured speed that errs, corrected by the surge equation."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from host.catalogue import structure_of
from host.catalogue.nuisance import SPEED_CORRECTION
from host.diagnosis.against.comparison import compare
from host.diagnosis.against.given_model import against_model
from host.diagnosis.against.other_side import Side, side_of
from host.diagnosis.diagnose import diagnose
from host.diagnosis.fits.corrected_speed import speed_readings, strayed
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.setting import SURGE
from host.diagnosis.fits.starts import begun_from
from host.diagnosis.search.unknown_physics import known_in
from host.diagnosis.search.whole_vehicle import ended
from host.diagnosis.told.files import write_extended_model
from host.dynamics.propagate import free_run, inputs_of
from host.identification.model import read_model
from host.likelihood.fit import Fit
from host.recordings.recording import Array
from host.vehicle import default_vehicle
from tests.diagnosis.hidden_dive import BASE, DRAG, RECOVERY, slowing

CORRECTED = frozenset({"speed_loss", SPEED_CORRECTION.name})


@cache
def explained(noise: float) -> tuple[Fitter, Explanation, Explanation]:
    """The dive explained by speed loss, as the speed is measured and with it corrected."""
    fitter = Fitter([slowing(noise)])
    taken = fitter.polished(fitter.grown(fitter.base, "speed_loss", []))
    return fitter, taken, fitter.polished(fitter.grown(taken, SPEED_CORRECTION.name, []))


def value(explanation: Explanation, name: str) -> float:
    return float(explanation.fit.parameters[explanation.fit.structure.names.index(name)])


def test_the_surge_equation_tells_what_a_noisy_sensor_does_not() -> None:
    fitter, taken, corrected = explained(0.1)
    assert taken.bic - corrected.bic > 50.0
    assert fitter.excess(corrected.fit) < 1.15 < fitter.excess(taken.fit)
    ratio = value(corrected, "u0") / BASE["u0"]
    assert value(corrected, "c_ud") == pytest.approx(DRAG * ratio**2, rel=0.1)
    assert value(corrected, "a1") == pytest.approx(BASE["a1"] * ratio, rel=0.05)
    assert value(corrected, "balanced_share") == pytest.approx(1.0 / ratio, rel=0.05)


def test_a_speed_that_leaves_its_readings_is_charged_what_they_say_of_it() -> None:
    fitter, taken, corrected = explained(0.1)

    def charge(fit: Fit) -> float:
        return strayed(fit, fitter.inputs(fit.structure.effect_names), [speed_readings(slowing(0.1))])

    assert charge(corrected.fit) == charge(taken.fit) == 0.0
    values = corrected.fit.parameters.copy()
    values[corrected.fit.structure.names.index("c_ud")] *= 20.0
    astray = replace(corrected.fit, parameters=values)
    assert charge(astray) > 1e4
    assert fitter.bic(astray, CORRECTED) > fitter.bic(corrected.fit, CORRECTED) + 1e4
    untold = replace(slowing(0.1), speed=np.full_like(slowing(0.1).speed, np.nan))
    both = replace(astray, initial=2 * astray.initial)
    two = [*fitter.inputs(CORRECTED), *Fitter([untold], known=corrected).inputs(CORRECTED)]
    assert strayed(both, two, [speed_readings(each) for each in (slowing(0.1), untold)]) == charge(astray)
    alone = fitter.shrunk(corrected, "speed_loss")
    assert charge(alone.fit) == 0.0  # which corrects nothing


def test_a_speed_that_was_measured_well_is_not_taken_for_what_is_missing() -> None:
    """A lever arm of the depth sensor, which the surge equation would make up for with absurd drag."""
    dive = slowing(0.003)
    ahead = replace(dive, depth=dive.depth - 2.0 * np.sin(dive.pitch))
    fitter = Fitter([ahead])
    names = frozenset(
        {"speed_loss", "heave_quadratic_drag", "pitch_quadratic_damping", SPEED_CORRECTION.name}
    )
    found = ended(fitter, begun_from(fitter, fitter.root, names), names)
    assert SPEED_CORRECTION.name not in found.names


def test_a_correction_is_no_physics_and_is_not_named() -> None:
    _, _, corrected = explained(0.1)
    assert known_in(corrected) == ["speed_loss"]


@pytest.mark.long
def test_it_is_told_and_kept_in_the_model_which_lacks_nothing(tmp_path: Path) -> None:
    found = diagnose([slowing(0.1)])
    assert found.verdict == "explained"
    assert [effect.name for effect in found.effects] == ["speed_loss"]
    assert SPEED_CORRECTION.name in found.remaining
    write_extended_model(found, default_vehicle(), tmp_path / "model.json")
    model = read_model(tmp_path / "model.json")
    assert SPEED_CORRECTION.name in {effect["name"] for effect in model.effects}
    assert against_model(found, model, "model.json").found.verdict == "no_mismatch"


def test_a_model_of_a_speed_taken_as_it_was_measured_says_nothing_of_what_changes_it() -> None:
    fitter, taken, corrected = explained(0.1)
    found = compare(fitter, corrected, side_of(taken))
    assert [(effect.name, effect.status) for effect in found.effects] == [("speed_loss", "same")]
    other = {**side_of(corrected).values, "c_ud": (0.1 * DRAG, 0.0)}
    differs = compare(fitter, corrected, Side(names=CORRECTED, values=other))
    assert [(effect.name, effect.status) for effect in differs.effects] == [("speed_loss", "different")]


def test_it_is_asked_only_of_a_speed_whose_errors_matter_beside_a_loss_of_it() -> None:
    noisy, precise, untold = (Fitter([slowing(noise)]) for noise in (0.1, 1e-5, np.nan))
    loss = frozenset({"speed_loss"})
    assert noisy.tools_beside(loss) == (SPEED_CORRECTION.name,)
    assert noisy.tools_beside(frozenset({"munk_moment"})) == ()
    assert precise.tools_beside(loss) == untold.tools_beside(loss) == ()


def test_a_measured_speed_alone_leaves_nothing_of_the_surge_equation_to_estimate() -> None:
    fitter, taken, corrected = explained(0.1)
    assert {name: value(taken, name) for name in SURGE} == SURGE
    assert fitter.free_parameters(taken.names) == 0
    assert fitter.free_parameters(corrected.names) == len(SURGE) + 2
    assert {name: value(fitter.shrunk(corrected, SPEED_CORRECTION.name), name) for name in SURGE} == SURGE


def speeds(gain: float, rates: dict[str, float] | None = None) -> Array:
    """The speed in a free run over the dive, as it is corrected with this gain."""
    recording, structure = slowing(1e-5), structure_of(CORRECTED)
    known = (
        BASE
        | {"heave_offset": 0.0, "pitch_offset": 0.0}
        | SURGE
        | {"speed_gain": gain, "balanced_share": 1.0}
        | (rates or {})
    )
    start = np.array([0.0, 0.0, 0.0, 20.0, 0.0])
    run = free_run(np.array([known[n] for n in structure.names]), start, inputs_of(recording, structure))
    return np.asarray(BASE["u0"] + run.states[structure.states.index("speed_loss")])


def test_with_a_large_gain_the_speed_is_the_measured_one() -> None:
    assert np.abs(speeds(5.0) - slowing(1e-5).speed)[1:].max() < 0.1
    assert np.abs(speeds(0.02) - slowing(1e-5).speed)[1:].max() > 0.3


def test_with_a_small_gain_it_is_that_of_the_surge_equation() -> None:
    told = speeds(0.02, {"speed_time": RECOVERY, "c_ud": DRAG})
    assert np.abs(told - slowing(1e-5).speed).max() < 0.05
