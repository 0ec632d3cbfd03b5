"""What an explanation leaves, by the innovations of each kind of reading."""

import warnings
from dataclasses import replace

import numpy as np
from hidden_dive import hidden_dive

from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import is_above_floor, leftover


def test_the_right_model_leaves_nothing_where_all_readings_are_rounded() -> None:
    dive, degree_tenth = hidden_dive(seed=1, noise=0.3), np.deg2rad(0.1)
    rounded = replace(
        dive, depth=np.round(dive.depth, 1), pitch=np.round(dive.pitch / degree_tenth) * degree_tenth
    )
    fitter = Fitter([rounded])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert leftover(fitter, fitter.base).is_nothing


def test_more_than_the_sensors_show_is_told_of_a_set_that_keeps_no_innovations() -> None:
    fitter = Fitter([hidden_dive(duration=40.0)])
    lean = fitter.base.lean().fit
    assert not is_above_floor(fitter, lean)
    assert is_above_floor(fitter, replace(lean, noise=2.0 * lean.noise))
