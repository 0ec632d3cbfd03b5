"""What the tests of the paper's estimator share."""

from dataclasses import replace

import numpy as np
from car_data import SPEED, STEP, car_signals, random_rudder

from firmware_model import EstimatorConfig, Sample

CONFIG = EstimatorConfig(method="mils", step=STEP, speed=SPEED)


def with_mils(config=CONFIG, **settings):
    return replace(config, mils=replace(config.mils, **settings))


def samples_of(pitch, depth, rudder, start=0):
    return [
        Sample(
            t_us=(start + k) * 100_000, depth=float(depth[k]), pitch=float(pitch[k]), rudder=float(rudder[k])
        )
        for k in range(len(rudder))
    ]


def dive(count, seed=0, noise=0.0, start=0):
    rng = np.random.default_rng(seed)
    rudder = random_rudder(rng, count)
    return samples_of(*car_signals(rudder, rng, noise, noise), rudder, start)


def run(estimator, samples):
    return [estimator.update(sample) for sample in samples]


def learnt(estimator):
    """Everything but the counts."""
    state = estimator.state()
    return {name: state[name] for name in ("pitch", "depth", "speed")}
