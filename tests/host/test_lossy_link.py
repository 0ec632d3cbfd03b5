"""A link that loses most messages, each by itself: the estimator behind the alignment stays honest."""

import numpy as np
import pytest
from exact_dive import TABLE_1, Dive, fly

from bridge.measurement import Measurement, Quantity
from firmware_model.config import EstimatorConfig
from firmware_model.estimate import Estimate
from firmware_model.estimator import make_estimator
from host.live.align import AlignConfig, Aligner

STEP = 0.1


def learnt(seed: int, config: AlignConfig) -> Estimate:
    """From 200 s of messages at 20 Hz, 60 % of them lost; the plane turns at any of their instants."""
    recording, _ = fly(Dive(seed=seed, step=STEP / 2, duration=200.0))
    rng = np.random.default_rng([seed, 1])
    aligner, estimator = Aligner(config), make_estimator(EstimatorConfig(step=STEP, speed=2.0))
    for k, time in enumerate(recording.time):
        for quantity in (Quantity.PITCH, Quantity.DEPTH, Quantity.RUDDER):
            if rng.random() < 0.6:
                continue
            value = float(getattr(recording, quantity)[k])
            for sample in aligner.push(
                Measurement(quantity=quantity, value=value, t_us=round(1e6 * time), source="test")
            ):
                estimator.update(sample)
    return estimator.estimate()


def deviations(estimate: Estimate) -> list[float]:
    return [abs(estimate.values[name] - truth) / estimate.std[name] for name, truth in TABLE_1.items()]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_losses_do_not_make_it_confidently_wrong(seed: int) -> None:
    estimate = learnt(seed, AlignConfig(step=STEP))
    assert max(deviations(estimate)) < 4.0
    assert estimate.std["a3"] < 0.03 * abs(TABLE_1["a3"])


def test_a_plane_believed_to_rest_while_nothing_is_heard_would() -> None:
    assert max(deviations(learnt(1, AlignConfig(step=STEP, rudder_on_change=True)))) > 6.0
