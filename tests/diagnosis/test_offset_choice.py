"""Offsets that other members of a set may have taken the place of."""

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.trims import COMPRESSED
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search.offset_choice import with_constant_buoyancy
from host.diagnosis.search.search import Search
from host.recordings.recording import Array

FAR, NEAR = 5000.0, 22.0  # m: where it would be neutral; the dive is between 16 and 24 m deep or so


@pytest.mark.parametrize(
    ("slope", "neutral", "left"),
    [(0.0, FAR, "net_buoyancy"), (2e-2, NEAR, COMPRESSED), (2e-3, FAR, COMPRESSED)],
)
def test_a_buoyancy_that_hardly_changes_with_depth_is_a_constant_one(
    slope: float, neutral: float, left: str
) -> None:
    def lifted(time: float, x: Array, plane: float) -> tuple[float, float, float]:  # noqa: ARG001
        force = slope * (x[3] - neutral) if neutral == NEAR else -0.03 + slope * (x[3] - 20.0)
        return force * np.cos(x[2]), 0.0, 0.0

    fitter = Fitter([hidden_dive(lifted)])
    with Workers(fitter, 1) as workers:
        search = Search(fitter, workers, lambda _: None, fitter.base, fitter.base)
        start = np.array([slope or -0.03 / FAR, neutral])
        deep = fitter.polished(fitter.grown(fitter.base, COMPRESSED, [start]))
        assert with_constant_buoyancy(search, deep).names == {left}
