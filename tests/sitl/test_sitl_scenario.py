"""Scenario files: what they say and how a slip is answered."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tools.sitl.errors import ScenarioError
from tools.sitl.scenario import SCENARIOS, Scenario, load, parse
from tools.sitl.strict import build

SHIPPED = sorted(path.stem for path in SCENARIOS.glob("*.toml"))


def test_an_empty_file_is_the_paper_vehicle():
    assert parse("") == Scenario()
    assert parse("").effects.at_work(1e9) == {}


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenario_loads_under_its_own_name(name):
    assert load(name).name == name


def test_shipped_scenarios_are_the_documented_ones():
    assert SHIPPED == [
        "calm_sea",
        "default",
        "fin_damage",
        "fin_lost",
        "linear_noise_free",
        "rough_sea",
        "sparse_telemetry",
    ]


def test_realistic_flavour_is_a_start_that_the_file_may_change():
    scenario = parse('flavour = "realistic"\n[effects]\nactuator_lag = 0.0\ntrim_moment = 1\n')
    assert set(scenario.effects.at_work(0.0)) == {
        "heave_pitch_rate_coupling",
        "large_angle_restoring",
        "large_angle_kinematics",
        "trim_moment",
    }


def test_relative_files_are_looked_for_beside_the_scenario(tmp_path):
    (tmp_path / "mine.toml").write_text("")
    assert Path(load(str(tmp_path / "mine.toml")).folder) == tmp_path


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("duration = 3", "duration is not known; known: name, flavour, duration_s"),
        ("[effects]\nheave_drag = 1", "effects.heave_drag is not known; known: heave_pitch_rate_coupling"),
        ("[effects.ballast_change]\nmass = 1", "effects.ballast_change.mass is not known; known: size, at_s"),
        ("[effects]\nballast_change = 1", "effects.ballast_change must be a table"),
        ('flavour = "salty"', "flavour must be one of linear, realistic"),
        ('duration_s = "long"', "duration_s must be of type float"),
        ("duration_s = true", "duration_s must be of type float"),
        ("duration_s = nan", "duration_s must be finite"),
        ("duration_s = 1" + 400 * "0", "duration_s must be finite"),
        ("duration_s = -1", "duration_s must be >= 0 s"),
        ("seed = 1.5", "seed must be of type int"),
        ("seed = -1", "seed must be >= 0"),
        ("step_s = 0.03", "excitation.update_s must be a multiple of step_s"),
        ("[start]\nspeed = 0", "start.speed must be > 0 m/s"),
        (
            "[hull]\nZqdot = 500.0\nMwdot = 500.0",
            "hull.Zqdot [*] Mwdot must leave the inertia matrix positive",
        ),
        ("[sensors.depth]\nloss = 1.5", r"sensors.depth.loss must be in \[0, 1\]"),
        ("[sensors.depth]\njitter_s = 0.05", r"sensors.depth.jitter_s must be in \[0, half a sample\)"),
        ("[sensors.sonar]\nnoise = 1", "sensors.sonar is not known; known: depth, pitch, rudder"),
        ('[excitation]\nprogram = "square"', "excitation.program must be one of none, multistep"),
        ('[excitation]\nprogram = "csv"', "excitation.file must be given"),
        ("[excitation]\nhold_min_s = 0.01", "excitation.hold_min_s must be >= update_s"),
        ("[effects.surface_waves]\nsize = -1", "effects.surface_waves.size must be >= 0 m"),
        ("[effects]\nactuator_lag = -0.1", "effects.actuator_lag must be >= 0"),
        ("[mavlink]\nsystem = 255", "mavlink.system must be in 1..254"),
        ("[mavlink.rates]\nattitude = 500", r"mavlink.rates.attitude must be in \[0, 200\] Hz"),
        ("effects = 3", "effects must be a table"),
        ('flavour = "realistic"\neffects = 3', "effects must be a table"),
        ("[[[", "not TOML"),
    ],
)
def test_slip_is_answered_in_one_line(text, says):
    with pytest.raises(ScenarioError, match=says) as caught:
        parse(text)
    assert "\n" not in str(caught.value)


def test_missing_file_names_the_shipped_ones():
    with pytest.raises(ScenarioError, match=r"no_such cannot be read: .*; shipped ones: calm_sea, default"):
        load("no_such")


def test_file_that_is_not_text_is_refused(tmp_path):
    (tmp_path / "x.toml").write_bytes(b"\xff\xfe\x00garbage")
    with pytest.raises(ScenarioError, match="not UTF-8"):
        load(str(tmp_path / "x.toml"))


def test_message_names_the_file(tmp_path):
    path = tmp_path / "x.toml"
    path.write_text("seed = -1")
    with pytest.raises(ScenarioError, match=r"x\.toml: seed must be >= 0"):
        load(str(path))


TABLES = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5)),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["seed", "effects", "start", "speed", "size", "sensors", "depth", "x"]), inner
        )
    ),
    max_leaves=8,
)


@given(TABLES)
def test_any_table_is_a_scenario_or_refused(table):
    try:
        assert isinstance(build(Scenario, table), Scenario)
    except ScenarioError as error:
        assert "\n" not in str(error)  # noqa: PT017
