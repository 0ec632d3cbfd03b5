"""What an explanation leaves, by the innovations of each kind of reading."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import _is_local, is_above_floor, leftover


def test_the_right_model_leaves_nothing_where_all_readings_are_rounded() -> None:
    dive, degree_tenth = hidden_dive(seed=1, noise=0.3), np.deg2rad(0.1)
    rounded = replace(
        dive, depth=np.round(dive.depth, 1), pitch=np.round(dive.pitch / degree_tenth) * degree_tenth
    )
    fitter = Fitter([rounded])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert leftover(fitter, fitter.base).is_nothing


@pytest.mark.parametrize(("heave", "is_no_sea"), [(0.0005, True), (0.0017, False)])
def test_what_moves_a_hull_by_less_than_a_calm_lake_is_no_sea(heave: float, is_no_sea: bool) -> None:
    """In m/s: 2 mm/s of turbulence moved a small hull by 1.7."""
    fitter = Fitter([hidden_dive(duration=40.0)])
    fit = fitter.base.fit
    force = 2.0 * abs(float(fit.parameters[0])) * heave**2
    pushed = replace(fitter.base, fit=replace(fit, noise=np.array([*fitter.floor, force, 1e-9])))
    assert leftover(fitter, pushed).is_no_sea == is_no_sea


def test_more_than_the_sensors_show_is_told_of_a_set_that_keeps_no_innovations() -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    lean = fitter.base.lean().fit
    assert not is_above_floor(fitter, lean)
    assert is_above_floor(fitter, replace(lean, noise=2.0 * lean.noise))


@pytest.mark.parametrize("is_larger", [False, True])
def test_what_an_autopilot_answers_is_no_error_of_one_range_of_the_plane(is_larger: bool) -> None:
    rng, dive = np.random.default_rng(0), hidden_dive(duration=90.0)
    errors = rng.standard_normal((2, dive.time.size))
    held = 0.3 * dive.rudder
    if is_larger:  # where the plane stood far over in the row before
        errors[:, 1:] *= 1.0 + (np.abs(held[:-1]) > 0.05)
    answering = replace(dive, rudder=held + 0.05 * errors.mean(axis=0))
    assert _is_local([answering], [errors]) == is_larger
