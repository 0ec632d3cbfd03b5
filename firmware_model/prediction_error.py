"""Recursive prediction-error identification of the vertical plane: parameters and states in one filter.

The extended state holds nine parameters and the four states of `firmware_model.propagation`. Between samples
it moves by the exact solution of the equations; each sample corrects it by its prediction error. This is the
extended Kalman filter as a parameter estimator (L. Ljung, IEEE Trans. Automatic Control 24(1), 1979), with
what it takes to make it converge from anywhere and believe itself no more than it should: second-order terms,
the product gamma = a1 kappa learnt late, noise levels learnt on the way, a bounded influence of each sample
(P. J. Huber, Ann. Math. Statist. 35(1), 1964), and a window of innovations whose reuse is paid for.
"""

import math
from collections.abc import Mapping
from typing import Any

from firmware_model.config import EstimatorConfig
from firmware_model.innovation_window import InnovationWindow
from firmware_model.noise_levels import ForceNoise, SensorNoise
from firmware_model.prior import Prior
from firmware_model.propagation import (
    A1,
    A2,
    A3,
    B1,
    B2,
    COUNT,
    GAMMA,
    HEAVE_TRIM,
    KAPPA,
    PATTERN,
    PITCH_TRIM,
    THETA,
    ZETA,
    Propagation,
    Q,
    W,
)
from firmware_model.second_order import SecondOrder
from firmware_model.sensor import Sensor
from firmware_model.state import finite_numbers, require
from firmware_model.ud_factors import UdFactors

SUBSTEP = 0.101
"""Longest interval of one propagation, in pitch times; the products' variance must not change much within."""
SENSOR_MEMORY = 1000.0
"""Samples over which a sensor's noise is averaged."""
SELF_ANNEALING = (4.0, 1.0)
"""Weights of the second-order variance in heave and in pitch, in pitch times."""
PRODUCT_CAUTION = 40.0
"""The product gamma = a1 kappa is taken as known to this many times its second-order variance,"""
PRODUCT_PROGRESS = 0.25
"""and learnt again each time this variance has shrunk to this share."""
EXACT = 1e-12
"""Variance of what is known exactly."""
CORRELATION = 0.02
"""Mean correlation of innovations that counts as white; a little above zero: forces must not fade out."""
HIGHEST_FORCE = 2000.0
"""Density of unknown forces over that at the start, to which it may rise."""
WANDERING = (A1, A2, A3, B1, B2, KAPPA, HEAVE_TRIM, PITCH_TRIM)


