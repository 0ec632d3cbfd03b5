"""What the estimator believes, and how far it may be believed."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from firmware_model.status import Status

PARAMETERS = ("a1", "a2", "a3", "b1", "b2")


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """The vertical plane as estimated at one time; NaN for what is not known yet.

    a1, a2    1/s        heave and pitch damping
    a3        1/s^2      pitch restoring moment
    b1, b2    m/s^2/rad, 1/s^2  heave force and pitch moment of the stern plane
    u0        m/s        forward speed: mean of the measured one, else estimated (robust) or configured
    c_wq      m/s        heave force of the pitch rate, w' = ... + c_wq q; NaN where it is not estimated
    heave_offset, pitch_offset  m/s^2, rad/s^2  forces of an imperfect trim; 0 where they are not estimated
    std       standard deviation of each; of a measured speed its spread, of a configured one 0
    valid     by parameter, with hysteresis in the relative standard deviation
    car_pitch alpha1..alpha3        car_depth  beta1..beta7, both as in the paper
    samples   accepted              updates    of them, samples that something was learnt from
    refused   samples by cause      seconds    of data learnt from
    """

    a1: float
    a2: float
    a3: float
    b1: float
    b2: float
    u0: float
    c_wq: float = math.nan
    heave_offset: float = 0.0
    pitch_offset: float = 0.0
    std: Mapping[str, float]
    valid: Mapping[str, bool]
    car_pitch: tuple[float, ...]
    car_depth: tuple[float, ...]
    samples: int
    updates: int
    refused: Mapping[str, int]
    status: Status
    seconds: float

    @property
    def values(self) -> dict[str, float]:
        """a1, a2, a3, b1, b2 and u0 by name; c_wq where it is estimated."""
        extra = () if math.isnan(self.c_wq) else ("c_wq",)
        return {name: getattr(self, name) for name in (*PARAMETERS, "u0", *extra)}
