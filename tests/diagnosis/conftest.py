import pytest
from hidden_dive import hidden_dive

from host.diagnosis.diagnose import Diagnosis, diagnose


@pytest.fixture(scope="session")
def coupled() -> Diagnosis:
    """A dive that hides a coupling of pitch rate into heave, diagnosed."""
    return diagnose([hidden_dive(lambda _, x, __: (0.8 * x[1], 0.0, 0.0), seed=1)])
