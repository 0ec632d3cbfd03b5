"""Vehicle files: the shipped ones are read, what is in force can be written and read, rules hold."""

import dataclasses
from math import inf, nan
from pathlib import Path
from typing import Any

import pytest

from bridge.mavlink_map import ServoTerm
from host.errors import ConfigError
from host.toml_config import to_toml
from host.vehicle import (
    Vehicle,
    default_vehicle,
    effective_table,
    effective_toml,
    read_vehicle,
    vehicle_from_table,
)

EXAMPLES = sorted((Path(__file__).parents[2] / "tools" / "examples").glob("*.toml"))


def read(tmp_path: Path, text: str) -> Vehicle:
    path = tmp_path / "vehicle.toml"
    path.write_text('name = "x"\nspeed = 2.0\n' + text)
    return read_vehicle(path)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_read_and_what_is_in_force_gives_it_back(path: Path, tmp_path: Path) -> None:
    vehicle = read_vehicle(path)
    assert vehicle_from_table(effective_table(vehicle), file="journal") == vehicle
    copy = tmp_path / "copy.toml"
    copy.write_text(effective_toml(vehicle))
    # A log or a folder is written as it resolved, absolute here.
    assert read_vehicle(copy) == dataclasses.replace(
        vehicle, journal=dataclasses.replace(vehicle.journal, folder=tmp_path / vehicle.journal.folder)
    )


def test_the_examples_are_there() -> None:
    assert {"demo", "ardusub_6dof", "nmea2000", "slocum"} <= {path.stem for path in EXAMPLES}


def test_the_estimator_takes_step_and_speed_of_the_vehicle(tmp_path: Path) -> None:
    vehicle = read(tmp_path, "[alignment]\nstep = 0.2\n[estimator.mils]\ninnovation_length = 3")
    assert (vehicle.estimator.step, vehicle.estimator.speed) == (0.2, 2.0)
    assert vehicle.estimator.mils.innovation_length == 3
    assert default_vehicle().estimator.step == default_vehicle().alignment.step


def test_a_vehicle_whose_estimator_has_another_step_is_refused() -> None:
    vehicle = default_vehicle()
    with pytest.raises(ValueError, match="estimator must have the vehicle's step"):
        dataclasses.replace(vehicle, estimator=dataclasses.replace(vehicle.estimator, step=0.3))


def test_what_the_file_names_is_relative_to_the_file(tmp_path: Path) -> None:
    vehicle = read(
        tmp_path,
        """
        [link]
        url = "log:dive.tlog"
        [journal]
        folder = "dives"
        [can]
        dbc = "own.dbc"
        signals = [{ quantity = "depth", message = "D", signal = "d" }]
        """,
    )
    assert vehicle.link.url == f"log:{tmp_path}/dive.tlog"
    assert vehicle.journal.folder == tmp_path / "dives"
    assert vehicle.can.dbc == str(tmp_path / "own.dbc")
    assert vehicle.state_file == tmp_path / "dives" / "x.state.json"


