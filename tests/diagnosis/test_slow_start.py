"""A recording that begins before the vehicle is back at its speed, which nothing measures."""

import numpy as np
import pytest

from host.catalogue import structure_of
from host.diagnosis.diagnose import diagnose
from host.dynamics.propagate import begun_at, inputs_of
from host.likelihood.fit import Fit
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import output_error
from tests.diagnosis.hidden_dive import BASE, DRAG, RECOVERY, slowing

STRUCTURE = structure_of(("speed_loss",))
TRUE = {**BASE, "heave_offset": 0.0, "pitch_offset": 0.0, "speed_time": RECOVERY, "c_ud": DRAG, "c_uq": 0.0}
VALUES = np.array([TRUE[name] for name in STRUCTURE.names])


def fitted(begins_at: float) -> Fit:
    dive = slowing(np.nan, begins_at)
    start = Point(STRUCTURE, 1.1 * VALUES, [begun_at(0.0, 20.0)], np.zeros(4))
    return output_error(start, [inputs_of(dive, STRUCTURE)], np.array([n != "c_uq" for n in STRUCTURE.names]))


@pytest.mark.parametrize("begins_at", [1.0, 2.5])
def test_the_speed_at_the_first_row_is_found(begins_at: float) -> None:
    fit = fitted(begins_at)
    u0 = fit.parameters[STRUCTURE.names.index("u0")]
    assert u0 * (1.0 + fit.initial[0][4]) == pytest.approx(begins_at, abs=0.1)
    deviation = np.sqrt(np.diag(np.linalg.inv(fit.information[np.ix_(fit.free, fit.free)])))
    assert (np.abs(fit.parameters - VALUES)[fit.free] < 4.0 * deviation).all()


@pytest.mark.long
@pytest.mark.parametrize("begins_at", [1.0, 2.5])
def test_a_slow_beginning_passes_for_nothing_else(begins_at: float) -> None:
    found = diagnose([slowing(np.nan, begins_at)])
    assert found.verdict == "explained"
    assert [effect.name for effect in found.effects] == ["speed_loss"]