class PredictionError:
    """The filter, without guards: see `RobustEstimator` for those."""

    def __init__(self, config: EstimatorConfig) -> None:
        own = config.robust
        self._step = config.step
        self._coupling = own.heave_pitch_rate_coupling
        self._configured_speed = config.speed
        self._prior = Prior(config)
        T = config.pitch_time
        self._annealing = (SELF_ANNEALING[0] * T, SELF_ANNEALING[1] * T)
        self._drift = own.drift * own.drift / 100.0
        self._substeps = max(1, math.ceil(config.step / (SUBSTEP * T)))
        self._interval = config.step / self._substeps
        self._propagation = Propagation(self._interval)
        self._moments = SecondOrder()
        self._noise = [0.0, 0.0]
        self._row = [0.0] * COUNT
        self.window = InnovationWindow(own.innovation_length)
        self.ud = UdFactors(COUNT, PATTERN, driven=(0, 1))

        def sensor(entry: int, std: float, resolution: float, first: float) -> Sensor:
            highest = HIGHEST_FORCE * first
            return Sensor(
                entry,
                SensorNoise(std * std, resolution * resolution / 12.0, SENSOR_MEMORY),
                ForceNoise(config.step, first=first, highest=highest, target=CORRELATION, time=0.5 * T),
                resolution,
            )

        heave, pitch = self._prior.forces
        self.pitch = sensor(THETA, own.pitch_noise, config.pitch_resolution, pitch)
        self.depth = sensor(ZETA, own.depth_noise, config.depth_resolution, heave)
        self.reset()

    def reset(self) -> None:
        """Forgets everything learnt."""
        self.speed = self._configured_speed
        self.is_speed_known = False
        self._set_prior()
        self.heave_is_at_bound = False
        self.pitch_is_at_bound = False
        for sensor in (self.pitch, self.depth):
            sensor.reset()
        self._instant = 0
        self.restart()

    def _set_prior(self) -> None:
        ud = self.ud
        for j in range(W):
            ud.x[j] = self._prior.mean[j]
            ud.D[j] = self._prior.variance[j]
            for i in range(j + 1, COUNT):
                ud.L[j][i] = 0.0
        self._product_variance = math.inf
        self._turn = 0

    def save(self) -> None:
        """Remembers everything for `rollback`."""
        self.ud.save()
        for sensor in (self.pitch, self.depth):
            sensor.save()

    def rollback(self) -> None:
        """The last good estimate, with an empty window."""
        self.ud.rollback()
        self.window.clear()
        for sensor in (self.pitch, self.depth):
            sensor.rollback()

    @property
    def is_finite(self) -> bool:
        """Whether all numbers are finite."""
        return self.ud.is_finite and self.pitch.is_finite and self.depth.is_finite

    def restart(self) -> None:
        """Forgets the states and keeps the parameters, as after a gap."""
        self.pitch.clear()
        self.depth.clear()
        self._forget_states()

    def _forget_states(self) -> None:
        for entry in (W, Q, THETA, ZETA):
            self.ud.forget(entry, 0.0, self._prior.variance[entry])
        self.pitch.restart()
        self.depth.restart()
        self.window.clear()

    def restart_depth(self) -> None:
        """Forgets the depth alone: its sensor was set to another datum."""
        self.ud.forget(ZETA, 0.0, self._prior.variance[ZETA])
        self.depth.restart()
        self.window.clear()

    def restart_pitch(self) -> None:
        """Forgets the states and the trims: a pitch of another datum needs other forces to hold it."""
        self._forget_states()
        for entry in (HEAVE_TRIM, PITCH_TRIM):
            self._widen(entry, self._prior.variance[entry])

    def _widen(self, entry: int, variance: float) -> None:
        for j in range(COUNT):
            self._row[j] = 0.0
        self._row[entry] = 1.0
        self.ud.add(self._row, variance)

    @property
    def has_coupling(self) -> bool:
        """Whether pitch rate may act on heave."""
        return self.is_speed_known if self._coupling is None else self._coupling

    def measure_speed(self, speed: float, has_learnt: bool) -> None:
        """Takes the speed as known from here on. w, a velocity through the water, does not jump with it."""
        if not self.is_speed_known:
            self.is_speed_known = True
            # A coupling that was not allowed for until now may be hidden in what was learnt.
            if has_learnt and self._coupling is not None:
                self._adopt(speed)
            else:
                self._set_prior()
                self._forget_states()
                self.ud.D[GAMMA] = 0.0
                self.ud.D[KAPPA] = self._prior.coupling if self.has_coupling else 0.0
        self.speed = speed

    def _adopt(self, speed: float) -> None:
        """What was learnt with an estimated speed, given that the speed is this one."""
        ud = self.ud
        change = speed - self.speed
        ud.x[KAPPA] -= change
        ud.x[GAMMA] -= change * ud.x[A1]
        ud.L[A1][GAMMA] -= change
        ud.observe_entry(GAMMA, -ud.x[GAMMA], EXACT)
        if not self._coupling:
            ud.observe_entry(KAPPA, -ud.x[KAPPA], EXACT)
        self._forget_states()

    def predict(self, rudder: float, is_excited: bool, doubt: float = 0.0) -> None:
        """Moves one step on, the rudder held; `doubt` is the density of a white error in it, rad^2 s.

        The states stay what they are at the start until a sensor tells where they are.
        """
        self._instant += 1
        if not self.is_started:
            return
        ud, moments, noise = self.ud, self._moments, self._noise
        heave_doubt = doubt * (ud.x[B1] * ud.x[B1] + ud.covariance(B1, B1)) if doubt > 0.0 else 0.0
        pitch_doubt = doubt * (ud.x[B2] * ud.x[B2] + ud.covariance(B2, B2)) if doubt > 0.0 else 0.0
        for _ in range(self._substeps):
            moments.update(ud)
            heave = min(self._annealing[0] * moments.heave_variance, self._prior.caution[0])
            pitch = min(self._annealing[1] * moments.pitch_variance, self._prior.caution[1])
            noise[0] = self._interval * (heave + self.depth.force.density + heave_doubt)
            noise[1] = self._interval * (pitch + self.pitch.force.density + pitch_doubt)
            self._propagation.advance(ud.x, rudder, self.speed, moments.heave_mean, moments.pitch_mean)
            ud.move(self._propagation.F, noise)
            self.window.carry(self._propagation.F, noise)
        if self._drift > 0.0:
            self._wander(is_excited)

    def _wander(self, is_excited: bool) -> None:
        """Lets one parameter drift, each in its turn, as far as all would in one step; gamma goes with it.

        None drifts that is known exactly, nor while nothing can be learnt about it, nor beyond what was
        thought of it at first.
        """
        ud = self.ud
        self._product_variance *= 1.0 + self._step / 40.0
        entry = WANDERING[self._turn]
        self._turn = self._turn + 1 if self._turn + 1 < len(WANDERING) else 0
        prior = self._prior.variance[entry]
        size = max(ud.x[entry] * ud.x[entry], 0.0025 * prior)
        known = ud.covariance(entry, entry)
        if not is_excited or known == 0.0 or known >= min(prior, 0.04 * size):
            return
        row = self._row
        for j in range(COUNT):
            row[j] = 0.0
        row[entry] = 1.0
        if entry == A1:
            row[GAMMA] = ud.x[GAMMA] / ud.x[A1]
        if entry == KAPPA and not self.has_coupling:
            row[GAMMA] = ud.x[A1]
        ud.add(row, self._drift * size * self._step * len(WANDERING))

    @property
    def is_started(self) -> bool:
        """Whether a sensor tells where the vehicle is."""
        return self.pitch.is_started or self.depth.is_started

    def admits(self, sensor: Sensor, value: float) -> bool:
        """`Sensor.admits` at this instant."""
        return sensor.admits(self._instant, value)

    def learn(self, sensor: Sensor, value: float) -> None:
        """One update with a measured value."""
        used = sensor.learn(self.ud, value, self.window.p)
        if self.window.p > 1:
            self.window.add(sensor.entry, value - self.window.before(sensor.entry), used)

    def settle(self) -> None:
        """Ends an instant: the structure gamma = a1 kappa, the bounds of a stable vehicle, the window."""
        if self.depth.is_started and not self.has_coupling and not self.is_speed_known:
            self._learn_product()
        self.heave_is_at_bound = self._hold_within_bounds(A1)
        pitch_damping_is = self._hold_within_bounds(A2)
        self.pitch_is_at_bound = self._hold_within_bounds(A3) or pitch_damping_is
        self.window.settle(self.ud)

    def _hold_within_bounds(self, entry: int) -> bool:
        x, lower, upper = self.ud.x, self._prior.lower[entry], self._prior.upper[entry]
        if lower < x[entry] < upper:
            return False
        x[entry] = min(max(x[entry], lower), upper)
        return True

    def _learn_product(self) -> None:
        ud, row = self.ud, self._row
        a1, kappa = ud.x[A1], ud.x[KAPPA]
        together = ud.covariance(A1, KAPPA)
        variance = ud.covariance(A1, A1) * ud.covariance(KAPPA, KAPPA) + together * together
        if not variance < PRODUCT_PROGRESS * self._product_variance:
            return
        self._product_variance = variance
        for j in range(COUNT):
            row[j] = 0.0
        row[GAMMA], row[A1], row[KAPPA] = 1.0, -kappa, -a1
        ud.observe(row, a1 * kappa + together - ud.x[GAMMA], PRODUCT_CAUTION * variance + 1e-10)

    @property
    def trim(self) -> tuple[float, float, float, float]:
        """Forces of trim in heave, m/s^2, and pitch, rad/s^2, and their standard deviations."""
        ud = self.ud
        heave, pitch = ud.covariance(HEAVE_TRIM, HEAVE_TRIM), ud.covariance(PITCH_TRIM, PITCH_TRIM)
        return ud.x[HEAVE_TRIM], ud.x[PITCH_TRIM], math.sqrt(heave), math.sqrt(pitch)

    @property
    def speed_estimate(self) -> tuple[float, float]:
        """u0 and its standard deviation, m/s, where it is not measured."""
        if not self.has_coupling:
            return self.speed + self.ud.x[KAPPA], self._deviation(0.0, 1.0, 0.0)
        a1, gamma = self.ud.x[A1], self.ud.x[GAMMA]
        return self.speed + gamma / a1, self._deviation(-gamma / (a1 * a1), 0.0, 1.0 / a1)

    @property
    def coupling(self) -> tuple[float, float]:
        """c_wq of w' = ... + c_wq q and its standard deviation, m/s per rad; NaN where not estimated."""
        if not self.has_coupling:
            return math.nan, math.nan
        a1, gamma, kappa = self.ud.x[A1], self.ud.x[GAMMA], self.ud.x[KAPPA]
        return gamma / a1 - kappa, self._deviation(-gamma / (a1 * a1), -1.0, 1.0 / a1)

    def _deviation(self, by_a1: float, by_kappa: float, by_gamma: float) -> float:
        for j in range(COUNT):
            self._row[j] = 0.0
        self._row[A1], self._row[KAPPA], self._row[GAMMA] = by_a1, by_kappa, by_gamma
        return math.sqrt(self.ud.spread(self._row))

    def state(self) -> dict[str, Any]:
        """What was learnt, without the states of the vehicle."""
        sensors = (self.pitch, self.depth)
        return {
            "mean": self.ud.x[:W],
            "factor": [self.ud.L[j][i] for j in range(W) for i in range(j + 1, W)],
            "variance": self.ud.D[:W],
            "noise": [s.noise.variance for s in sensors] + [s.noise.samples for s in sensors],
            "force": [sensor.force.density for sensor in sensors],
            "product": [self._product_variance] if self._product_variance < math.inf else [],
            "speed": [self.speed] if self.is_speed_known else [],
        }

    def read(self, state: Mapping[str, Any]) -> dict[str, list[float]]:
        """The numbers of a saved state. Raises ValueError if they do not fit."""
        sizes = {"mean": W, "factor": W * (W - 1) // 2, "variance": W, "noise": 4, "force": 2}
        numbers = {name: finite_numbers(state, name, size) for name, size in sizes.items()}
        for name in ("product", "speed"):
            numbers[name] = finite_numbers(state, name, None)
            require(len(numbers[name]) <= 1, f"state.{name} must hold at most one number", numbers[name])
        require(min(numbers["variance"]) >= 0.0, "state.variance must not be negative", numbers["variance"])
        for name in ("noise", "force"):
            require(min(numbers[name][:2]) > 0.0, f"state.{name} must be above 0", numbers[name])
        return numbers

    def restore(self, numbers: Mapping[str, list[float]]) -> None:
        """Goes on from what `read` gave."""
        self.reset()
        ud = self.ud
        ud.x[:W] = numbers["mean"]
        ud.D[:W] = numbers["variance"]
        factor = iter(numbers["factor"])
        for j in range(W):
            for i in range(j + 1, W):
                ud.L[j][i] = next(factor)
        for k, sensor in enumerate((self.pitch, self.depth)):
            sensor.noise.variance = numbers["noise"][k]
            sensor.noise.samples = numbers["noise"][2 + k]
            sensor.force.density = numbers["force"][k]
        if numbers["product"]:
            self._product_variance = numbers["product"][0]
        if numbers["speed"]:
            self.speed = numbers["speed"][0]
            self.is_speed_known = True
