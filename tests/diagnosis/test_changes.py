"""What changed at one moment, known roughly or not: the part around it, the name and size of the change."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.catalogue import BY_NAME, CATALOGUE, CHANGES, structure_of
from host.catalogue.moments import COUNT, LAST, SCANS, sizes
from host.diagnosis.diagnose import diagnose
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.prospects import _moments, probed
from host.diagnosis.fits.workers import Workers
from host.diagnosis.recordings.around import around, around_alarm
from host.diagnosis.recordings.spans import divide
from host.diagnosis.search.candidates import eligible
from host.diagnosis.search.exchange import exchanged
from host.diagnosis.search.offset_choice import with_lasting_offsets
from host.diagnosis.search.search import Search
from host.diagnosis.search.whole_vehicle import all_beside
from host.dynamics.propagate import free_run, inputs_of
from host.errors import RecordingError
from host.recordings.recording import Array

WHEN, TOLD = 47.0, 66.0  # s


def trim(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return 0.0, 0.05 * (time > WHEN), 0.0


def slower(time: float, x: Array, plane: float) -> tuple[float, float, float]:
    lost = -0.1 * (time > WHEN)
    weaker = (1.0 + lost) ** 2 - 1.0
    heave = BASE["a1"] * lost * x[0] + BASE["b1"] * weaker * plane
    pitch = BASE["a2"] * lost * x[1] + BASE["b2"] * weaker * plane
    return heave, pitch, -BASE["u0"] * lost * x[2]


def water(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return 0.0, 0.0, 0.12 * (time > WHEN)


def slipped(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    zero = 0.03 * (time > WHEN)
    return BASE["b1"] * zero, BASE["b2"] * zero, 0.0


NAMED = {
    "trim": (trim, "trim_moment_change", "c_qb", 0.05),
    "slower": (slower, "speed_change", "speed_step", -0.1),
    "water": (water, "current_change", "current_step", 0.12),
    "slipped": (slipped, "rudder_offset_change", "rudder_step", 0.03),
}


@pytest.mark.long
@pytest.mark.parametrize(
    ("what", "alarms"),
    [
        *(pytest.param(what, (), id=what) for what in NAMED),
        pytest.param("trim", (TOLD,), id="trim, alarm"),
        pytest.param("slower", (TOLD,), id="slower, alarm"),
    ],
)
def test_what_changed_is_named_with_its_size_and_its_moment(what: str, alarms: tuple[float, ...]) -> None:
    extra, name, parameter, size = NAMED[what]
    found = diagnose([replace(hidden_dive(extra, seed=4, duration=90.0), alarms=alarms)])
    assert found.verdict == "explained"
    (effect,) = found.effects
    assert effect.name == name
    value, std, _ = effect.coefficients[parameter]
    assert abs(value - size) < 4.0 * std
    moment, std, _ = effect.coefficients[f"{name}_time"]
    assert abs(moment - WHEN) < max(4.0 * std, 0.2)


@pytest.mark.long
def test_a_pitch_sensor_that_is_knocked_is_named_without_an_alarm() -> None:
    dive = hidden_dive(seed=4, duration=120.0)
    found = diagnose([replace(dive, pitch=dive.pitch + 0.05 * (dive.time > WHEN))])
    assert [effect.name for effect in found.effects] == ["pitch_bias_change"]


def test_a_change_that_shows_has_all_others_tried() -> None:
    fitter = Fitter([hidden_dive(trim, seed=4, duration=80.0)])
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.root)
        assert eligible(search) == CATALOGUE
        search.remember(fitter.grown(fitter.root, "actuator_lag", []))
        assert eligible(search) == CATALOGUE
        ballast = search.remember(fitter.grown(fitter.root, "ballast_change", []))
        assert eligible(search) == (*CATALOGUE, *CHANGES)
        exchanged(search, ballast)
        likeliest = min(search.tried.values(), key=lambda e: e.bic)
        assert "trim_moment_change" in likeliest.names


def test_a_change_that_nobody_noted_is_charged() -> None:
    dive = hidden_dive(trim, seed=4, duration=60.0)
    noted = Fitter([replace(dive, alarms=(50.0,))])
    unnoted = Fitter([dive], known=noted.base)
    for name, charge in (("trim_moment_change", 6.0), ("ballast_change", 0.0)):
        one = noted.grown(noted.root, name, [])
        assert unnoted.bic(one.fit, one.names) - one.bic == pytest.approx(charge)


def test_nothing_is_said_to_have_changed_after_a_false_alarm() -> None:
    found = diagnose([replace(hidden_dive(seed=4, duration=120.0), alarms=(TOLD,))])
    assert found.verdict == "no_mismatch"


def test_only_an_alarm_has_changes_tried_and_only_near_it() -> None:
    dive = hidden_dive()
    assert Fitter([dive]).candidates == CATALOGUE
    alarmed = Fitter([replace(dive, time=dive.time + 1000.0, alarms=(1000.0 + TOLD,))])
    assert alarmed.candidates == (*CATALOGUE, *CHANGES)
    assert alarmed.held["moments_first"] == pytest.approx(1000.0)
    assert alarmed.held["moments_last"] == pytest.approx(dive.time[-1] + 1000.0)


def test_the_part_around_an_alarm_is_looked_at_and_told() -> None:
    dive = hidden_dive(duration=30.0)
    long = replace(
        dive,
        time=np.arange(12000) * 0.1,
        **{
            name: np.tile(getattr(dive, name), 40)
            for name in ("depth", "pitch", "rudder", "speed", "pitch_rate")
        },
    )
    assert around_alarm([long]) == [long]
    (part,) = around_alarm([replace(long, alarms=(700.0, 900.0))])
    assert part.alarms == (700.0,)
    assert part.time[0] == pytest.approx(400.0)
    assert part.time[-1] == pytest.approx(999.9)
    assert "700 s, 900 s" in part.notes[-1]
    (whole,) = around_alarm([replace(long, alarms=(12.0,))])
    assert whole.time.size == long.time.size
    assert whole.alarms == ()
    (quick,) = around([replace(long, step=0.02)], 700.0)
    assert quick.time[0] == pytest.approx(620.0)


def test_what_judges_lies_on_both_sides_of_a_change() -> None:
    dive = hidden_dive(duration=300.0)
    spans = divide([replace(dive, alarms=(200.0,))]).judging
    assert [(span.time[0], span.time[-1]) for span in spans] == [
        pytest.approx((40.0, 69.9), abs=0.2),
        pytest.approx((235.0, 264.9), abs=0.2),
    ]
    (span,) = divide([replace(dive, alarms=(290.0,))]).judging
    assert span.time[-1] < 200.0


def test_a_moment_outside_the_recording_is_an_error() -> None:
    with pytest.raises(RecordingError, match=r"--around 5000: no stretch holds .* \(hidden.csv 0 to 30 s\)"):
        around([hidden_dive(duration=30.0)], 5000.0)
    with pytest.raises(RecordingError, match="and 30 s before it"):
        around([hidden_dive(duration=30.0)], 5.0)


@pytest.mark.parametrize("change", ["speed_change", "speed_change_at_any_moment"])
def test_a_change_of_no_size_leaves_the_speed_that_is_lost_as_it_is(change: str) -> None:
    dive = hidden_dive(duration=30.0)
    runs = []
    for names in (("speed_loss",), ("speed_loss", change)):
        structure = structure_of(names)
        known = {**BASE, "speed_time": 5.0, "c_ud": 2.0, "c_uq": 1.0, "speed_change_time": 10.0, LAST: 30.0}
        parameters = np.array([known.get(name, 0.0) for name in structure.names])
        runs.append(
            free_run(parameters, np.array([0.0, 0.0, 0.0, 20.0, 0.0]), inputs_of(dive, structure)).outputs
        )
    np.testing.assert_array_equal(*runs)


@pytest.mark.parametrize("name", [*SCANS])
def test_a_change_at_a_tried_moment_is_that_change(name: str) -> None:
    dive = hidden_dive(duration=30.0)
    beside = ("speed_loss", "munk_moment", "heave_quadratic_drag", "rudder_stall", "rudder_offset")
    known = {**BASE, "speed_time": 5.0, "c_ud": 2.0, "c_uq": 1.0, "c_qw": 0.4, "c_ww": -1.0}
    known |= {"rudder_zero": 0.02, "stall_angle": 0.15, "stall_loss": 1.0, "stall_share": 0.5, LAST: 30.0}
    entry = BY_NAME[name]
    size, when = entry.parameters[:2]
    tried = {sizes(name)[7]: 0.01}
    alone = {size.name: 0.01, when.name: 30.0 * 8 / (COUNT + 1)}

    def run(effects: tuple[str, ...], values: dict[str, float]) -> Array:
        structure = structure_of(effects)
        parameters = np.array([(known | values).get(p, 0.0) for p in structure.names])
        return free_run(parameters, np.array([0.0, 0.0, 0.0, 20.0, 0.0]), inputs_of(dive, structure)).outputs

    nothing = run(beside, {})
    one, other = run((*beside, SCANS[name].name), tried), run((*beside, name), alone)
    assert np.abs(one - nothing).max() > 1e-4
    # A speed takes a moment to change.
    np.testing.assert_allclose(one - nothing, other - nothing, atol=0.05 * np.abs(one - nothing).max())


def test_a_low_centre_of_gravity_feels_how_quickly_the_speed_changes() -> None:
    dive = hidden_dive(duration=40.0)
    dive = replace(dive, rudder=np.zeros(dive.time.size))
    structure = structure_of(("speed_change", "surge_pitch_coupling"))
    runs = []
    for settling in (0.0, 2.0, 1e3):
        known = {**BASE, "speed_step": -0.2, "speed_change_time": 10.0, "speed_settling": settling}
        known |= {"pendulum_share": 1.0}
        parameters = np.array([known.get(name, 0.0) for name in structure.names])
        pitch, _ = free_run(
            parameters, np.array([0.0, 0.0, 0.0, 20.0, 0.0]), inputs_of(dive, structure)
        ).outputs
        runs.append(pitch)
        assert np.abs(pitch[dive.time < 9.5]).max() < 1e-6
    at_once, soon, hardly = (float(np.abs(pitch).max()) for pitch in runs)
    assert at_once > soon > 10.0 * hardly > 0.0


@pytest.mark.parametrize(("name", "change"), [("current_change", water), ("trim_moment_change", trim)])
def test_the_likeliest_moments_are_tried_with_all_that_else_is_likely(
    name: str, change: Callable[[float, Array, float], tuple[float, float, float]]
) -> None:
    fitter = Fitter([hidden_dive(change, seed=4, duration=60.0)])
    starts = [tuple(start[1:]) for _, start in probed(fitter, fitter.root, BY_NAME[name], [])]
    moments = _moments(fitter, name, fitter.root, None)
    expected = [(moment, *probe[2:]) for moment in moments for probe in BY_NAME[name].probes]
    assert len({moment for moment, *_ in expected}) >= 2
    np.testing.assert_allclose(starts[: len(expected)], expected)


@pytest.mark.parametrize(
    ("share", "twin"),
    [
        (0.0, {"ballast_change": {"c_wb": -BASE["a1"] * 0.2, "ballast_time": 10.0}}),
        (1.0, {"vertical_current": {"current": 0.2}}),
    ],
    ids=["a linear hull that enters it is moved as by a weight", "one that is carried along by a current"],
)
def test_water_that_moves_is_entered_or_carries_along(
    share: float, twin: dict[str, dict[str, float]]
) -> None:
    dive = hidden_dive(duration=30.0)
    dive = replace(dive, rudder=np.zeros(dive.time.size))  # a pitched hull has its weight not across it
    when = 10.0 if share == 0.0 else -1.0
    entered = {"current_step": 0.2, "current_change_time": when, "carried_share": share}
    runs = []
    for effects in ({"current_change": entered}, twin):
        structure = structure_of(tuple(effects))
        known = BASE | {name: value for values in effects.values() for name, value in values.items()}
        parameters = np.array([known.get(name, 0.0) for name in structure.names])
        runs.append(
            free_run(parameters, np.array([0.0, 0.0, 0.0, 20.0, 0.0]), inputs_of(dive, structure)).outputs
        )
    np.testing.assert_allclose(*runs, atol=1e-9)


@pytest.mark.parametrize("has_speed", [True, False])
def test_where_water_moves_a_measured_speed_may_not_be_through_it(has_speed: bool) -> None:
    dive = hidden_dive(water, seed=4, duration=60.0)
    speed = np.full(dive.time.size, BASE["u0"] if has_speed else np.nan)
    fitter = Fitter([replace(dive, speed=speed)])
    for name, is_there in (("current_change", has_speed), ("ballast_change", False)):
        found = all_beside(fitter, fitter.grown(fitter.root, name, []))
        assert ("speed_over_ground" in found.names) is is_there


@pytest.mark.parametrize(("when", "left"), [(-1.0, "rudder_offset"), (WHEN, "rudder_offset_change")])
def test_a_change_that_was_there_from_the_first_is_an_offset(when: float, left: str) -> None:
    def bent(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        zero = 0.02 * (time > when)
        return BASE["b1"] * zero, BASE["b2"] * zero, 0.0

    fitter = Fitter([hidden_dive(bent)])
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.base)
        start = np.array([0.02, max(when, 0.5)])
        changed = fitter.polished(fitter.grown(fitter.base, "rudder_offset_change", [start]))
        assert with_lasting_offsets(search, changed).names == {left}
