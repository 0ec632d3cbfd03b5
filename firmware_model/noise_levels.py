"""How noisy the sensors are, and how strong the forces that the equations do not hold: learnt on the way."""

import math

LIKELY = 9.0
"""Squared normalised innovations count up to here: one outlier must not raise a level by much."""
LIKELY_MEAN = 0.9974
"""Mean of min(chi-squared of one degree, LIKELY)."""

LOWEST = 2.5e-5
"""Share of the first level of a force below which it does not sink."""
EARLY = 5.0
"""Samples that the configured level counts for."""


class SensorNoise:
    """Variance R of one sensor's white noise.

    An innovation of variance S = P + R and the residual that is left of it after the update have the mean
    product R. So with nu = e^2/S the variance follows R <- R + R (R/S)^2 (nu - 1)/N, where the weight (R/S)^2
    leaves out samples that tell more of the state than of the sensor, and N grows to `memory` of such
    samples.
    """

    def __init__(self, variance: float, lowest: float, memory: float) -> None:
        self._first = variance
        self._lowest = lowest
        self._memory = memory
        self.reset()

    def reset(self) -> None:
        self.variance = self._first
        self.samples = 0.0
        self.save()

    def save(self) -> None:
        """Remembers the level for `rollback`."""
        self._good = (self.variance, self.samples)

    def rollback(self) -> None:
        """The level as at the last `save`."""
        self.variance, self.samples = self._good

    def learn(self, innovation_variance: float, squared: float) -> None:
        """squared  nu = e^2/S"""
        share = self.variance / innovation_variance
        weight = share * share
        self.samples += weight
        count = self.samples + EARLY
        if count > self._memory:
            count = self._memory
        change = weight * ((squared if squared < LIKELY else LIKELY) - LIKELY_MEAN) / count
        self.variance *= 1.0 + change
        if self.variance < self._lowest:
            self.variance = self._lowest


class ForceNoise:
    """Density of a white force, so that innovations come out white.

    Forces that are not modelled make successive innovations alike. The level rises while their correlation is
    above `target` and falls while it is below:

        density <- density exp(gain h (rho - target)),   rho the mean of u(k) U(k-1), U past u faded over
        `time`
    """

    def __init__(self, step: float, *, first: float, highest: float, target: float, time: float) -> None:
        self._first = first
        self._highest = highest
        self._lowest = LOWEST * first
        self._target = target
        self._fade = math.exp(-step / time)
        self._keep = math.sqrt(1.0 - self._fade * self._fade)
        self._mean = min(step / (10.0 * time), 0.2)
        self._gain = step / time
        self.reset()

    def reset(self) -> None:
        self.density = self._first
        self.forget()

    def forget(self) -> None:
        """Keeps the level, and begins a new stretch of time."""
        self._past = 0.0
        self._alike = 0.0
        self.save()

    def save(self) -> None:
        """Remembers the level for `rollback`."""
        self._good = (self.density, self._past, self._alike)

    def rollback(self) -> None:
        """The level as at the last `save`."""
        self.density, self._past, self._alike = self._good

    def learn(self, innovation: float) -> None:
        """innovation  normalised to a variance of 1"""
        highest = math.sqrt(LIKELY)
        u = min(max(innovation, -highest), highest)
        self._alike += self._mean * (u * self._past - self._alike)
        self._past = self._fade * self._past + self._keep * u
        excess = min(max(self._alike - self._target, -0.5), 0.5)
        density = self.density * math.exp(self._gain * excess)
        self.density = min(max(density, self._lowest), self._highest)
