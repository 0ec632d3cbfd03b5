"""A simulator's output set against a recording: what it lacks, and what it has too much."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.against.comparison import Comparison, EffectDifference, sentences
from host.diagnosis.against.contained import contained
from host.diagnosis.against.given_simulation import against_simulation, check_same_flight, untold_in
from host.diagnosis.against.other_side import Side, at_speed
from host.diagnosis.answer import Answer
from host.diagnosis.diagnose import Diagnosis
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.told.files import document
from host.diagnosis.told.report import summary
from host.errors import RecordingError
from host.recordings.plane_between_rows import with_moving_plane
from host.recordings.recording import Recording
from tools.cli import main


def drag(_: float, x: np.ndarray, __: float) -> tuple[float, float, float]:  # type: ignore[type-arg]
    return -2.0 * x[0] * abs(x[0]), 0.0, 0.0


def write(dive: Recording, path: Path) -> str:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time_s", "depth_m", "pitch_rad", "rudder_rad"])
        writer.writerows(zip(dive.time, dive.depth, dive.pitch, dive.rudder, strict=True))
    return str(path)


@pytest.fixture(scope="module")
def answer(coupled: Diagnosis) -> Answer:
    """The recording couples pitch rate into heave; the simulation has quadratic drag in its place."""
    return against_simulation(coupled, [replace(hidden_dive(drag, seed=1, noise=0.0), name="sim.csv")])


def test_what_the_simulation_lacks_and_has_too_much(answer: Answer) -> None:
    assert answer.against is not None
    (missing,) = answer.against.comparison.named("missing")
    (superfluous,) = answer.against.comparison.named("superfluous")
    assert missing.name == "heave_pitch_rate_coupling"
    assert missing.recorded["c_wq"][0] == pytest.approx(0.8, abs=4.0 * missing.recorded["c_wq"][1])
    assert superfluous.name == "heave_quadratic_drag"
    assert superfluous.given["c_ww"][0] == pytest.approx(-2.0, abs=0.2)
    assert not any(parameter.is_different for parameter in answer.against.comparison.parameters)


def test_the_summary_begins_with_the_difference(answer: Answer) -> None:
    said = summary(answer)
    assert said.startswith(
        "The simulation lacks heave pitch rate coupling; it has too much heave quadratic drag. "
        "Left out of the base equations was: heave pitch rate coupling"
    )
    assert answer.against is not None
    alike = replace(answer, against=replace(answer.against, comparison=Comparison(effects=[], parameters=[])))
    assert summary(alike).startswith("The simulation holds what the recording shows. Left out of the base")
    doubtful = replace(alike, against=replace(alike.against, is_understood=False))  # type: ignore[type-var]
    assert summary(doubtful).startswith("Left out of the base equations was")
    linear = replace(answer, found=replace(answer.found, verdict="no_mismatch"))
    assert summary(linear).startswith("The simulation lacks ")


def test_the_summary_tells_what_makes_coefficients_differ(answer: Answer) -> None:
    assert answer.against is not None
    comparison = answer.against.comparison
    stiff = [
        replace(one, given=(2.0 * one.recorded[0], 0.0), is_different=True) if one.name == "a3" else one
        for one in comparison.parameters
    ]
    against = replace(answer.against, comparison=replace(comparison, parameters=stiff))
    said = summary(replace(answer, against=against))
    assert "; it has too much heave quadratic drag; it has 2 times the righting moment. " in said


def test_the_answer_in_the_file(answer: Answer) -> None:
    simulation = document(answer)["simulation"]
    assert simulation["file"] == "sim.csv"
    assert simulation["contains"] == ["heave_quadratic_drag"]
    assert simulation["added_noise"]["depth_m"] == pytest.approx(0.001, rel=0.2)
    status = {effect["name"]: effect["status"] for effect in simulation["effects"]}
    assert status == {"heave_pitch_rate_coupling": "missing", "heave_quadratic_drag": "superfluous"}
    assert any("is missing from the simulation" in sentence for sentence in simulation["sentences"])


def test_of_what_was_measured_no_coefficient_is_told() -> None:
    missing = EffectDifference(
        name="speed_loss", status="missing", recorded={"c_ud": (0.0, 0.0)}, given={}, evidence=99.0
    )
    (said,) = sentences(Comparison(effects=[missing], parameters=[]), "simulation")
    assert said == "speed loss is missing from the simulation."


def test_what_has_no_unit_is_told_without_and_what_the_motion_leaves_open_is_called_so() -> None:
    stall = {"stall_angle": (0.25, 0.01), "stall_loss": (1.5, 0.01), "stall_share": (0.0, 1e57)}
    missing = EffectDifference(name="rudder_stall", status="missing", recorded=stall, given={}, evidence=99.0)
    (said,) = sentences(Comparison(effects=[missing], parameters=[]), "simulation")
    assert said.endswith("stall_angle = 0.25 +- 0.01 rad, stall_loss = 1.5 +- 0.01, stall_share = 0 (open).")


def test_the_same_hull_at_another_speed_is_the_same() -> None:
    values = {
        "a1": -0.6,
        "a2": -0.7,
        "a3": -0.5,
        "b1": -0.2,
        "b2": -1.4,
        "u0": 1.5,
        "c_wq": 0.6,
        "c_qq": -23.0,
        "speed_time": 20.0,
        "c_ud": 12.0,
        "c_uq": 2.0,
    }
    values |= {"heave_offset": 0.0, "pitch_offset": 0.0}
    names = frozenset({"heave_pitch_rate_coupling", "pitch_quadratic_damping", "speed_loss"})
    slower = at_speed(
        Side(names=names, values={name: (value, 0.1) for name, value in values.items()}), 1.2
    ).values
    ratio = 1.2 / 1.5
    assert slower["a1"] == pytest.approx((-0.6 * ratio, 0.1 * ratio))
    assert slower["c_wq"] == pytest.approx((0.6 * ratio, 0.1 * ratio))
    assert slower["b2"] == pytest.approx((-1.4 * ratio**2, 0.1 * ratio**2))
    assert slower["a3"] == (-0.5, 0.1)  # weight knows no speed
    assert slower["c_qq"] == (-23.0, 0.1)
    assert slower["speed_time"] == pytest.approx((20.0 / ratio, 0.1 / ratio))
    assert slower["c_ud"] == pytest.approx((12.0 * ratio**2, 0.1 * ratio**2))
    assert slower["c_uq"] == (2.0, 0.1)
    assert slower["u0"][0] == 1.2


@pytest.mark.long
def test_a_weaker_effect_in_the_simulation_is_no_missing_one(coupled: Diagnosis) -> None:
    weak = hidden_dive(lambda _, x, __: (0.3 * x[1], 0.0, 0.0), seed=1, noise=0.0)
    answer = against_simulation(coupled, [weak])
    assert answer.against is not None
    (different,) = answer.against.comparison.effects
    assert different.status == "different"
    assert different.given["c_wq"][0] == pytest.approx(0.3, abs=0.06)


def grown(fitter: Fitter, *names: str) -> Explanation:
    explanation = fitter.base
    for name in names:
        explanation = fitter.polished(fitter.grown(explanation, name, []))
    return explanation


@pytest.fixture(scope="module")
def ours() -> Explanation:
    dive = hidden_dive(lambda _, x, __: (0.8 * x[1], 0.0, 0.0), seed=1)
    return grown(Fitter([dive]), "heave_pitch_rate_coupling")


@pytest.mark.parametrize("mistaken", [("munk_moment", "actuator_lag"), ("depth_sensor_lag",)])
def test_what_a_simulation_was_mistaken_to_hold_gives_way_to_what_the_recording_shows(
    ours: Explanation, mistaken: tuple[str, ...]
) -> None:
    def physics(_: float, x: np.ndarray, __: float) -> tuple[float, float, float]:  # type: ignore[type-arg]
        w, q, theta, _ = x
        return 0.3 * q, 0.0, w * (np.cos(theta) - 1.0) - 2.5 * (np.sin(theta) - theta)

    quiet = Fitter([hidden_dive(physics, seed=1, noise=0.1)])
    held = contained(quiet, grown(quiet, *mistaken), ours)
    values = dict(zip(held.fit.structure.names, held.fit.parameters, strict=True))
    assert held.names == {"heave_pitch_rate_coupling", "large_angle_kinematics"}
    assert values["c_wq"] == pytest.approx(0.3, abs=0.02)


def test_a_trace_of_an_effect_is_none_of_it(ours: Explanation) -> None:
    quiet = Fitter([hidden_dive(lambda _, x, __: (0.05 * x[1], 0.0, 0.0), seed=1, noise=0.1)])
    assert grown(quiet, "heave_pitch_rate_coupling").bic < quiet.base.bic
    assert not contained(quiet, quiet.base, ours).names


def test_a_simulation_that_tells_its_speed_says_nothing_of_what_slows_it(ours: Explanation) -> None:
    dive = hidden_dive(drag, seed=1)
    told = replace(dive, speed=np.full(dive.time.size, 2.5))
    assert untold_in([told], ours) == {"speed_loss"}
    assert not untold_in([told], replace(ours, names=ours.names | {"speed_loss"}))
    assert not untold_in([dive], ours)


def test_a_simulation_in_finer_steps_is_read_at_the_recorded_rows(coupled: Diagnosis) -> None:
    coarse = hidden_dive(seed=1, noise=0.0)
    fine = np.arange(2 * coarse.time.size - 1) * 0.05
    simulated = replace(
        coarse,
        time=fine,
        depth=np.interp(fine, coarse.time, coarse.depth),
        pitch=np.interp(fine, coarse.time, coarse.pitch),
        rudder=np.repeat(coarse.rudder, 2)[: fine.size],
        speed=np.full(fine.size, np.nan),
        pitch_rate=np.full(fine.size, np.nan),
        step=0.05,
    )
    check_same_flight(coupled.recordings, [simulated])


@pytest.mark.parametrize(
    ("simulated", "complaint"),
    [
        (hidden_dive(seed=2, duration=30.0), "its rudder must be that of"),
        (hidden_dive(seed=1, duration=20.0), "must cover 0 to 29.9 s"),
    ],
)
def test_a_simulation_of_something_else_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], simulated: Recording, complaint: str
) -> None:
    dive = write(hidden_dive(seed=1, duration=30.0), tmp_path / "dive.csv")
    sim = write(simulated, tmp_path / "sim.csv")
    assert main(["diagnose", dive, "--simulation", sim, "--quiet"]) == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert error.count("\n") == 1


def test_what_the_plane_did_between_rows_is_asked_of_each_side_alone(coupled: Diagnosis) -> None:
    simulated = hidden_dive(seed=1, noise=0.0)
    told = replace(coupled, recordings=[with_moving_plane(recording) for recording in coupled.recordings])
    assert told.recordings[0].has_moving_plane
    answer = against_simulation(told, [simulated])
    assert answer.against is not None
    (seen,) = answer.against.recorded
    np.testing.assert_array_equal(seen.rudder, simulated.rudder)
    assert not seen.has_moving_plane


def test_one_simulation_belongs_to_one_recording() -> None:
    dives = [replace(hidden_dive(seed=1, duration=20.0), name=f"{k}.csv") for k in range(2)]
    with pytest.raises(RecordingError, match="goes with one recording"):
        check_same_flight(dives, dives[:1])


@pytest.mark.long
def test_the_command_says_that_a_true_simulation_lacks_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dive = write(hidden_dive(seed=3, duration=60.0), tmp_path / "dive.csv")
    sim = write(hidden_dive(seed=3, duration=60.0, noise=0.0), tmp_path / "sim.csv")
    assert main(["diagnose", dive, "--simulation", sim, "--out", str(tmp_path), "--quiet"]) == 0
    assert "The simulation holds the physics that the recording shows" in capsys.readouterr().out
    assert json.loads((tmp_path / "diagnosis.json").read_text())["simulation"]["effects"] == []
