"""A free run over the last seconds against what arrived.

The reference runs on the plane movement alone, from the initial state that meets the window best. What no
initial state can explain is the prediction error.
"""

import math

import numpy as np

from firmware_model.sample import Sample
from host.live.reference import THETA, ZETA, Array, Reference

LEAST_PRESENT = 0.5  # share of a window's values that must have been measured
OUTLIER = 5.0  # standard deviations of a window's error, beyond which a value counts as not measured
MOST_OUTLIERS = 0.1  # share of a window; more of them are no outliers


class PredictionWindow:
    """The last `samples` samples on the time grid of `step` s."""

    def __init__(self, samples: int, step: float) -> None:
        self._step = step
        self._rows = np.full((samples, 4), math.nan)  # pitch, depth, rudder, speed
        self._filled = 0
        self._unheard = 0  # samples in a row without a plane
        self._t_us: int | None = None

    def clear(self) -> None:
        """Joins nothing across this moment."""
        self._filled = self._unheard = 0
        self._t_us = None

    def push(self, sample: Sample) -> None:
        """Takes the next sample; one that is not the next on the grid begins anew."""
        if self._t_us is not None and abs(sample.t_us - self._t_us - 1e6 * self._step) > 1e5 * self._step:
            self.clear()
        self._t_us = sample.t_us
        last = self._rows[-1] if self._filled else np.full(4, math.nan)
        # A plane that is not heard is held until it is heard again, and so is a speed.
        is_heard = not math.isnan(sample.rudder)
        rudder = sample.rudder if is_heard else last[2]
        speed = last[3] if math.isnan(sample.speed) else sample.speed
        self._rows[:-1] = self._rows[1:]
        self._rows[-1] = sample.pitch, sample.depth, rudder, speed
        self._filled = min(self._filled + 1, len(self._rows))
        if is_heard and self._unheard:
            # It turned on the way, nobody knows when.
            way = min(self._unheard + 2, len(self._rows))
            self._rows[-way:, 2] = np.linspace(self._rows[-way, 2], rudder, way)
        self._unheard = 0 if is_heard else self._unheard + 1

    @property
    def is_full(self) -> bool:
        """Whether there is enough of everything in it."""
        if self._filled < len(self._rows) or not np.isfinite(self._rows[:, 2]).all():
            return False
        return bool((np.isfinite(self._rows[:, :2]).mean(axis=0) >= LEAST_PRESENT).all())

    def moves(self, least: Array) -> bool:
        """Whether the standard deviation of pitch or depth, (2,), is above the least."""
        return bool((np.nanstd(self._rows[:, :2], axis=0) > least).any())

    def errors(self, reference: Reference, levels: Array) -> Array:
        """Rms prediction error of pitch and depth, (2,). `levels`: rad and m that count as one."""
        plane = np.array([reference.b1, reference.b2, 0.0])
        steady = np.array([reference.heave_offset, reference.pitch_offset, 0.0])
        pushes = np.zeros((len(self._rows), 3, 5))
        pushes[:, :, 0] = steady + self._rows[:, 2, None] * plane
        runs = self._run(reference, pushes)[:, [THETA, ZETA]]
        error, free = self._rows[:, :2] - runs[:, :, 0], runs[:, :, 1:]
        weight = np.where(np.isfinite(error), 1.0 / levels, 0.0)
        for _ in range(3):
            left = _left(error, free, weight)
            size = np.abs(left)
            typical = [np.median(s[w > 0.0]) for s, w in zip(size.T, weight.T, strict=True)]
            limit = OUTLIER * 1.4826 * np.array(typical)
            wrong = (weight > 0.0) & (size > np.maximum(limit, 1e-9))
            if not wrong.any() or wrong.sum() > MOST_OUTLIERS * (weight > 0.0).sum():
                break
            weight = np.where(wrong, 0.0, weight)
            left = _left(error, free, weight)
        counts = np.maximum((weight > 0.0).sum(axis=0), 1)
        rms: Array = np.sqrt((left**2).sum(axis=0) / counts)
        return rms

    def _run(self, reference: Reference, pushes: Array) -> Array:
        """States (rows, 4, 5): under the pushes (rows, 3, 5) from rest, and from each state of one.

        A measured speed enters as the motion of the depth that its difference from u0 makes.
        """
        move, push = reference.discrete(self._step)
        speed = self._rows[:, 3]
        drift = np.where(np.isnan(speed), 0.0, speed - reference.u0) * self._step
        pushed = push @ pushes
        states = np.empty((len(pushes), 4, 5))
        state = np.eye(4, 5, 1)
        for k, drifts in enumerate(drift.tolist()):
            states[k] = state
            after = move @ state + pushed[k]
            if drifts:
                after[ZETA] -= drifts * state[THETA]
            state = after
        return states


def _left(error: Array, free: Array, weight: Array) -> Array:
    """What the best initial state leaves of the error (rows, 2), weighted."""
    columns = (free * weight[:, :, None]).reshape(-1, 4)
    target = (np.where(weight > 0.0, error, 0.0) * weight).reshape(-1)
    start = np.linalg.lstsq(columns, target, rcond=1e-9)[0]
    left: Array = (target - columns @ start).reshape(error.shape)
    return left
