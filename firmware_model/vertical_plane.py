"""Both channels of the paper's CAR model, sample by sample on the time grid."""

import math
from collections.abc import Callable, Mapping
from dataclasses import astuple, replace
from typing import Any

from firmware_model.car import DEPTH_LAGS, PITCH_LAGS, CarRow
from firmware_model.channel import Channel
from firmware_model.config import EstimatorConfig, forgetting_factor
from firmware_model.conversion import Physical, physical_from_car, physical_std_from_car
from firmware_model.delta import DeltaCoordinates
from firmware_model.estimate import PARAMETERS, Estimate
from firmware_model.excitation import MovingVariance
from firmware_model.mils import Mils
from firmware_model.sample import Sample
from firmware_model.state import finite_numbers, require
from firmware_model.status import Status
from firmware_model.tally import Tally
from firmware_model.time_grid import TimeGrid
from firmware_model.validity import Validity

SCHEMA = 1
CHECK_PERIOD_S = 1.0
"""Time between two checks of which parameters are valid."""


class VerticalPlaneEstimator:
    """Estimates a1, a2, a3, b1, b2 by multi-innovation least squares on the rows of the CAR model.

    Noise on the sensors biases it, see `RobustEstimator`. Instants without a sample, and values that are NaN,
    are missing: no row holds them. After a gap longer than the rows it starts anew.
    """

    def __init__(self, config: EstimatorConfig, *, real: Callable[[float], Any] = float) -> None:
        self.config = config
        own = config.mils

        def channel(
            lags: tuple[tuple[int, ...], tuple[int, ...]], memory: float | None, resolution: float
        ) -> Channel:
            n = len(lags[0]) + len(lags[1])
            forgetting = forgetting_factor(memory, config.step)
            return Channel(
                CarRow(*lags),
                Mils(n, own.innovation_length, forgetting, own.p0, cap=own.covariance_cap, real=real),
                gate=math.inf if config.outlier_gate is None else config.outlier_gate,
                limit=config.outlier_limit,
                resolution=resolution,
                coordinates=self._delta if lags is DEPTH_LAGS else None,
            )

        self._delta = DeltaCoordinates(config.step)
        self._pitch = channel(PITCH_LAGS, own.pitch_forgetting_time, config.pitch_resolution)
        self._depth = channel(DEPTH_LAGS, own.depth_forgetting_time, config.depth_resolution)
        self._span = max(self._pitch.row.span, self._depth.row.span)
        self._grid = TimeGrid(config.step, self._span)
        window = config.excitation_time / config.step
        self._rudder_motion = MovingVariance(window)
        self._pitch_motion = MovingVariance(window)
        self._speed = MovingVariance(own.speed_time / config.step)
        self._check_period = max(1, round(CHECK_PERIOD_S / config.step))
        self._validity = Validity(PARAMETERS, config.valid_below, config.invalid_above)
        self._tally = Tally()
        self._is_frozen = False

    def update(self, sample: Sample) -> Status:
        """Takes one sample. Never raises; a refused sample changes nothing but its count.

        Checked in this order: infinite values, time, outlier; then FROZEN, WAITING, NOT_EXCITED; else both
        channels learn, and the more serious status of the two is returned.
        """
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
        self._pass_over(self._grid.missed)
        # An outlier leaves no trace: only a row without a gap can show one, so nothing was passed over.
        pitch_is_outlier = self._pitch.face(sample.pitch)
        depth_is_outlier = self._depth.face(sample.depth)
        if (pitch_is_outlier or depth_is_outlier) and not self._is_frozen:
            return Status.REFUSED_OUTLIER
        self._grid.accept(sample.t_us)
        self._tally.samples += 1
        self._rudder_motion.update(sample.rudder)
        self._pitch_motion.update(sample.pitch)
        self._speed.update(sample.speed)
        status = self._learn()
        self._pitch.push(sample.pitch, sample.rudder)
        self._depth.push(sample.depth, sample.rudder)
        if self._tally.samples % self._check_period == 0:
            self._check()
        return status

    def _pass_over(self, missed: int) -> None:
        """Lets `missed` instants go by without a sample."""
        if missed >= self._span:
            self._pitch.forget_rows()
            self._depth.forget_rows()
            return
        for _ in range(missed):
            self._pitch.push(math.nan, math.nan)
            self._depth.push(math.nan, math.nan)

    def _learn(self) -> Status:
        if self._is_frozen:
            return Status.FROZEN
        if not (self._pitch.is_ready or self._depth.is_ready):
            return Status.WAITING
        threshold = self.config.excitation_threshold
        if self._rudder_motion.std < threshold and self._pitch_motion.std < threshold:
            return Status.NOT_EXCITED
        statuses = (self._pitch.learn(), self._depth.learn())
        self._tally.updates += 1
        for status in (Status.FAULT_NUMERICAL, Status.CAPPED):
            if status in statuses:
                return status
        return Status.UPDATED

    def _check(self) -> None:
        """Decides what is valid.

        Nothing is whose channel has a damping that the step cannot show, or negative damping: noise on the
        sensors leads least squares there, with a small standard deviation.
        """
        values, std = self._physical()
        heave_is_damped = -1.0 < self.config.step * values.a1 < 0.0
        pitch_is_damped = -1.0 < self.config.step * values.a2 < 0.0
        for name in PARAMETERS:
            is_damped = heave_is_damped if name in ("a1", "b1") else pitch_is_damped
            self._validity.check(name, getattr(values, name), getattr(std, name), is_damped)

    def _physical(self) -> tuple[Physical, Physical]:
        """Values and standard deviations; NaN for those of a channel with fewer rows than parameters."""
        h = self.config.step
        pitch, depth = self._pitch.mils, self._depth.mils
        unknown = Physical(a1=math.nan, a2=math.nan, a3=math.nan, b1=math.nan, b2=math.nan)
        if pitch.updates < pitch.n:
            return unknown, unknown
        alpha, alpha_covariance = pitch.theta, pitch.error_covariance.tolist()
        beta = self._delta.beta(depth.theta)
        if depth.updates < depth.n:
            nothing = [[0.0] * depth.n] * depth.n
            values = physical_from_car(alpha, beta, self._u0, h)
            std = physical_std_from_car(alpha, beta, self._u0, h, alpha_covariance, nothing)
            return replace(values, a1=math.nan, b1=math.nan), replace(std, a1=math.nan, b1=math.nan)
        beta_covariance = self._delta.beta_covariance(depth.error_covariance).tolist()
        return (
            physical_from_car(alpha, beta, self._u0, h, beta_covariance),
            physical_std_from_car(alpha, beta, self._u0, h, alpha_covariance, beta_covariance),
        )

    @property
    def _u0(self) -> float:
        return self._speed.mean if math.isfinite(self._speed.mean) else self.config.speed

    def estimate(self) -> Estimate:
        """What is believed now. Costs about as much as ten updates."""
        values, std = self._physical()
        a1, a2, a3, b1, b2 = astuple(values)
        return Estimate(
            a1=a1,
            a2=a2,
            a3=a3,
            b1=b1,
            b2=b2,
            u0=self._u0,
            std={**{name: getattr(std, name) for name in PARAMETERS}, "u0": self._speed.std},
            valid={**self._validity.valid, "u0": True},
            car_pitch=self._pitch.mils.theta,
            car_depth=self._delta.beta(self._depth.mils.theta),
            samples=self._tally.samples,
            updates=self._tally.updates,
            refused=dict(self._tally.refused),
            status=self._tally.status,
            seconds=self._tally.updates * self.config.step,
        )

    @property
    def is_frozen(self) -> bool:
        """Whether learning is switched off."""
        return self._is_frozen

    def freeze(self) -> None:
        """Stops learning; the rows follow the samples, so `enable` goes on at once."""
        self._is_frozen = True

    def enable(self) -> None:
        """Learns again after `freeze`."""
        self._is_frozen = False

    def forget_rows(self) -> None:
        """Joins nothing across this moment: the vehicle rebooted and its clock may start anew."""
        self._grid.forget()
        self._pitch.forget_rows()
        self._depth.forget_rows()
        self._rudder_motion.reset()
        self._pitch_motion.reset()

    def reset(self) -> None:
        """Forgets everything: the estimator is as constructed, learning enabled."""
        self.forget_rows()
        self._pitch.mils.reset()
        self._depth.mils.reset()
        self._speed.reset()
        self._validity.reset()
        self._tally.reset()
        self._is_frozen = False

    def _settings(self) -> dict[str, object]:
        """What a saved state must have in common with this estimator."""
        return {
            "schema": SCHEMA,
            "method": "mils",
            "step": self.config.step,
            "innovation_length": self.config.mils.innovation_length,
        }

    def state(self) -> dict[str, Any]:
        """What was learnt, as plain dicts and lists fit for JSON; without the signals under way."""
        return {
            **self._settings(),
            **self._tally.state(),
            "pitch": self._pitch.mils.state(),
            "depth": self._depth.mils.state(),
            "speed": [self._speed.mean, self._speed.variance] if math.isfinite(self._speed.mean) else [],
            "valid": self._validity.state(),
            "is_frozen": self._is_frozen,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Goes on from a saved state, as after `forget_rows`.

        Raises ValueError, and changes nothing, if the state does not fit this estimator.
        """
        for name, value in self._settings().items():
            require(state.get(name) == value, f"state.{name} must be {value}", state.get(name))
        speed = finite_numbers(state, "speed", None)
        require(len(speed) in (0, 2), "state.speed must hold mean and variance or nothing", len(speed))
        require(not speed or speed[1] >= 0.0, "state.speed must hold a variance of 0 or more", speed)
        for name, kind in {"pitch": dict, "depth": dict, "valid": list, "is_frozen": bool}.items():
            held = state.get(name)
            require(isinstance(held, kind), f"state.{name} must be a {kind.__name__}", held)
        tally = self._tally.read(state)
        before = self._pitch.mils.state()
        self._pitch.mils.restore(state["pitch"])
        try:
            self._depth.mils.restore(state["depth"])
        except ValueError:
            self._pitch.mils.restore(before)
            raise
        self.forget_rows()
        self._speed.reset()
        if speed:
            self._speed.mean, self._speed.variance = speed
        self._validity.restore(state["valid"])
        self._tally.restore(tally)
        self._is_frozen = state["is_frozen"]
