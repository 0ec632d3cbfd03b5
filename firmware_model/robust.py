"""The estimator of the vertical plane that stands sensor noise: a prediction-error filter and its guards."""

import math
from collections.abc import Mapping
from typing import Any

from firmware_model.config import EstimatorConfig
from firmware_model.conversion import car_from_physical
from firmware_model.estimate import PARAMETERS, Estimate
from firmware_model.excitation import MovingVariance
from firmware_model.prediction_error import PredictionError
from firmware_model.propagation import A1, A2, A3, B1, B2
from firmware_model.restart_budget import RestartBudget
from firmware_model.sample import Sample
from firmware_model.sensor import Sensor
from firmware_model.state import require
from firmware_model.status import Status
from firmware_model.tally import Tally
from firmware_model.time_grid import TimeGrid
from firmware_model.validity import Validity
from firmware_model.waiting_samples import WaitingSamples

SCHEMA = 1
ENTRIES = dict(zip(PARAMETERS, (A1, A2, A3, B1, B2), strict=True))
CHECK_PERIOD_S = 1.0
"""Time between two checks of which parameters are valid."""
MOTION_OVER_NOISE = 2.0
"""Pitch that moves less than so many times its sensor's noise tells nothing: a plane that answers noise."""
MOST_RESTARTS, RESTART_REGAIN_S = 5, 60.0
SPEED_SPREAD_S = 60.0
"""Averaging time of the measured speed and its spread, as they are reported."""
HIGHEST_SPEED = 50.0
"""m/s; what is said to be more is no speed."""


