"""A mission at several speeds that nothing told: the moments and the speeds are found together."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive

from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.search.several_speeds import at_several_speeds
from host.recordings.recording import Array, Recording

FIRST, SECOND = (31.0, 0.2), (63.0, -0.35)  # s, and share of the first speed


def at_three_speeds(time: float, x: Array, plane: float) -> tuple[float, float, float]:
    more = sum(step for when, step in (FIRST, SECOND) if time > when)
    stronger = (1.0 + more) ** 2 - 1.0
    heave = BASE["a1"] * more * x[0] + BASE["b1"] * stronger * plane
    pitch = BASE["a2"] * more * x[1] + BASE["b2"] * stronger * plane
    return heave, pitch, -BASE["u0"] * more * x[2]


@cache
def flown() -> Recording:
    return hidden_dive(at_three_speeds)


def test_both_changes_are_found_with_their_moments_and_sizes() -> None:
    fitter = Fitter([flown()])
    found = at_several_speeds(fitter, fitter.root)
    values = dict(zip(found.fit.structure.names, found.fit.parameters, strict=True))
    prefixes = ("speed", "second_speed")
    changes = sorted((values[f"{p}_change_time"], values[f"{p}_step"]) for p in prefixes)
    np.testing.assert_allclose(changes, [FIRST, SECOND], rtol=0.05)
    assert values["u0"] == pytest.approx(BASE["u0"], rel=0.03)
    assert fitter.excess(found.fit) < 1.5


def test_where_the_speed_is_told_or_did_not_change_none_is_looked_for() -> None:
    told = Fitter([replace(flown(), speed=np.full(flown().time.size, BASE["u0"]))])
    assert at_several_speeds(told, told.root) is told.root
    steady = Fitter([hidden_dive(duration=60.0)])
    assert at_several_speeds(steady, steady.root) is steady.root
