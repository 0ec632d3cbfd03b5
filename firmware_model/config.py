"""Settings of the estimators."""

import math
from dataclasses import dataclass
from typing import Literal

from firmware_model.state import require

LONGEST_ROBUST_STEP = 10.0  # s; beyond it an interval would take more than a hundred sub-steps


def _require_innovation_length(p: int) -> None:
    require(1 <= p <= 64, "innovation_length must be from 1 to 64", p)


@dataclass(frozen=True, slots=True, kw_only=True)
class RobustConfig:
    """Settings of `RobustEstimator`. Raises ValueError naming the first value that breaks its rule.

    The prior is that of a vehicle whose pitch answers within about `pitch_time` and which moves at about the
    configured speed; it is weak, and a factor of two either way does no harm.
    """

    innovation_length: int = 1  # p, steps in which each sample is used, 1 to 64; more only costs time
    pitch_time: float | None = None  # s, above 0: in which pitch answers the plane; None: 1 s, or a step
    typical_rudder: float = 0.25  # rad (or the rudder's own unit), above 0: a large movement of it
    # Highest noise to expect of the sensors, standard deviation: the level itself is learnt. Too low a value
    # makes the first estimates too sure of themselves, a value three times too high costs nothing.
    pitch_noise: float = 0.0035  # rad, above 0
    depth_noise: float = 0.02  # m, above 0
    speed_std: float | None = (
        None  # m/s, 0 or more: of the configured speed; None for half of it, 0 trusts it
    )
    # Whether pitch rate acts on heave, w' = ... + c_wq q, as on most vehicles; None: yes where the speed is
    # measured. Without a measured speed it makes u0 and b1 several times less certain.
    heave_pitch_rate_coupling: bool | None = None
    drift: float = 0.0  # 0 or more: relative change of a parameter to be followed, in 100 s
    rudder_hold: float = 2.5  # s, 0 or more: longest time without a rudder that is bridged
    rest_time: float | None = None  # s, above 0: so long without excitation is rest; None: 30 pitch times

    def __post_init__(self) -> None:
        _require_innovation_length(self.innovation_length)
        for name in ("pitch_time", "typical_rudder", "pitch_noise", "depth_noise", "rest_time"):
            value = getattr(self, name)
            is_positive = value is None or 0.0 < value < math.inf
            require(is_positive, f"{name} must be above 0 and finite", value)
        for name in ("drift", "rudder_hold"):
            value = getattr(self, name)
            require(0.0 <= value < math.inf, f"{name} must be 0 or more and finite", value)
        is_known = self.speed_std is None or 0.0 <= self.speed_std < math.inf
        require(is_known, "speed_std must be 0 or more and finite", self.speed_std)


@dataclass(frozen=True, slots=True, kw_only=True)
class MilsConfig:
    """Settings of `VerticalPlaneEstimator`. Raises ValueError naming the first value that breaks its rule."""

    innovation_length: int = 5  # p, rows used in each step, 1 to 64; 1 is ordinary RLS
    pitch_forgetting_time: float | None = None  # s, memory of the pitch channel; None or inf never forgets
    depth_forgetting_time: float | None = None  # s, the same for the depth channel
    p0: float = 1e6  # P(0) = p0 I, above 0
    covariance_cap: float | None = None  # largest P_ii that forgetting may lead to; None for p0
    speed_time: float = 60.0  # s, averaging time of the measured speed

    def __post_init__(self) -> None:
        _require_innovation_length(self.innovation_length)
        for name in ("p0", "speed_time", "pitch_forgetting_time", "depth_forgetting_time", "covariance_cap"):
            value = getattr(self, name)
            require(value is None or value > 0.0, f"{name} must be above 0", value)
        for name in ("p0", "speed_time"):
            require(getattr(self, name) < math.inf, f"{name} must be finite", getattr(self, name))


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimatorConfig:
    """Settings of an estimator. Raises ValueError naming the first value that breaks its rule.

    method  robust: prediction errors of the equations of motion, stands sensor noise (`RobustEstimator`)
            mils: multi-innovation least squares on the paper's CAR rows (`VerticalPlaneEstimator`)
    """

    method: Literal["robust", "mils"] = "robust"
    step: float  # s, interval of the time grid, above 0
    speed: float  # m/s, forward speed through the water where none is measured, above 0
    excitation_threshold: float = (
        0.005  # rad; while the rudder moves less, there is little to learn. 0: always
    )
    excitation_time: float = 5.0  # s, averaging time of the excitation
    # Standard deviations of the innovation; None or inf refuses none. A sampled rudder step can reach ten in
    # CAR rows: a narrower gate refuses the very samples that tell most.
    outlier_gate: float | None = 20.0
    outlier_limit: int = 5  # outliers in a row that are refused before they are believed, at least 1
    pitch_resolution: float = 1e-4  # rad, of the sensor
    depth_resolution: float = 1e-3  # m, of the sensor
    valid_below: float = 0.1  # a parameter becomes valid below this relative standard deviation
    invalid_above: float = 0.2  # and stops being valid above this one
    robust: RobustConfig = RobustConfig()
    mils: MilsConfig = MilsConfig()

    @property
    def pitch_time(self) -> float:
        """Time in which pitch answers the plane, roughly, s."""
        own = self.robust.pitch_time
        return max(1.0, self.step) if own is None else own

    @property
    def rest_time(self) -> float:
        """Time without excitation after which the vehicle is at rest, s."""
        own = self.robust.rest_time
        return 30.0 * self.pitch_time if own is None else own

    def __post_init__(self) -> None:
        for name in (
            "step",
            "speed",
            "excitation_time",
            "outlier_gate",
            "pitch_resolution",
            "depth_resolution",
            "valid_below",
        ):
            value = getattr(self, name)
            require(value is None or value > 0.0, f"{name} must be above 0", value)
        for name in ("step", "speed", "excitation_time"):
            require(getattr(self, name) < math.inf, f"{name} must be finite", getattr(self, name))
        require(
            self.method != "robust" or self.step <= LONGEST_ROBUST_STEP,
            f"step must be at most {LONGEST_ROBUST_STEP:g} s with method robust",
            self.step,
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
