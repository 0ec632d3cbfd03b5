"""Random forces that are only what errors of the measured speed do, told from those that are not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.speed_forces import are_by_speed
from host.likelihood.filter_error import filter_error
from host.likelihood.fit import Fit
from tests.diagnosis.hidden_dive import BASE, hidden_dive

SPEED_NOISE = 0.05  # m/s


@cache
def noisy(is_known: bool) -> tuple[Fitter, Fit]:
    """A dive through which the speed that is measured wanders, and the base among random forces."""
    recording = hidden_dive(duration=60.0)
    rows = recording.time.size
    wander = 0.02 * np.cumsum(np.random.default_rng(3).standard_normal(rows))
    noise = SPEED_NOISE * np.random.default_rng(4).standard_normal(rows)
    speed = BASE["u0"] + wander + noise if is_known else np.full(rows, np.nan)
    fitter = Fitter([replace(recording, speed=speed)])
    return fitter, filter_error(fitter.base.fit, fitter.inputs(frozenset(), for_filter=True))


@pytest.mark.parametrize(
    ("density", "is_known", "are_small"), [(1e-9, True, True), (1e-1, True, False), (1e-9, False, False)]
)
def test_only_small_forces_beside_a_measured_speed_are_its_errors(
    density: float, is_known: bool, are_small: bool
) -> None:
    fitter, fit = noisy(is_known)
    fit = replace(fit, noise=np.array([*fit.noise[:2], density, density]))
    assert are_by_speed(fitter, fit) == are_small


def test_a_free_run_has_no_forces_to_be_told() -> None:
    fitter, _ = noisy(True)
    assert not are_by_speed(fitter, fitter.base.fit)
