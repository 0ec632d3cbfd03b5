"""What the tests of the noise-proof estimator share."""

from dataclasses import replace

from linear_dive import TRUTH

from firmware_model import PARAMETERS, EstimatorConfig, RobustEstimator

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


def learnt(estimator):
    return estimator.state()["filter"]


def estimator_of(state, config=CONFIG):
    estimator = RobustEstimator(config)
    estimator.restore(state)
    return estimator