def test_a_rudder_may_be_a_mix_of_channels(tmp_path: Path) -> None:
    vehicle = read(
        tmp_path,
        "[[mavlink.rudder]]\nchannel = 5\nrad_per_us = 1\n[[mavlink.rudder]]\nchannel = 6\nrad_per_us = -1",
    )
    assert vehicle.mavlink.rudder == (
        ServoTerm(channel=5, rad_per_us=1.0),
        ServoTerm(channel=6, rad_per_us=-1.0),
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("schema = 2", "vehicle.toml: schema must be one of 1 (got 2)"),
        ("[link]\nurl = 'nowhere'", "vehicle.toml: link.url must be scheme:address"),
        ("[link]\nlog_speed = 0", "link.log_speed must be above 0 (got 0.0)"),
        ("[link]\nsilence = 0", "link.silence must be above 0 s (got 0.0)"),
        ("[link]\nreopen_for = -1", "link.reopen_for must be 0 s or more (got -1.0)"),
        ("[publish]\nperiod = 0", "publish.period must be at least 0.05 s (got 0.0)"),
        ("[journal]\nsync_period = 0", "journal.sync_period must be above 0 s (got 0.0)"),
        ("[state]\nperiod = 0", "state.period must be above 0 s (got 0.0)"),
        ("[alignment]\nstep = 0", "vehicle.toml: alignment.step must be 0.001 to 3600 s (got 0.0)"),
        ("[estimator]\nstep = 1", "estimator.step is given by alignment.step; leave it out here"),
        ("[estimator]\nspeed = 1", "estimator.speed is given by speed; leave it out here"),
        ("estimator = 1", "estimator must be a table (got 1)"),
        (
            "[estimator.mils]\ninnovation_length = 0",
            "estimator.mils.innovation_length must be from 1 to 64 (got 0)",
        ),
        ("[mavlink]\nrudder = [{ channel = 1 }]", "mavlink.rudder[0].rad_per_us is missing"),
        ("[mavlink]\nrudders = []", "mavlink.rudders is not a known key"),
        ("[csv]\ndepth = { column = 'd', unit = 'fathom' }", "csv.depth.unit must be one of m, cm, mm, ft"),
    ],
)
def test_a_broken_rule_names_the_key_that_the_user_wrote(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ConfigError) as error:
        read(tmp_path, text)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("first", "message"),
    [
        ('name = ""\nspeed = 1', "name must be 1 to 60 characters (got '')"),
        ('name = "x"', "speed is missing"),
        ('name = "x"\nspeed = 0', "vehicle.toml: speed must be "),
        ('name = "x"\nspeed = -1', "vehicle.toml: speed must be "),
        ('name = "x"\nspeed = inf', "vehicle.toml: speed must be "),
        ('name = "x"\nspeed = 21', "speed must be 0.05 to 20 m/s (got 21.0)"),
    ],
)
def test_name_and_speed_are_checked(tmp_path: Path, first: str, message: str) -> None:
    path = tmp_path / "vehicle.toml"
    path.write_text(first)
    with pytest.raises(ConfigError) as error:
        read_vehicle(path)
    assert message in str(error.value)


def test_the_meaning_of_a_state_changes_with_what_it_rests_on(tmp_path: Path) -> None:
    plain = read(tmp_path, "").meaning
    assert read(tmp_path, "[publish]\nperiod = 2\n[link]\nurl = 'udp:1'").meaning == plain
    for changed in (
        "[alignment]\nstep = 0.2",
        "[estimator]\nvalid_below = 0.05",
        "[mavlink]\nwater_density = 998",
    ):
        assert read(tmp_path, changed).meaning != plain


def float_keys(table: dict[str, Any], where: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    keys = []
    for key, value in table.items():
        if isinstance(value, dict):
            keys += float_keys(value, (*where, key))
        elif isinstance(value, float):
            keys.append((*where, key))
    return keys


MAY_BE_INFINITE = {
    "link.log_speed",
    "estimator.outlier_gate",
}
"""Keys that mean something at infinity."""


@pytest.mark.parametrize("path", float_keys(effective_table(default_vehicle())), ids=".".join)
def test_infinity_and_nan_pass_nowhere_without_a_meaning(path: tuple[str, ...]) -> None:
    for value in (inf, -inf, nan):
        table = effective_table(default_vehicle())
        inner = table
        for key in path[:-1]:
            inner = inner[key]
        inner[path[-1]] = value
        if value == inf and ".".join(path) in MAY_BE_INFINITE:
            vehicle_from_table(table, file="x")
        else:
            with pytest.raises(ConfigError, match=path[0]):
                vehicle_from_table(table, file="x")


def test_the_default_is_written_as_a_file_that_gives_it_back(tmp_path: Path) -> None:
    path = tmp_path / "vehicle.toml"
    path.write_text(to_toml(default_vehicle()))
    assert read_vehicle(path).estimator == default_vehicle().estimator
