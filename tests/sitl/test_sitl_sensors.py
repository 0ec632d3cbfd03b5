"""Noise, rates, losses and faults of the instruments, and the recordings that they make."""

from dataclasses import replace

import numpy as np
import pytest

from tools.sitl.plant import stream
from tools.sitl.recording import COLUMNS, measure, record, sail, write_csv, write_truth
from tools.sitl.scenario import Scenario, load
from tools.sitl.sensors import Channel, Instrument, Lag, Sensors

COUNT = 40_000


def instrument(**settings: float) -> Instrument:
    return Instrument(Channel(**settings), stream(5, "test"))


def test_perfect_instrument_tells_the_truth():
    truth = np.linspace(0.0, 1.0, 50)
    assert np.array_equal(instrument().says(truth), truth)


def test_noise_is_white_with_its_standard_deviation():
    noise = instrument(noise=0.01).says(np.zeros(COUNT))
    assert np.std(noise) == pytest.approx(0.01, rel=0.02)
    assert abs(np.mean(noise)) < 4 * 0.01 / COUNT**0.5
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 4 / COUNT**0.5


def test_quantum_is_the_resolution():
    values = instrument(noise=0.1, quantum=0.025).says(np.zeros(1000)) / 0.025
    assert np.allclose(values, np.round(values))
    assert len(np.unique(np.round(values))) > 10


@pytest.mark.parametrize("share", [0.05, 0.5])
def test_lost_share_is_as_asked(share):
    arrived = instrument(loss=share).arrives(np.arange(COUNT) * 0.1)
    assert 1 - np.mean(arrived) == pytest.approx(share, abs=4 * (share * (1 - share) / COUNT) ** 0.5)


def test_bursts_lose_connected_spans():
    arrived = instrument(burst_every_s=20.0, burst_s=2.0).arrives(np.arange(COUNT) * 0.1)
    assert 1 - np.mean(arrived) == pytest.approx(2 / 22, rel=0.25)
    edges = np.flatnonzero(np.diff(arrived.astype(int)) == -1)
    mean_length = np.sum(~arrived) / len(edges)
    assert mean_length == pytest.approx(20, rel=0.25)


def test_bursts_are_the_same_one_by_one():
    times = np.arange(2000) * 0.1
    whole = instrument(burst_every_s=20.0, burst_s=2.0).arrives(times)
    single = instrument(burst_every_s=20.0, burst_s=2.0)
    assert [not single.loses(t_s) for t_s in times] == whole.tolist()


def test_nan_and_outliers_have_their_shares():
    values = instrument(nan=0.1, outliers=0.05, outlier_size=5.0).says(np.zeros(COUNT))
    assert np.mean(np.isnan(values)) == pytest.approx(0.1, abs=0.01)
    wrong = values[np.isfinite(values) & (values != 0.0)]
    assert len(wrong) / COUNT == pytest.approx(0.05 * 0.9, abs=0.01)
    assert np.std(wrong) == pytest.approx(5.0, rel=0.1)


def test_jitter_stays_within_its_limit_and_in_order():
    times = instrument(jitter_s=0.04, rate_hz=10.0).times(100.0)
    off = times[1:] - np.arange(1, 1001) * 0.1
    assert 0.035 < np.max(np.abs(off)) <= 0.04
    assert np.all(np.diff(times) > 0)


def test_old_value_comes_under_a_fresh_stamp():
    sensors = Sensors(depth=Channel(latency_s=0.5))
    scenario = replace(load("linear_noise_free"), duration_s=20.0, sensors=sensors)
    truth = sail(scenario, 1)
    got = measure(scenario, 1, truth)
    assert got["depth_m"][50:] == pytest.approx(truth["depth_m"][450:-50:10], abs=1e-9)


def test_channels_of_different_rates_leave_cells_empty():
    sensors = Sensors(depth=Channel(rate_hz=2.0), speed=Channel(rate_hz=1.0))
    table = record(Scenario(duration_s=10.0, sensors=sensors), 1)
    assert len(table["time_s"]) == 101
    assert np.array_equal(np.flatnonzero(np.isfinite(table["depth_m"])), np.arange(0, 101, 5))
    assert np.array_equal(np.flatnonzero(np.isfinite(table["speed_mps"])), np.arange(0, 101, 10))


def test_recorded_rudder_is_the_one_in_force_from_then_on():
    scenario = replace(load("linear_noise_free"), duration_s=30.0)
    truth, table = sail(scenario, 1), record(scenario, 1)
    assert np.array_equal(
        table["rudder_rad"][:-1], truth["rudder_rad"][5::10]
    )  # in the middle of each interval


def test_measured_plane_differs_from_the_command_by_the_lag():
    scenario = replace(load("fin_damage"), duration_s=30.0)
    measured = replace(scenario, sensors=replace(scenario.sensors, rudder_is_measured=True))
    assert np.max(np.abs(record(measured, 1)["rudder_rad"] - record(scenario, 1)["rudder_rad"])) > 0.05


@pytest.mark.parametrize("time_s", [0.03, 0.5])
def test_lag_shows_a_ramp_late_by_its_time_whatever_the_step(time_s: float):
    for step_s in (0.005, 0.02):
        lag = Lag(time_s, step_s)
        shown = [lag.follow(3.0 * step_s * k) for k in range(round(4.0 / step_s))]
        assert shown[-1] == pytest.approx(3.0 * (step_s * (len(shown) - 1) - time_s), abs=2e-3)
    assert [Lag(0.0, 0.01).follow(value) for value in (1.0, 2.0)] == [1.0, 2.0]


def test_record_is_determined_by_the_seed():
    scenario = replace(load("rough_sea"), duration_s=20.0)
    first, again, other = record(scenario, 4), record(scenario, 4), record(scenario, 5)
    for column in ("time_s", *COLUMNS.values()):
        assert np.array_equal(first[column], again[column], equal_nan=True)
    assert not np.array_equal(first["pitch_rad"][:100], other["pitch_rad"][:100], equal_nan=True)


def test_noise_of_one_channel_leaves_the_others_alone():
    quiet = Scenario(duration_s=10.0)
    noisy = replace(quiet, sensors=Sensors(depth=Channel(noise=1.0)))
    first, second = record(quiet, 1), record(noisy, 1)
    assert np.array_equal(first["pitch_rad"], second["pitch_rad"])
    assert np.std(first["depth_m"] - second["depth_m"]) > 0.5


def test_default_demonstration_has_the_stated_noise():
    scenario = load("default")
    truth = sail(scenario, 1)
    table = measure(scenario, 1, truth)
    assert np.std(table["depth_m"] - truth["depth_m"][::10]) == pytest.approx(0.01, rel=0.05)
    assert np.std(np.degrees(table["pitch_rad"] - truth["pitch_rad"][::10])) == pytest.approx(0.1, rel=0.05)


def test_text_files_hold_what_was_recorded(tmp_path):
    scenario = replace(load("fin_damage"), duration_s=200.0)
    truth = sail(scenario, 3)
    table = measure(scenario, 3, truth)
    write_csv(tmp_path / "rec.csv", table)
    write_truth(tmp_path / "truth.csv", scenario, truth)
    back = np.genfromtxt(tmp_path / "rec.csv", delimiter=",", names=True)
    assert back.dtype.names == ("time_s", *COLUMNS.values())
    assert np.allclose(back["pitch_rad"], table["pitch_rad"], rtol=1e-8)
    lines = (tmp_path / "truth.csv").read_text().splitlines()
    assert len(lines) == 2002
    assert "rudder_effectiveness_change" not in lines[1000]
    assert "rudder_effectiveness_change=0.35 share" in lines[-1]
