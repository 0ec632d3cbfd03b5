"""Writes tests/data/robust/trace.json: `python tests/firmware_model/robust_golden.py`, then read the diff."""

import json
import math
from dataclasses import replace
from pathlib import Path

from linear_dive import dive

from firmware_model import PARAMETERS, EstimatorConfig, RobustConfig, RobustEstimator, Sample

TRACE = Path(__file__).parents[1] / "data" / "robust" / "trace.json"
CONFIG = EstimatorConfig(
    step=0.1, speed=2.0, robust=RobustConfig(innovation_length=2, drift=0.02, rudder_hold=0.5)
)


def flown():
    """A dive with everything in it that leaves the straight way."""
    samples = dive(400, 11)
    samples[0] = replace(samples[0], pitch=0.3)
    samples[6] = replace(samples[6], pitch=-0.2)
    samples[90] = replace(samples[90], pitch=math.nan)
    samples[91] = Sample(t_us=samples[91].t_us)
    samples[120] = replace(samples[120], depth=samples[120].depth + 3.0)
    samples[200:] = [replace(sample, depth=sample.depth - 30.0) for sample in samples[200:]]
    del samples[250:253], samples[290:310]
    samples[300:] = [replace(sample, speed=2.5) for sample in samples[300:]]
    return samples


def trace(samples):
    """Status of each sample, and the estimate after every 20th."""
    estimator = RobustEstimator(CONFIG)
    statuses, estimates = [], []
    for k, sample in enumerate(samples):
        statuses.append(estimator.update(sample).name)
        if k % 20 == 19:
            estimate = estimator.estimate()
            estimates.append([estimate.values[name] for name in (*PARAMETERS, "u0")])
            estimates[-1] += [estimate.std[name] for name in PARAMETERS]
    return {"statuses": statuses, "estimates": estimates}


def columns(samples):
    """Samples for JSON, null where nothing was measured."""
    names = ("t_us", "depth", "pitch", "rudder", "speed")
    rows = [[getattr(sample, name) for name in names] for sample in samples]
    return [[None if math.isnan(value) else value for value in row] for row in rows]


def samples_from(rows):
    return [
        Sample(t_us=t_us, **dict(zip(("depth", "pitch", "rudder", "speed"), _numbers(values), strict=True)))
        for t_us, *values in rows
    ]


def _numbers(values):
    return [math.nan if value is None else value for value in values]


if __name__ == "__main__":
    samples = flown()
    rows = ",\n".join(json.dumps(row) for row in columns(samples))
    rest = trace(samples)
    estimates = ",\n".join(json.dumps(row) for row in rest["estimates"])
    statuses = json.dumps(rest["statuses"])
    TRACE.write_text(f'{{"samples": [\n{rows}],\n"statuses": {statuses},\n"estimates": [\n{estimates}]}}\n')
