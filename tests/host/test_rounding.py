"""Quantised channels tell no more than their level changes do."""

import numpy as np
from exact_dive import Dive, fly
from hypothesis import given
from hypothesis import strategies as st

from host.rounding import quantum, thinned


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
