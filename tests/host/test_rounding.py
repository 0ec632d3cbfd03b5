"""Quantised channels tell no more than their level changes do."""

import numpy as np
import pytest
from exact_dive import Dive, fly
from hypothesis import given
from hypothesis import strategies as st

from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.noise.noise_floor import noise_floor, resolution
from host.recordings.rounding import lattice, quantum, thinned


def quantised(step_m: float, duration: float = 60.0):  # type: ignore[no-untyped-def]
    recording, _ = fly(Dive(duration=duration, amplitude=0.02, depth_noise=0.002))
    recording.depth[:] = step_m * np.round(recording.depth / step_m)
    return recording


def test_a_value_that_stays_is_told_about_once() -> None:
    recording = quantised(0.2)
    changes = np.count_nonzero(np.diff(recording.depth))
    (thin,) = thinned([recording])
    left = np.isfinite(thin.depth)
    assert changes <= left.sum() <= 2 * changes + 2
    np.testing.assert_array_equal(thin.depth[left], recording.depth[left])
    np.testing.assert_array_equal(thin.pitch, recording.pitch)
    assert abs(quantum([recording.depth]) - 0.2) < 1e-9


def test_what_has_no_steps_stays_whole() -> None:
    recording, _ = fly(Dive(duration=60.0))
    (same,) = thinned([recording])
    np.testing.assert_array_equal(same.depth, recording.depth)
    # Noise beyond the resolution makes every value new.
    rough, _ = fly(Dive(duration=60.0, depth_noise=0.1))
    rough.depth[:] = 0.05 * np.round(rough.depth / 0.05)
    (same,) = thinned([rough])
    np.testing.assert_array_equal(same.depth, rough.depth)


@given(st.floats(0.02, 2.0), st.integers(0, 5))
def test_what_is_left_was_measured_and_tells_of_every_level(step_m: float, missing: int) -> None:
    recording = quantised(step_m, duration=20.0)
    recording.depth[: 10 * missing] = np.nan
    (thin,) = thinned([recording])
    left = np.isfinite(thin.depth)
    np.testing.assert_array_equal(thin.depth[left], recording.depth[left])
    known = recording.depth[np.isfinite(recording.depth)]
    assert left.sum() >= min(known.size, np.count_nonzero(np.diff(known)))


def test_a_fast_dive_has_its_step_though_few_readings_repeat() -> None:
    recording, _ = fly(Dive(duration=30.0))
    read = 0.1 * np.round(recording.depth / 0.1)
    assert abs(quantum([read]) - 0.1) < 1e-9
    assert quantum([recording.depth]) < 1e-8


def test_what_is_held_or_resampled_is_no_rounding_but_is_told_once() -> None:
    recording, _ = fly(Dive(duration=60.0))
    recording.depth[:] = np.repeat(recording.depth[::5], 5)
    assert lattice([recording.depth]) == 0.0
    assert resolution([recording])[1] == 0.0
    fit = fit_maximum_likelihood([recording], noise_model="output_error")
    assert fit.samples == recording.time.size + recording.depth[::5].size
    # Rounded readings put on another clock lie between the steps here and there.
    recording.depth[:] = np.repeat(0.1 * np.round(recording.depth[::5] / 0.1), 5)
    recording.depth[::97] += 0.037
    assert resolution([recording])[1] == 0.0
    assert quantum([recording.depth]) > 0.01


@pytest.mark.parametrize("depth_noise", [0.002, 0.02, 0.035])
@pytest.mark.parametrize("amplitude", [0.005, 0.02, 0.25])
def test_the_noise_of_rounded_readings_is_that_of_sensor_and_rounding(
    depth_noise: float, amplitude: float
) -> None:
    recording, _ = fly(Dive(duration=200.0, amplitude=amplitude, depth_noise=depth_noise))
    recording.depth[:] = 0.1 * np.round(recording.depth / 0.1)
    found = np.sqrt(noise_floor([recording])[1])
    both = np.hypot(depth_noise, 0.1 / 12**0.5)
    assert 0.8 * both < found < 1.35 * both
    assert resolution([recording])[1] == pytest.approx(0.1)


def test_noise_above_the_steps_rules_them() -> None:
    recording, _ = fly(Dive(duration=60.0, depth_noise=0.1))
    recording.depth[:] = 0.05 * np.round(recording.depth / 0.05)
    assert resolution([recording])[1] == 0.0
