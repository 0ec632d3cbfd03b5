"""What several files of tests begin with."""

import pytest
from linear_dive import dive
from robust_estimator import CONFIG, run

from firmware_model import RobustEstimator


@pytest.fixture(scope="session")
def trained():
    """The state of an estimator after 120 s; `estimator_of` brings it back."""
    estimator = RobustEstimator(CONFIG)
    run(estimator, dive(1200))
    return estimator.state()
