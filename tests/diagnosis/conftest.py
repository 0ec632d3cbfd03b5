from pathlib import Path

import pytest
from hidden_dive import hidden_dive

from host.diagnosis.diagnose import Diagnosis, diagnose
from host.diagnosis.fits.fitter import Fitter
from host.recordings.read import read_recordings
from host.vehicle import default_vehicle

SIMULATED = Path(__file__).parent.parent / "data" / "simulators" / "pvs_remus100__3211.csv"


@pytest.fixture(scope="session")
def coupled() -> Diagnosis:
    """A dive that hides a coupling of pitch rate into heave, diagnosed."""
    return diagnose([hidden_dive(lambda _, x, __: (0.8 * x[1], 0.0, 0.0), seed=1)])


@pytest.fixture(scope="module")
def real() -> Fitter:
    """A simulator's REMUS 100, of which the base equations leave much."""
    return Fitter(read_recordings(SIMULATED, default_vehicle()))
