"""One measured entry of the state, its noise, and the unknown force that shows in it."""

import math

from firmware_model.noise_levels import LIKELY, ForceNoise, SensorNoise
from firmware_model.recent_values import RecentValues
from firmware_model.ud_factors import UdFactors

HUBER = 3.0
"""Standard deviations beyond which a sample's influence does not grow any more."""
STATE_GATE = 5.0
"""Standard deviations of the state by which a value may be off."""
OPENING = 5
"""Values that must agree before a sensor is followed, and values after that which must agree with them."""
PATIENCE = 15
"""Values in which to agree as closely as noise allows; then some scatter is taken for motion."""


class Sensor:
    """Measures x[entry] with white noise; the first value after a restart says where the entry is.

    resolution  below it no difference is an outlier
    """

    def __init__(self, entry: int, noise: SensorNoise, force: ForceNoise, resolution: float) -> None:
        self.entry = entry
        self.noise = noise
        self.force = force
        self._resolution = resolution
        self._recent = RecentValues(OPENING)
        self.restart()

    def restart(self) -> None:
        """The next value is the first."""
        self.is_started = False
        self._opening = OPENING
        self._waited = 0
        self.force.forget()

    def clear(self) -> None:
        """Forgets the last values: what comes next does not follow them in time."""
        self._recent.clear()

    def admits(self, instant: int, value: float) -> bool:
        """Whether the value may be learnt from, if it is where it is expected.

        What is known of the states after a start would let any value pass; so until some more have come, only
        one that belongs to the last values may.
        """
        self._recent.put(instant, value)
        if self._opening == 0:
            return True
        if self.is_started:
            self._opening -= 1
            return self._recent.newest_belongs(math.sqrt(self.noise.variance))
        self._waited += 1
        return self.has_settled(self._waited)

    def has_settled(self, waited: int) -> bool:
        """Whether the newest of `waited` values lies where most of the last ones do: a start may be made."""
        return self._recent.newest_belongs(math.sqrt(self.noise.variance), is_strict=waited <= PATIENCE)

    def reset(self) -> None:
        """Forgets the noise too."""
        self.noise.reset()
        self.force.reset()
        self.clear()
        self.restart()

    def is_outlier(self, ud: UdFactors, value: float, gate: float) -> bool:
        """Whether the value is too far from where it is expected.

        That is `gate` standard deviations of the sensor, and fewer of what is not known of the state: where
        little is known, `gate` of them would let any spike pass.
        """
        if not self.is_started:
            return False
        error = value - ud.x[self.entry]
        unknown = min(gate, STATE_GATE)
        least = max(self.noise.variance, self._resolution * self._resolution)
        limit = gate * gate * least + unknown * unknown * ud.covariance(self.entry, self.entry)
        return not error * error <= limit

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
