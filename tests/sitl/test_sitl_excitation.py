"""The programs of the stern plane."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tools.sitl.errors import ScenarioError
from tools.sitl.excitation import Commander, Excitation, make_law
from tools.sitl.plant import stream
from tools.sitl.recording import sail
from tools.sitl.scenario import Scenario, Start, load


def command(duration_s: float = 60.0, seed: int = 1, **settings: object) -> np.ndarray:
    """The command of an open-loop program at each update."""
    excitation = Excitation(**settings)
    law = make_law(excitation, 0.0, Path(), stream(seed, "excitation"))
    commander = Commander(excitation, law)
    return np.array([commander.command(k * 0.1, 0.0, 0.0, 0.0) for k in range(round(duration_s * 10) + 1)])


def holds(values: np.ndarray) -> list[tuple[float, int]]:
    return [(value, len(list(group))) for value, group in itertools.groupby(values.tolist())]


def test_multistep_holds_random_levels_within_its_limits():
    levels = holds(command(600.0, program="multistep", amplitude=0.2, hold_min_s=2.0, hold_max_s=5.0))[:-1]
    assert all(abs(level) <= 0.2 for level, _ in levels)
    assert all(20 <= length <= 50 for _, length in levels)
    assert np.std([level for level, _ in levels]) == pytest.approx(0.2 / 3**0.5, rel=0.2)


def test_multistep_keeps_its_integral_bounded():
    free = command(3000.0, drift_limit=0.0)
    bound = command(3000.0, drift_limit=1.0)
    largest = 1.0 + 0.25 * 8.0
    assert np.max(np.abs(np.cumsum(bound) * 0.1)) <= largest
    assert np.max(np.abs(np.cumsum(free) * 0.1)) > largest


def test_command_has_its_resolution_and_changes_only_at_updates():
    scenario = Scenario(excitation=Excitation(program="multisine"), duration_s=20.0)
    rudder = sail(scenario, 1)["rudder_rad"]
    assert np.allclose(rudder * 1000, np.round(rudder * 1000), atol=1e-9)
    assert set(np.flatnonzero(np.diff(rudder) != 0.0) % 10) == {9}


def test_3211_has_its_shape():
    levels = holds(command(program="3211", amplitude=0.1, pulse_s=1.0, rest_s=4.0, start_s=2.0))
    expected = [(0.0, 20), (0.1, 30), (-0.1, 20), (0.1, 10), (-0.1, 10), (0.0, 40), (-0.1, 30), (0.1, 20)]
    assert levels[:8] == expected


def test_doublets_go_to_both_sides():
    levels = holds(command(program="doublets", amplitude=0.1, pulse_s=0.5, rest_s=1.0))
    assert levels[:4] == [(0.1, 5), (-0.1, 5), (0.0, 10), (0.1, 5)]


def test_sine_has_its_frequency():
    rudder = command(100.0, program="sine", amplitude=0.2, frequency_hz=0.1, quantum=0.0)
    expected = 0.2 * np.sin(2 * np.pi * 0.1 * np.arange(1001) * 0.1)
    assert rudder == pytest.approx(expected, abs=1e-12)


def test_multisine_has_power_at_its_tones_only():
    rudder = command(1000.0, program="multisine", tones=3, band_low_hz=0.1, band_high_hz=0.9, quantum=0.0)[
        :-1
    ]
    power = np.abs(np.fft.rfft(rudder)) ** 2
    tones = np.round(np.geomspace(0.1, 0.9, 3) * 1000).astype(int)
    near = np.unique(np.concatenate([tones + k for k in range(-3, 4)]))
    assert np.sum(power[near]) > 0.97 * np.sum(power)


def test_depth_autopilot_reaches_its_depths():
    excitation = Excitation(program="depth_steps", depth_step=3.0, depth_hold_s=40.0, dither=0.02)
    truth = sail(Scenario(excitation=excitation, start=Start(depth=20.0), duration_s=400.0), 2)
    assert np.ptp(truth["depth_m"]) > 1.5
    assert np.max(np.abs(truth["depth_m"] - 20.0)) < 4.0
    assert np.max(np.abs(truth["rudder_rad"])) <= 0.25


def test_idle_program_holds_zero():
    assert not np.any(command(program="none"))


def test_file_is_followed_and_its_last_value_held(tmp_path):
    (tmp_path / "r.csv").write_text("time_s,rudder_rad\n10,0.1\n12,-0.05\n13,0.02\n")
    excitation = Excitation(program="csv", file="r.csv")
    rudder = sail(Scenario(excitation=excitation, folder=str(tmp_path), duration_s=5.0), 1)["rudder_rad"][
        ::10
    ]
    assert holds(rudder) == [(0.1, 20), (-0.05, 10), (0.02, 21)]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (None, "cannot be read"),
        ("time_s,angle\n0,1\n", "numbers in time_s and rudder_rad"),
        ("time_s,rudder_rad\n0,left\n", "numbers in time_s and rudder_rad"),
        ("time_s,rudder_rad\n0,nan\n", "finite"),
        ("time_s,rudder_rad\n", "at least one row"),
        ("time_s,rudder_rad\n1,0\n0,0\n", "rising time_s"),
    ],
)
def test_unusable_file_is_refused(tmp_path, text, says):
    if text is not None:
        (tmp_path / "r.csv").write_text(text)
    scenario = Scenario(excitation=Excitation(program="csv", file="r.csv"), folder=str(tmp_path))
    with pytest.raises(ScenarioError, match=says):
        sail(scenario, 1)


def test_programs_depend_on_the_seed_only():
    assert np.array_equal(command(seed=4), command(seed=4))
    assert not np.array_equal(command(seed=4), command(seed=5))
    noisy = replace(load("default"), duration_s=60.0)
    assert np.array_equal(sail(noisy, 4)["rudder_rad"][::10], command(seed=4))
