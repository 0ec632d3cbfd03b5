"""Tables onto whose clock readings were drawn, about one a row: only rows that share no reading count."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.recordings.blended import blended_in, with_readings_apart
from host.noise.noise_floor import noise_floor
from host.recordings.recording import Recording

SENSORS = np.array([np.deg2rad(0.1), 0.01])  # rad, m: deviations of hidden_dive's
SLIP = 1.0037  # of a row: how much longer the rows of the other clock are


@cache
def dive() -> Recording:
    return hidden_dive(duration=180.0)


def drawn(recording: Recording, swings: bool = False) -> Recording:
    """The same on another clock: straight lines between readings, and the plane held."""
    step = SLIP * recording.step
    time = 0.03 + step * np.arange(int(recording.duration / step) - 1)
    rudder = recording.rudder[np.searchsorted(recording.time, time, side="right") - 1]
    return replace(
        recording,
        time=time,
        step=step,
        pitch=np.interp(time, recording.time, recording.pitch),
        depth=np.interp(time, recording.time, recording.depth),
        rudder=rudder + 0.01 * np.sin(time) * swings,
        speed=np.full_like(time, np.nan),
        pitch_rate=np.full_like(time, np.nan),
    )


def test_every_other_row_of_a_table_that_blends_readings_counts() -> None:
    table = drawn(dive())
    (found,) = with_readings_apart([table])
    for before, after in ((table.pitch, found.pitch), (table.depth, found.depth)):
        rows = np.flatnonzero(np.isfinite(after))
        assert np.array_equal(rows, np.arange(0, before.size, 2))
        assert np.array_equal(after[rows], before[rows])
    assert any("lies between two readings" in note for note in found.notes)
    # The shares of two readings leave two thirds of a reading's variance.
    assert np.sqrt(noise_floor([found])) == pytest.approx(np.sqrt(2.0 / 3.0) * SENSORS, rel=0.12)
    assert (np.sqrt(noise_floor([table])) < 0.7 * SENSORS).all()


def test_a_plane_that_steps_may_have_done_so_between_the_rows_of_such_a_table() -> None:
    (found,) = with_readings_apart([drawn(dive())])
    assert found.plane is not None
    assert found.plane.is_doubtful
    assert found.plane.steps.size > 20
    assert found.plane.mean_moments == pytest.approx(0.5)
    (swinging,) = with_readings_apart([drawn(dive(), swings=True)])
    assert swinging.plane is None


def test_one_channel_may_be_blended_alone() -> None:
    table = drawn(dive())
    noise = np.random.default_rng(4).normal(0.0, SENSORS[0], table.time.size)
    smooth = np.interp(table.time, dive().time, hidden_dive(duration=180.0, noise=0.0).pitch)
    (found,) = with_readings_apart([replace(table, pitch=smooth + noise)])
    assert np.isfinite(found.pitch).all()
    assert np.isfinite(found.depth).sum() == (found.depth.size + 1) // 2
    assert found.plane is None


def test_stretches_of_one_table_are_judged_together() -> None:
    table = drawn(dive())
    cut = (0.0, 60.0), (62.0, 120.0), (122.0, 180.0)
    pieces = [table.between(*span) for span in cut]
    assert blended_in(pieces) == ["pitch", "depth"]
    assert blended_in(pieces[:1]) == []  # too few rows to tell


@pytest.mark.parametrize("seed", range(6))
def test_readings_in_their_own_rows_all_count(seed: int) -> None:
    recording = hidden_dive(seed=seed, duration=180.0)
    assert with_readings_apart([recording])[0] is recording


def test_quick_motion_between_coarse_rows_is_no_blend() -> None:
    """Of every other row of a dive whose plane steps: its motion falls with frequency as well."""
    dives = [hidden_dive(seed=seed, duration=320.0, noise=0.3) for seed in range(3)]
    coarse = [
        replace(
            one,
            **{name: getattr(one, name)[::2] for name in ("time", "pitch", "depth", "speed", "pitch_rate")},
            rudder=one.rudder.reshape(-1, 2).mean(axis=1),
            step=2.0 * one.step,
        )
        for one in dives
    ]
    assert [blended_in([one]) for one in coarse] == [[], [], []]


def test_rounded_channels_and_those_without_noise_are_left_alone() -> None:
    table = drawn(dive())
    rounded = replace(table, depth=np.round(table.depth, 1), pitch=np.round(table.pitch, 2))
    assert with_readings_apart([rounded])[0] is rounded
    exact = drawn(hidden_dive(duration=180.0, noise=0.0))
    assert with_readings_apart([exact])[0] is exact
