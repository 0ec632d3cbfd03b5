"""A stretch that begins before the vehicle is back at its speed, which nothing measures."""

from dataclasses import replace

import numpy as np
import pytest

from host.catalogue import structure_of
from host.fit import Fit
from host.gauss_newton import Point
from host.output_error import output_error
from host.propagate import begun_at, inputs_of
from tests.diagnosis.hidden_dive import BASE, DRAG, RECOVERY, slowing

STRUCTURE = structure_of(("speed_loss",))
TRUE = {**BASE, "heave_offset": 0.0, "pitch_offset": 0.0, "speed_time": RECOVERY, "c_ud": DRAG, "c_uq": 0.0}
VALUES = np.array([TRUE[name] for name in STRUCTURE.names])


def fitted(begins_at: float, row_time: float) -> Fit:
    """To a dive that begins at this speed, m/s, and whose first row is at this time, s, of its recording."""
    dive = slowing(np.nan, begins_at)
    stretch = replace(dive, time=row_time + dive.time)
    start = Point(STRUCTURE, 1.1 * VALUES, [begun_at(0.0, 20.0)], np.zeros(4))
    return output_error(
        start, [inputs_of(stretch, STRUCTURE)], np.array([n != "c_uq" for n in STRUCTURE.names])
    )


@pytest.mark.parametrize("begins_at", [1.0, 2.5])
def test_within_a_recording_the_speed_at_the_first_row_is_found(begins_at: float) -> None:
    fit = fitted(begins_at, 200.0)
    u0 = fit.parameters[STRUCTURE.names.index("u0")]
    assert u0 * (1.0 + fit.initial[0][4]) == pytest.approx(begins_at, abs=0.1)
    deviation = np.sqrt(np.diag(np.linalg.inv(fit.information[np.ix_(fit.free, fit.free)])))
    assert (np.abs(fit.parameters - VALUES)[fit.free] < 4.0 * deviation).all()


def test_a_recording_begins_in_steady_flight() -> None:
    fit = fitted(1.0, 0.0)
    assert fit.initial[0][4] == 0.0
    assert fit.noise[1] > 2.0 * fitted(1.0, 200.0).noise[1]
