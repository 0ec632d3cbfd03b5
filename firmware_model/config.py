"""Settings of the estimator."""

import math
from dataclasses import dataclass

from firmware_model.state import require


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimatorConfig:
    """Settings of `VerticalPlaneEstimator`. Raises ValueError naming the first value that breaks its rule."""

    step: float  # s, interval of the time grid, above 0
    speed: float  # m/s, forward speed through the water where none is measured, above 0
    innovation_length: int = 5  # p, rows used in each step, 1 to 64; 1 is ordinary RLS
    pitch_forgetting_time: float | None = None  # s, memory of the pitch channel; None or inf never forgets
    depth_forgetting_time: float | None = None  # s, the same for the depth channel
    p0: float = 1e6  # P(0) = p0 I, above 0
    covariance_cap: float | None = None  # largest P_ii that forgetting may lead to; None for p0
    excitation_threshold: float = 0.005  # rad; below it both rudder and pitch are at rest. 0 learns always
    excitation_time: float = 5.0  # s, averaging time of the excitation
    # Standard deviations of the innovation; None or inf refuses none. A sampled rudder step can reach ten:
    # a narrower gate refuses the very samples that tell most.
    outlier_gate: float | None = 20.0
    outlier_limit: int = 5  # outliers in a row that are refused before they are believed, at least 1
    pitch_resolution: float = 1e-4  # rad, of the sensor
    depth_resolution: float = 1e-3  # m, of the sensor
    speed_time: float = 60.0  # s, averaging time of the measured speed
    valid_below: float = 0.1  # a parameter becomes valid below this relative standard deviation
    invalid_above: float = 0.2  # and stops being valid above this one

    def __post_init__(self) -> None:
        for name in (
            "step",
            "speed",
            "p0",
            "excitation_time",
            "outlier_gate",
            "pitch_resolution",
            "depth_resolution",
            "speed_time",
            "valid_below",
            "pitch_forgetting_time",
            "depth_forgetting_time",
            "covariance_cap",
        ):
            value = getattr(self, name)
            require(value is None or value > 0.0, f"{name} must be above 0", value)
        for name in ("step", "speed", "p0", "excitation_time", "speed_time"):
            require(getattr(self, name) < math.inf, f"{name} must be finite", getattr(self, name))
        require(
            1 <= self.innovation_length <= 64,
            "innovation_length must be from 1 to 64",
            self.innovation_length,
        )
        require(self.outlier_limit >= 1, "outlier_limit must be at least 1", self.outlier_limit)
        require(
            self.excitation_threshold >= 0.0,
            "excitation_threshold must be 0 or more",
            self.excitation_threshold,
        )
        require(
            self.invalid_above >= self.valid_below,
            f"invalid_above must be at least valid_below = {self.valid_below}",
            self.invalid_above,
        )


def forgetting_factor(memory: float | None, step: float) -> float:
    """exp(-step/memory): what a step leaves of the weight of earlier ones; 1 for a memory of None or inf."""
    return 1.0 if memory is None else math.exp(-step / memory)
