"""Spikes are found in every kind of recording, and no motion is taken for one."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from exact_dive import TABLE_1, Dive, fly
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import lfilter

from host.dynamics.equations import NAMES
from host.identification.identify import identify
from host.identification.model import VehicleModel
from host.identification.predict import predict
from host.recordings.outliers import outliers, without_outliers
from host.recordings.recording import Array, Recording, notes_of
from host.vehicle import default_vehicle

LEVELS = {"pitch": float(np.deg2rad(20.0)), "depth": 3.0}
Mask = NDArray[np.bool_]


def spoilt(
    recording: Recording, share: float, longest: int = 1, seed: int = 0
) -> tuple[Recording, dict[str, Mask]]:
    """With spikes of once or twice `LEVELS`, up to `longest` in a row and then some rows apart; and where."""
    rng = np.random.default_rng(seed)
    channels, where = {}, {}
    for name, level in LEVELS.items():
        spikes, at = np.zeros(recording.time.size, dtype=bool), 0
        while (at := at + longest + 2 + int(rng.exponential(0.5 * (longest + 1) / share))) < spikes.size:
            spikes[at : at + rng.integers(1, longest + 1)] = True
        sizes = level * rng.choice([-1.0, 1.0], spikes.size) * rng.uniform(1.0, 2.0, spikes.size)
        values = getattr(recording, name)
        channels[name], where[name] = values + spikes * sizes, spikes & np.isfinite(values)
    return replace(recording, **channels), where


def held(rows: int, step: float, levels: list[tuple[float, float]]) -> Array:
    """A rudder that takes each value (second) for so many seconds (first), over and over."""
    edges = np.cumsum([0.0, *(length for length, _ in levels)])
    phase = np.mod(np.arange(rows) * step, edges[-1])
    return sum(
        np.where((phase >= start) & (phase < end), value, 0.0)
        for (start, end), (_, value) in zip(pairwise(edges), levels, strict=True)
    ) + np.zeros(rows)


def clean(kind: str, step: float, noise: float, seed: int) -> Recording:
    """150 s, at most 1500 rows; `noise` of the pitch in deg, ten times as many cm of the depth."""
    rows = min(round(150.0 / step), 1500)
    rudder = {
        "3-2-1-1": held(rows, step, [(9.0, 0.0), (3.0, 0.3), (2.0, -0.3), (1.0, 0.3), (1.0, -0.3)]),
        "steps": held(rows, step, [(17.0, 0.1), (23.0, -0.2)]),
        "rest": np.zeros(rows),
    }.get(kind)
    dive = Dive(
        seed=seed,
        step=step,
        duration=rows * step,
        rudder=rudder,
        pitch_noise=float(np.deg2rad(noise)),
        depth_noise=0.1 * noise,
        missing=0.3 if kind == "losses" else 0.0,
    )
    recording, _ = fly(dive)
    rng = np.random.default_rng([seed, 2])
    if kind == "coarse" or kind == "rest":
        recording = replace(recording, depth=0.1 * np.round(recording.depth / 0.1))
    if kind == "gaps":
        for start in rng.integers(0, rows, 5):
            recording.depth[start : start + rows // 30] = np.nan
    if kind == "wandering":
        kept = np.exp(-step / 2.0)
        kicks = np.sqrt(1.0 - kept**2) * rng.standard_normal((2, rows))
        recording.pitch[:] += np.deg2rad(0.3) * lfilter([1.0], [1.0, -kept], kicks[0])
        recording.depth[:] += 0.05 * lfilter([1.0], [1.0, -kept], kicks[1])
    if kind == "waves":
        for period in (3.8, 4.0, 4.3):
            swing = np.sin(2.0 * np.pi * recording.time / period + rng.uniform(0.0, 6.0))
            recording.pitch[:] += np.deg2rad(2.0) * swing
            recording.depth[:] += 0.15 * swing
    return recording


KINDS = ["multistep", "3-2-1-1", "steps", "rest", "coarse", "losses", "gaps", "wandering", "waves"]


@pytest.mark.parametrize("step", [0.02, 0.1, 0.5])
@pytest.mark.parametrize("kind", KINDS)
def test_no_motion_is_taken_for_a_spike(kind: str, step: float) -> None:
    for seed, noise in enumerate((0.02, 0.1, 0.5)):
        recording = clean(kind, step, noise, seed)
        (kept,) = without_outliers([recording])
        np.testing.assert_array_equal(kept.pitch, recording.pitch)
        np.testing.assert_array_equal(kept.depth, recording.depth)
        assert kept.notes == ()


@pytest.mark.parametrize(("share", "longest"), [(0.001, 1), (0.01, 1), (0.01, 3), (0.05, 1), (0.05, 3)])
@pytest.mark.parametrize("kind", ["multistep", "coarse", "wandering", "waves"])
def test_spikes_are_left_out_and_nothing_else(kind: str, share: float, longest: int) -> None:
    recording, where = spoilt(clean(kind, 0.1, 0.1, 0), share, longest)
    for name, spikes in where.items():
        found = outliers(recording.time, getattr(recording, name))
        np.testing.assert_array_equal(found, spikes)


@settings(deadline=None, max_examples=12)
@given(
    st.sampled_from([0.05, 0.1, 0.2]),
    st.floats(0.02, 0.5),
    st.sets(st.integers(0, 24), max_size=8),
    st.integers(0, 2**16),
)
def test_single_spikes_are_found_wherever_they_are(
    step: float, noise: float, places: set[int], seed: int
) -> None:
    recording = fly(Dive(seed=seed, step=step, duration=200 * step, depth_noise=0.1 * noise, amplitude=0.15))[
        0
    ]
    spikes = np.zeros(200, dtype=bool)
    spikes[[8 * place + 3 for place in places]] = True
    found = outliers(recording.time, recording.depth + 10.0 * spikes)
    np.testing.assert_array_equal(found, spikes)


@settings(deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(1e-6, 1e3), st.floats(-1e6, 1e6) | st.just(np.nan)), min_size=26, max_size=60
    )
)
def test_any_numbers_at_any_times_are_answered(drawn: list[tuple[float, float]]) -> None:
    intervals, values = np.array(drawn).T
    found = outliers(np.cumsum(intervals), values)
    assert not (found & np.isnan(values)).any()
    assert found.sum() <= 0.5 * np.isfinite(values).sum()


def test_units_change_nothing() -> None:
    recording, _ = spoilt(clean("multistep", 0.1, 0.1, 1), 0.02)
    found = outliers(recording.time, recording.depth)
    np.testing.assert_array_equal(outliers(1e3 * recording.time, -40.0 + 1e-3 * recording.depth), found)


def test_spikes_of_one_file_are_counted_and_told_once() -> None:
    whole, where = spoilt(clean("multistep", 0.1, 0.1, 2), 0.01)
    pieces = [whole.between(0.0, 70.0), whole.between(70.0, np.inf)]
    cleaned = without_outliers(pieces)
    count = int(where["depth"].sum())
    assert [piece.counts["outlier.depth"] for piece in cleaned] == [count, count]
    told = f"{whole.name}: {count} of 1500 depth values lie off their neighbours and were left out"
    assert notes_of(cleaned)[0] == told
    assert pieces[0].notes == ()
    assert not pieces[0].counts


def test_a_spike_of_the_speed_is_left_out() -> None:
    speed = 2.0 + 0.001 * np.random.default_rng(0).standard_normal(400)
    recording = replace(clean("multistep", 0.1, 0.1, 0).between(0.0, 40.0), speed=speed.copy())
    recording.speed[200] = 9.0
    (cleaned,) = without_outliers([recording])
    assert cleaned.has_speed
    assert np.isnan(cleaned.speed[200])
    assert cleaned.counts["outlier.speed"] == 1


def test_identification_is_as_without_the_spikes() -> None:
    recording = clean("multistep", 0.1, 0.1, 3)
    spiked, where = spoilt(recording, 0.01, 2)
    expected = identify([recording], default_vehicle()).model
    result = identify([spiked], default_vehicle())
    for name in TABLE_1:
        assert result.model.values[name] == pytest.approx(expected.values[name], abs=0.5 * expected.std[name])
        assert result.model.std[name] == pytest.approx(expected.std[name], rel=0.1)
    assert result.recordings[0].counts["outlier.pitch"] == where["pitch"].sum()
    assert result.predictions[0].score.depth_fit_percent > 99.0


def test_a_prediction_starts_clean_and_is_scored_on_what_was_measured() -> None:
    recording = clean("multistep", 0.1, 0.1, 4)
    recording.depth[10] += 5.0
    values = {**dict.fromkeys(NAMES, 0.0), **TABLE_1}
    model = VehicleModel(
        vehicle="boat", step=0.1, values=values, std={}, noise={}, valid_range={}, provenance={}
    )
    result = predict(model, recording)
    assert np.delete(result.outputs[1] - recording.depth, 10).std() < 0.02
    assert result.score.depth_rmse_m == pytest.approx(5.0 / np.sqrt(1500), rel=0.05)
