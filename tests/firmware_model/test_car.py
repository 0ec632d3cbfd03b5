"""Rows from ring buffers against rows cut from whole arrays."""

import math

import numpy as np
import pytest
from car_data import car_signals, depth_rows, pitch_rows, random_rudder
from hypothesis import given
from hypothesis import strategies as st

from firmware_model.car import DEPTH_LAGS, PITCH_LAGS, CarRow, Ring


@given(st.integers(1, 6), st.lists(st.floats(allow_nan=False), max_size=30))
def test_ring_gives_back_the_last_values(size, values):
    ring = Ring(size)
    for value in values:
        ring.push(value)
    for lag in range(1, size + 1):
        if lag <= len(values):
            assert ring[lag] == values[-lag]
        else:
            assert math.isnan(ring[lag])


@pytest.mark.parametrize(("lags", "cut", "which"), [(PITCH_LAGS, pitch_rows, 0), (DEPTH_LAGS, depth_rows, 1)])
def test_rows_are_those_of_the_paper(lags, cut, which):
    rudder = random_rudder(np.random.default_rng(0), 60)
    output = car_signals(rudder)[which]
    expected, _ = cut(output, rudder)
    row = CarRow(*lags)
    assert row.span == 60 - len(expected)
    seen = []
    for value, delta in zip(output, rudder, strict=True):
        if row.is_complete:
            seen.append(list(row.phi))
        row.push(value, delta)
    np.testing.assert_array_equal(seen, expected)


@pytest.mark.parametrize(
    ("lags", "output_gone", "rudder_gone"), [(PITCH_LAGS, {1, 2}, {2}), (DEPTH_LAGS, {1, 2, 3, 4}, {2, 3, 4})]
)
def test_missing_value_leaves_exactly_the_rows_that_hold_it_incomplete(lags, output_gone, rudder_gone):
    for missing_output, gone in ((True, output_gone), (False, rudder_gone)):
        row = CarRow(*lags)
        incomplete = set()
        for k in range(20):
            if k >= 10 and not row.is_complete:
                incomplete.add(k - 10)
            gap = k == 10
            row.push(
                math.nan if gap and missing_output else 1.0, math.nan if gap and not missing_output else 0.1
            )
        assert incomplete == gone


def test_clear_forgets_and_keeps_the_buffer():
    row = CarRow(*PITCH_LAGS)
    phi = row.phi
    for _ in range(5):
        row.push(1.0, 2.0)
    assert row.is_complete
    row.clear()
    assert not row.is_complete
    assert row.phi is phi
    row.push(1.0, 2.0)
    assert not row.is_complete
