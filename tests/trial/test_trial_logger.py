"""What a logger keeps of a recording."""

from dataclasses import replace

import numpy as np
import pytest

from tools.trial.deck import Card
from tools.trial.draw import draw
from tools.trial.logger import DEPTH_HZ, TIME_STEPS, Logger


@pytest.fixture
def table() -> dict[str, np.ndarray]:
    time = np.arange(100) / 10.0
    return {"time_s": time, "depth_m": 10.0 + time, "pitch_rad": 0.01 * time, "rudder_rad": np.floor(time)}


def test_slow_channels_are_empty_held_or_on_a_line(table: dict[str, np.ndarray]) -> None:
    logger = Logger(every={"depth_m": 5})
    empty = logger.kept(table)
    assert np.array_equal(np.flatnonzero(np.isfinite(empty["depth_m"])), np.arange(0, 100, 5))
    assert np.array_equal(empty["pitch_rad"], table["pitch_rad"])
    last = replace(logger, fill="last").kept(table)
    assert np.array_equal(last["depth_m"], np.repeat(table["depth_m"][::5], 5))
    line = replace(logger, fill="line").kept(table)
    assert line["depth_m"][:96] == pytest.approx(table["depth_m"][:96])


def test_lost_rows_are_lost_in_all_columns_and_the_same_ones_again(table: dict[str, np.ndarray]) -> None:
    logger = Logger(every={}, lost=0.3, seed=4)
    rows = logger.rows(100)
    assert rows[0] == 0
    assert 55 < rows.size < 85
    kept = logger.kept(table)
    assert all(np.array_equal(kept[name], table[name][rows]) for name in table)


def test_times_are_rounded_down_and_readings_are_not_moved(table: dict[str, np.ndarray]) -> None:
    logger = Logger(every={"depth_m": 2}, time_step=1.0)
    assert np.array_equal(logger.kept(table)["time_s"], np.repeat(np.arange(10.0), 10))
    assert np.array_equal(logger.readings(table)["time_s"], table["time_s"])


def test_every_fault_is_drawn_and_is_absent_from_many() -> None:
    rng = np.random.default_rng(1)
    drawn = [Logger.drawn(rng, 10.0) for _ in range(200)]
    assert {one.fill for one in drawn} == {"empty", "last", "line"}
    assert {one.time_step for one in drawn} == {0.0, *TIME_STEPS}
    assert {one.every.get("depth_m", 1) for one in drawn} == {1, *(round(10.0 / rate) for rate in DEPTH_HZ)}
    assert 20 < sum(one.lost > 0.0 for one in drawn) < 80
    assert 40 < sum("rudder_rad" in one.every for one in drawn) < 100


def test_a_trial_as_logged_flies_the_same_vehicles_and_tells_which_rows_are_kept() -> None:
    card = Card("none", ())
    plain, logged = draw(5, 9, card), draw(5, 9, card, is_logged=True)
    assert plain.answer.base == logged.answer.base
    assert plain.answer.floor.rows is None
    rows = logged.answer.floor.rows
    assert rows is not None
    assert len(rows) == len(logged.table["time_s"]) <= len(plain.table["time_s"])
    assert "fill" in logged.answer.outing
