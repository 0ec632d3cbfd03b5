"""Maximum likelihood when a sensor's error wanders: white noise and a first-order random process in each.

    e = n + v,   n(t + h) = exp(-h / T) n(t) + ...,   var n = s,  var v = r

A scalar Kalman filter for n in each channel whitens what the free run leaves over, and its sensitivities:
generalised least squares (Durbin, Biometrika 47, 1960), with r, s and T estimated. Without it a depth that
drifts by centimetres over seconds passes for heave forces.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_banded

from host.ascent import ascend
from host.fit import Fit, finished
from host.gauss_newton import Point
from host.propagate import Inputs, free_run, innovations
from host.recording import Array

LONGEST_TIME = 60.0  # s; slower wandering is current or leak, not a sensor
FIRST_TIME = 1.0  # s, where the search begins


@dataclass(frozen=True, slots=True, kw_only=True)
class WhitenedPass:
    """Innovations (2, N), their variances (3, N), and the gain (2, N) and decay (2, N) of each row."""

    error: Array
    variance: Array
    gain: Array
    decay: Array


class WanderingSensors:
    """Levels: white variances r of pitch, depth; wandering variances s; correlation times T, s."""

    def __init__(self, inputs: list[Inputs]) -> None:
        self.inputs = inputs
        step = float(np.median(np.concatenate([one.drive[3] for one in inputs])))
        self.least = np.array([1e-12, 1e-10, 1e-16, 1e-14, step, step])
        self.most = np.array([1e3, 1e6, 1e3, 1e6, LONGEST_TIME, LONGEST_TIME])
        self._runs: list[tuple[Array, Array, Array]] = []

    def passes(self, point: Point) -> list[WhitenedPass]:
        """The free run's residuals through each sensor's filter."""
        return [
            _filtered(residual, one, point.noise)
            for residual, one in zip(self._residuals(point), self.inputs, strict=True)
        ]

    def whitened(self, point: Point, passes: list[WhitenedPass]) -> list[tuple[Array, Array]]:
        """The same filters applied to the sensitivities."""
        white = []
        for run, x0, one in zip(passes, point.initial, self.inputs, strict=True):
            _, sensitivity = innovations(point.parameters, x0, one)
            deviation = np.sqrt(run.variance[::2])
            scores = np.stack(
                [
                    _through(run.gain[i], run.decay[i], sensitivity[i]) * one.present[i] / deviation[i]
                    for i in range(2)
                ]
            )
            white.append((run.error / deviation, scores))
        return white

    def _residuals(self, point: Point) -> list[Array]:
        """Only noise levels change between most calls: the last free runs are kept."""
        kept = len(self._runs) == len(self.inputs) and all(
            parameters is point.parameters and x0 is own
            for (parameters, x0, _), own in zip(self._runs, point.initial, strict=True)
        )
        if not kept:
            self._runs = [
                (
                    point.parameters,
                    x0,
                    one.present * (one.measured - free_run(point.parameters, x0, one).outputs),
                )
                for x0, one in zip(point.initial, self.inputs, strict=True)
            ]
        return [residual for _, _, residual in self._runs]


def coloured_noise(start: Fit, inputs: list[Inputs], most_steps: int = 15) -> Fit:
    """Climbs from a fit with white noise to the likeliest parameters and noise with wandering errors."""
    model = WanderingSensors(inputs)
    half = start.noise[:2] / 2.0
    first = np.clip([*half, *half, FIRST_TIME, FIRST_TIME], model.least, model.most)
    point = Point(start.structure, start.parameters, start.initial, first)
    end, used, converged = ascend(point, model, start.free, most_steps)
    white = model.whitened(end.point, end.passes)
    noise = end.point.noise
    at_end = end.point.with_noise(np.array([*noise[:2], 0.0, 0.0]))
    fit = finished(at_end, white, inputs, start.free, end.likelihood, used, converged)
    return replace(fit, wander=np.column_stack([noise[2:4], noise[4:]]))


def _filtered(residual: Array, inputs: Inputs, noise: Array) -> WhitenedPass:
    present, intervals = inputs.present, inputs.drive[3]
    error, variance = np.zeros_like(residual), np.zeros((3, residual.shape[1]))
    decay = np.exp(-intervals / noise[4:, None])
    gain = np.empty_like(residual)
    for i in range(2):
        gain[i], S = _gains(present[i], decay[i], noise[i], noise[2 + i])
        error[i] = present[i] * _through(gain[i], decay[i], residual[i][None])[0]
        variance[2 * i] = S
    return WhitenedPass(error=error, variance=variance, gain=gain, decay=decay)


def _gains(present: Array, decay: Array, white: float, wandering: float) -> tuple[Array, Array]:
    """Kalman gain and innovation variance of one sensor at each row; 0 and 1 where nothing was measured."""
    P, gains, variances = wandering, [], []
    for is_present, a in zip(present.tolist(), decay.tolist(), strict=True):
        S = P + white if is_present else 1.0
        K = P / S if is_present else 0.0
        gains.append(K)
        variances.append(S)
        P = a * a * (P - K * P) + (1.0 - a * a) * wandering
    return np.array(gains), np.array(variances)


def _through(gain: Array, decay: Array, values: Array) -> Array:
    """What is left of (c, N) values after the filter's prediction n(k+1) = a_k (n(k) + K_k (y - n(k)))."""
    bands = np.ones((2, gain.size))
    bands[1, :-1] = -decay[:-1] * (1.0 - gain[:-1])
    driven = np.zeros_like(values)
    driven[:, 1:] = (decay * gain * values)[:, :-1]
    return np.asarray(values - solve_banded((1, 0), bands, driven.T).T)
