"""Times as a calendar and a clock write them are seconds."""

import numpy as np
import pytest

from host.recordings.clock_time import clock_seconds


@pytest.mark.parametrize(
    "cells",
    [
        ["2026-03-01T12:00:00", "2026-03-01T12:00:00.5", "2026-03-01T12:00:01"],
        ["2026-03-01 12:00:00Z", "2026-03-01 12:00:00,500Z", "2026-03-01 12:00:01Z"],
        ["2026-03-01T12:00:00+02:00", "2026-03-01T10:00:00.5+00:00", " 2026-03-01T11:00:01+01:00"],
        ["23:59:59.75", "00:00:00.25", "00:00:00.75"],
    ],
)
def test_they_advance_by_half_a_second(cells: list[str]) -> None:
    assert np.diff(clock_seconds(cells)) == pytest.approx([0.5, 0.5])


def test_midnights_are_counted_and_small_steps_back_are_none() -> None:
    times = clock_seconds(["22:00:00", "04:00:00", "03:59:59", "", "23:00:00", "01:00:00"])
    assert times == pytest.approx([79200, 100800, 100799, np.nan, 169200, 176400], nan_ok=True)


def test_what_is_no_time_is_not_measured() -> None:
    assert np.isnan(clock_seconds(["noon", "", "1/2/2026 12:00", "25:00:00"])).all()
