"""Recordings that are truer than any sensor, as sensors would have read them."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.diagnose import diagnose
from host.diagnosis.recordings.sensed import USUAL, as_sensed
from host.noise.noise_floor import noise_floor
from host.recordings.recording import Array


def coupled(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
    return 0.8 * float(x[1]), 0.0, 0.0


def test_what_sensors_have_read_stays_as_it_is() -> None:
    recordings = [hidden_dive(duration=30.0)]
    assert as_sensed(recordings) is recordings


def test_what_is_smoother_gets_the_noise_of_good_sensors_and_says_so() -> None:
    smooth = hidden_dive(duration=60.0, noise=0.0)
    smooth = replace(
        smooth, depth=np.where((smooth.time > 20.0) & (smooth.time < 25.0), np.nan, smooth.depth)
    )
    (seen,) = as_sensed([smooth])
    assert np.sqrt(noise_floor([seen])) == pytest.approx(USUAL, rel=0.15)
    assert np.array_equal(np.isnan(seen.depth), np.isnan(smooth.depth))
    assert seen.notes[-1].endswith("white noise of 0.05 deg in pitch and 5 mm in depth")
    (again,) = as_sensed([smooth])
    assert np.array_equal(again.pitch, seen.pitch)


def test_only_the_channel_that_is_smoother_does() -> None:
    rows, smooth = hidden_dive(duration=60.0), hidden_dive(duration=60.0, noise=0.0)
    (seen,) = as_sensed([replace(rows, depth=smooth.depth)])
    assert np.array_equal(seen.pitch, rows.pitch)
    assert np.std(seen.depth - smooth.depth) == pytest.approx(USUAL[1], rel=0.15)
    assert seen.notes[-1].endswith("noise of 5 mm in depth")


def test_a_reading_that_is_held_keeps_one_error() -> None:
    smooth = hidden_dive(duration=60.0, noise=0.0)
    held = 0.001 * smooth.depth[(np.arange(smooth.time.size) // 5) * 5]
    (seen,) = as_sensed([replace(smooth, depth=held)])
    assert np.array_equal(np.diff(seen.depth) == 0.0, np.diff(held) == 0.0)
    assert np.std(seen.depth - held) > 0.0


def test_a_simulator_s_output_without_noise_is_explained() -> None:
    found = diagnose([hidden_dive(coupled, noise=0.0)])
    assert (found.verdict, [effect.name for effect in found.effects]) == (
        "explained", ["heave_pitch_rate_coupling"],
    )  # fmt: skip


def test_a_simulation_seen_with_less_noise_than_sensors_have_keeps_it() -> None:
    quiet = hidden_dive(duration=60.0, noise=0.02)
    (taken,) = diagnose([quiet], may_be_quiet=True).recordings
    np.testing.assert_array_equal(taken.pitch, quiet.pitch)