class RobustEstimator:
    """Estimates a1, a2, a3, b1, b2 and u0 from depth, pitch and stern plane while they come in.

    Any value of a sample may be NaN, and samples may be missing: what was measured is used. A sample without
    a rudder waits for the next one that has it: if the rudder came back the same, it was held; if another,
    it turned once on the way, nobody knows when. Without it for more than `rudder_hold` s the states of the
    vehicle start anew and the parameters are kept.
    A sensor is followed once its last values agree, and for a while only where they agree: while nothing is
    known of the states, a spike would pass for a movement, and the parameters be bent to explain it.
    A measured speed is taken as it comes (the median of the last three), and held.
    """

    def __init__(self, config: EstimatorConfig) -> None:
        self.config = config
        self._filter = PredictionError(config)
        self._longest_hold = max(1, round(config.robust.rudder_hold / config.step))
        self._grid = TimeGrid(config.step, self._longest_hold)
        self._rudder_motion = MovingVariance(config.excitation_time / config.step)
        self._pitch_motion = MovingVariance(config.excitation_time / config.step)
        self._speed = MovingVariance(SPEED_SPREAD_S / config.step)
        self._gate = math.inf if config.outlier_gate is None else config.outlier_gate
        self._check_period = max(1, round(CHECK_PERIOD_S / config.step))
        self._validity = Validity((*PARAMETERS, "u0", "c_wq"), config.valid_below, config.invalid_above)
        self._budget = RestartBudget(MOST_RESTARTS, RESTART_REGAIN_S, config.step)
        self._tally = Tally()
        self._is_frozen = False
        self._speeds = [math.nan, math.nan, math.nan]
        self._outliers = {self._filter.pitch: 0, self._filter.depth: 0}
        self._rudder = math.nan  # as measured last; NaN while the states are not followed
        self._waiting = WaitingSamples(self._longest_hold)
        self._rest = 0.0  # s without excitation
        self._faults = 0

    def update(self, sample: Sample) -> Status:
        """Takes one sample. Never raises; what is refused changes nothing but a count."""
        status = self._update(sample)
        self._tally.note(status)
        return status

    def _update(self, sample: Sample) -> Status:
        for value in (sample.depth, sample.pitch, sample.rudder, sample.speed, sample.pitch_rate):
            if math.isinf(value):
                return Status.REFUSED_NON_FINITE
        refusal = self._grid.check(sample.t_us)
        if refusal is not None:
            return refusal
        if math.isnan(sample.depth) and math.isnan(sample.pitch) and math.isnan(sample.rudder):
            self._tally.samples += 1  # as good as missing: what it lacks is bridged with the next one
            return Status.WAITING
        if math.isnan(sample.rudder) and not math.isnan(self._rudder):
            return self._wait(sample, self._grid.missed + 1)
        self._filter.save()
        status = self._follow(sample, self._grid.missed)
        if not self._filter.is_finite:
            self._recover()
            return Status.FAULT_NUMERICAL
        self._faults = 0
        self._grid.accept(sample.t_us)
        self._tally.samples += 1
        if self._tally.samples % self._check_period == 0:
            self._check()
        return status

    def _wait(self, sample: Sample, instant: int) -> Status:
        """Keeps a sample until the rudder is known, `instant` after it was known last."""
        if instant <= self._waiting.newest:
            return Status.REFUSED_STALE
        self._tally.samples += 1
        self._take_speed(sample.speed)
        if instant > self._longest_hold:
            self._lose_states()
        else:
            self._waiting.put(instant, sample.pitch, sample.depth)
        return Status.WAITING

    def _recover(self) -> None:
        """Back to the last good estimate; after faults in a row the states start anew, or all stops."""
        self._filter.rollback()
        self._faults += 1
        if self._faults >= self.config.outlier_limit:
            self._faults = 0
            self._lose_states()
            if not self._budget.take():
                self._is_frozen = True

    def _lose_states(self) -> None:
        """The next sample that has a rudder starts the states anew."""
        self._rudder = math.nan
        self._waiting.clear()

    def _follow(self, sample: Sample, missed: int) -> Status:
        """One sample of the grid that comes `missed` instants after the one before."""
        if missed > self._longest_hold:
            self._lose_states()
            self._rest = 0.0
            missed = 0
        self._take_speed(sample.speed)
        is_excited = self._observe_motion(sample, missed + 1)
        if self._is_frozen or self._rest > self.config.rest_time:
            self._lose_states()
            return Status.FROZEN if self._is_frozen else Status.NOT_EXCITED
        if math.isnan(self._rudder):
            if math.isnan(sample.rudder):
                return Status.WAITING
            self._filter.restart()
            is_new = True
        else:
            is_new = not self._filter.is_started
            self._bridge(sample.rudder, missed + 1, is_excited)
        status = self._learn(sample.pitch, sample.depth)
        self._rudder = sample.rudder
        self._waiting.clear()
        return Status.RESTARTED if is_new and status is Status.UPDATED and self._tally.updates > 1 else status

    def _bridge(self, rudder: float, instants: int, is_excited: bool) -> None:
        """Predicts to this sample, learning on the way from those that waited for its rudder.

        If it turned by `change` at one of n instants, each as likely, it has turned at instant j with the
        chance p = j/n: its mean is on a straight line, and its error has the variance p (1 - p) change^2 and
        lasts for n step/2, so that the moment it gives has the variance of the time at which the rudder
        turned.
        """
        change = rudder - self._rudder
        for j in range(instants):
            p = j / instants
            doubt = p * (1.0 - p) * change * change * instants * self.config.step / 2.0
            self._filter.predict(self._rudder + p * change, is_excited, doubt)
            pitch, depth = self._waiting.at(j + 1)
            if j + 1 < instants and not (math.isnan(pitch) and math.isnan(depth)):
                self._pitch_motion.update(pitch)
                self._tally.note(self._learn(pitch, depth))

    def _take_speed(self, speed: float) -> None:
        """The median of the last three measured speeds is the speed: one wrong value does nothing."""
        if not abs(speed) <= HIGHEST_SPEED:
            return
        self._speed.update(speed)
        recent = self._speeds
        for k in (0, 1):
            recent[k] = recent[k + 1] if self._filter.is_speed_known else speed
        recent[2] = speed
        a, b, c = recent
        self._filter.measure_speed(max(min(a, b), min(max(a, b), c)), self._tally.updates > 0)

    def _observe_motion(self, sample: Sample, instants: int) -> bool:
        """Whether rudder and pitch move enough to tell anything; counts the time in which they do not."""
        self._rudder_motion.update(sample.rudder)
        self._pitch_motion.update(sample.pitch)
        threshold = self.config.excitation_threshold
        noise = self._filter.pitch.noise.variance
        is_excited = threshold == 0.0 or (
            self._rudder_motion.std >= threshold
            and self._pitch_motion.variance > (1.0 + MOTION_OVER_NOISE * MOTION_OVER_NOISE) * noise
        )
        self._rest = 0.0 if is_excited else self._rest + instants * self.config.step
        return is_excited

    def _learn(self, pitch_value: float, depth_value: float) -> Status:
        own = self._filter
        own.window.learn(own.ud)
        pitch = self._learn_value(own.pitch, pitch_value)
        depth = self._learn_value(own.depth, depth_value)
        own.settle()
        if pitch is Status.UPDATED or depth is Status.UPDATED:
            self._tally.updates += 1
            self._budget.pass_sample()
        for status in (Status.REFUSED_OUTLIER, Status.RESTARTED):
            if status in (pitch, depth):
                return status
        if own.heave_is_at_bound or own.pitch_is_at_bound:
            return Status.AT_BOUND
        return Status.UPDATED if Status.UPDATED in (pitch, depth) else Status.WAITING

    def _learn_value(self, sensor: Sensor, value: float) -> Status:
        """One measured value; outliers that do not end mean that the sensor has another datum."""
        if math.isnan(value):
            return Status.WAITING
        if not self._filter.admits(sensor, value):
            return Status.REFUSED_OUTLIER if sensor.is_started else Status.WAITING
        if not sensor.is_outlier(self._filter.ud, value, self._gate):
            self._outliers[sensor] = 0
            self._filter.learn(sensor, value)
            return Status.UPDATED
        self._outliers[sensor] += 1
        is_brief = self._outliers[sensor] <= self.config.outlier_limit
        if is_brief or not sensor.has_settled(self._outliers[sensor]) or not self._budget.take():
            return Status.REFUSED_OUTLIER
        self._outliers[sensor] = 0
        if sensor is self._filter.pitch:
            self._filter.restart_pitch()
        else:
            self._filter.restart_depth()
        self._filter.learn(sensor, value)
        return Status.RESTARTED

    def _check(self) -> None:
        """Decides what is valid. Nothing is, that depends on a parameter at the bound of what it can be."""
        own, ud = self._filter, self._filter.ud
        heave_is_possible = not own.heave_is_at_bound
        pitch_is_possible = not own.pitch_is_at_bound
        for name, entry in ENTRIES.items():
            is_possible = heave_is_possible if name in ("a1", "b1") else pitch_is_possible
            std = math.sqrt(ud.covariance(entry, entry))
            self._validity.check(name, ud.x[entry], std, is_possible and self._tally.updates > 0)
        u0, std = self._u0
        if own.is_speed_known:
            std = 0.0  # it varies, but it is known
        self._validity.check("u0", u0, std, own.is_speed_known or heave_is_possible)
        # A coupling may well be zero: it is known when it is known to a small part of the speed.
        c_wq, std = own.coupling
        self._validity.check("c_wq", max(abs(c_wq), abs(u0)), std, heave_is_possible and own.has_coupling)

    @property
    def _u0(self) -> tuple[float, float]:
        """Forward speed and its standard deviation, or the spread of the measured one."""
        if self._filter.is_speed_known:
            return self._speed.mean if math.isfinite(
                self._speed.mean
            ) else self._filter.speed, self._speed.std
        return self._filter.speed_estimate

    def estimate(self) -> Estimate:
        """What is believed now. Costs less than an update."""
        ud = self._filter.ud
        is_known = self._tally.updates > 0
        values = {name: ud.x[entry] if is_known else math.nan for name, entry in ENTRIES.items()}
        std = {
            name: math.sqrt(ud.covariance(entry, entry)) if is_known else math.nan
            for name, entry in ENTRIES.items()
        }
        u0, std["u0"] = self._u0
        c_wq, std["c_wq"] = self._filter.coupling
        heave_offset, pitch_offset, std["heave_offset"], std["pitch_offset"] = self._filter.trim
        car_pitch, car_depth = car_from_physical(**values, u0=u0, h=self.config.step)
        return Estimate(
            **values,
            u0=u0,
            c_wq=c_wq,
            heave_offset=heave_offset,
            pitch_offset=pitch_offset,
            std=std,
            valid=dict(self._validity.valid),
            car_pitch=car_pitch,
            car_depth=car_depth,
            samples=self._tally.samples,
            updates=self._tally.updates,
            refused=dict(self._tally.refused),
            status=self._tally.status,
            seconds=self._tally.updates * self.config.step,
        )

    @property
    def is_frozen(self) -> bool:
        """Whether learning is switched off, by the user or after numerical faults without end."""
        return self._is_frozen

    def freeze(self) -> None:
        """Stops learning and keeps what was learnt."""
        self._is_frozen = True

    def enable(self) -> None:
        """Learns again after `freeze`; the states start anew."""
        self._is_frozen = False
        self._budget.reset()

    def forget_rows(self) -> None:
        """Joins nothing across this moment: the vehicle rebooted and its clock may start anew."""
        self._grid.forget()
        self._rudder_motion.reset()
        self._pitch_motion.reset()
        self._lose_states()
        self._rest = 0.0
        self._faults = 0
        for sensor in self._outliers:
            self._outliers[sensor] = 0

    def reset(self) -> None:
        """Forgets everything: the estimator is as constructed, learning enabled."""
        self.forget_rows()
        self._filter.reset()
        self._speed.reset()
        self._validity.reset()
        self._budget.reset()
        self._tally.reset()
        self._is_frozen = False

    def _settings(self) -> dict[str, object]:
        """What a saved state must have in common with this estimator."""
        own = self.config.robust
        return {
            "schema": SCHEMA,
            "method": "robust",
            "step": self.config.step,
            "heave_pitch_rate_coupling": own.heave_pitch_rate_coupling,
        }

    def state(self) -> dict[str, Any]:
        """What was learnt, as plain dicts and lists fit for JSON; without the signals under way."""
        return {
            **self._settings(),
            **self._tally.state(),
            "filter": self._filter.state(),
            "valid": self._validity.state(),
            "is_frozen": self._is_frozen,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Goes on from a saved state, as after `forget_rows`.

        Raises ValueError, and changes nothing, if the state does not fit this estimator.
        """
        for name, value in self._settings().items():
            require(state.get(name) == value, f"state.{name} must be {value}", state.get(name))
        for name, kind in {"filter": dict, "valid": list, "is_frozen": bool}.items():
            held = state.get(name)
            require(isinstance(held, kind), f"state.{name} must be a {kind.__name__}", held)
        tally = self._tally.read(state)
        numbers = self._filter.read(state["filter"])
        self.reset()
        self._filter.restore(numbers)
        self._tally.restore(tally)
        self._validity.restore(state["valid"])
        self._is_frozen = state["is_frozen"]
