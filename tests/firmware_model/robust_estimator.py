"""What the tests of the noise-proof estimator share."""

from dataclasses import replace

from linear_dive import TRUTH

from firmware_model import PARAMETERS, EstimatorConfig, RobustEstimator, Status
from firmware_model.sensor import OPENING

CONFIG = EstimatorConfig(step=0.1, speed=2.0)


NAMES = (*PARAMETERS, "u0")


def with_robust(config=CONFIG, **settings):
    return replace(config, robust=replace(config.robust, **settings))


def run(estimator, samples):
    return [estimator.update(sample) for sample in samples]


def assert_found(estimator, names=NAMES, within=4.0, truth=TRUTH):
    estimate = estimator.estimate()
    for name in names:
        error = estimate.values[name] - truth[name]
        assert abs(error) < within * estimate.std[name], (name, error, estimate.std[name])


def assert_starts(statuses, first=Status.RESTARTED):
    """A sensor is followed from the value on that agrees with enough others."""
    assert statuses[: OPENING - 1] == [Status.WAITING] * (OPENING - 1)
    assert statuses[OPENING - 1] is first
    assert set(statuses[OPENING:]) == {Status.UPDATED}


def learnt(estimator):
    return estimator.state()["filter"]


def estimator_of(state, config=CONFIG):
    estimator = RobustEstimator(config)
    estimator.restore(state)
    return estimator
