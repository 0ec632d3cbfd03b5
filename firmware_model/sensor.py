"""One measured entry of the state, its noise, and the unknown force that shows in it."""

import math

from firmware_model.noise_levels import LIKELY, ForceNoise, SensorNoise
from firmware_model.ud_factors import UdFactors

HUBER = 3.0
"""Standard deviations beyond which a sample's influence does not grow any more."""


class Sensor:
    """Measures x[entry] with white noise; the first value after a restart says where the entry is.

    resolution  below it no difference is an outlier
    """

    def __init__(self, entry: int, noise: SensorNoise, force: ForceNoise, resolution: float) -> None:
        self.entry = entry
        self.noise = noise
        self.force = force
        self._resolution = resolution
        self.restart()

    def restart(self) -> None:
        """The next value is the first."""
        self.is_started = False
        self.force.forget()

    def reset(self) -> None:
        """Forgets the noise too."""
        self.noise.reset()
        self.force.reset()
        self.restart()

    def is_outlier(self, ud: UdFactors, value: float, gate: float) -> bool:
        """Whether the value is more than `gate` standard deviations from where it is expected."""
        if not self.is_started:
            return False
        error = value - ud.x[self.entry]
        variance = ud.covariance(self.entry, self.entry) + self.noise.variance
        return not error * error <= gate * gate * max(variance, self._resolution * self._resolution)

    def learn(self, ud: UdFactors, value: float, p: int) -> float:
        """One update with 1/p of the value's information; gives the noise variance that it was given.

        A value beyond HUBER standard deviations counts as noisier, so that it moves the estimate no further
        than one at HUBER would.
        """
        if not self.is_started:
            self.is_started = True
            ud.x[self.entry] = value
        error = value - ud.x[self.entry]
        used = self.noise.variance
        variance = ud.covariance(self.entry, self.entry) + used
        squared = error * error / variance
        if squared > HUBER * HUBER:
            used += variance * (math.sqrt(squared) / HUBER - 1.0)
        self.noise.learn(variance, squared)
        self.force.learn(math.copysign(math.sqrt(min(squared, LIKELY)), error))
        ud.observe_entry(self.entry, error, used * p)
        return used

    def save(self) -> None:
        """Remembers the noise levels for `rollback`."""
        self.noise.save()
        self.force.save()

    def rollback(self) -> None:
        """The noise levels as at the last `save`."""
        self.noise.rollback()
        self.force.rollback()

    @property
    def is_finite(self) -> bool:
        """Whether its noise levels are numbers."""
        return math.isfinite(self.noise.variance + self.noise.samples + self.force.density)
