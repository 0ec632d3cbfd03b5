"""Maximum likelihood when a sensor's error wanders: white noise and a first-order random process in each.

    e = n + v,   n(t + h) = exp(-h / T) n(t) + ...,   var n = s,  var v = r

A scalar Kalman filter for n in each channel whitens what the free run leaves over, and its sensitivities:
generalised least squares (Durbin, Biometrika 47, 1960), with r, s and T estimated. Without it a depth that
drifts by centimetres over seconds passes for heave forces.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_banded

from host.dynamics.propagate import Inputs, free_run
from host.dynamics.sensitivities import innovations
from host.likelihood.ascent import ascend
from host.likelihood.fit import Fit, finished, run_away
from host.likelihood.gauss_newton import Point
from host.recordings.recording import Array

LONGEST_TIME = 60.0  # s; slower wandering is current or leak, not a sensor
FIRST_TIME = 1.0  # s, where the search begins


@dataclass(frozen=True, slots=True)
class _Channel:
    """One sensor's innovations (N,), their variances, and the gain and decay of each row."""

    error: Array
    variance: Array
    gain: Array
    decay: Array


@dataclass(frozen=True, slots=True)
class WhitenedPass:
    """Both sensors over one recording."""

    pitch: _Channel
    depth: _Channel

    @property
    def error(self) -> Array:
        """(2, N)."""
        return np.stack([self.pitch.error, self.depth.error])

    @property
    def variance(self) -> Array:
        """(3, N): the sensors' errors have nothing to do with one another."""
        return np.stack([self.pitch.variance, 0.0 * self.pitch.variance, self.depth.variance])


class WanderingSensors:
    """Levels: white variances r of pitch, depth; wandering variances s; correlation times T, s."""

    signed = np.zeros(6, dtype=bool)

    def __init__(self, inputs: list[Inputs]) -> None:
        self.inputs = inputs
        step = float(np.median(np.concatenate([one.drive[3] for one in inputs])))
        self.least = np.array([1e-12, 1e-10, 1e-16, 1e-14, step, step])
        self.most = np.array([1e3, 1e6, 1e3, 1e6, LONGEST_TIME, LONGEST_TIME])
        self._runs: list[tuple[Array, Array, Array]] = []
        self._known: dict[tuple[float, ...], _Channel] = {}

    def passes(self, point: Point) -> list[WhitenedPass]:
        """The free run's residuals through each sensor's filter."""
        return [
            WhitenedPass(*(self._channel(k, i, residual[i], point.noise) for i in range(2)))
            for k, residual in enumerate(self._residuals(point))
        ]

    def whitened(self, point: Point, passes: list[WhitenedPass]) -> list[tuple[Array, Array]]:
        """The same filters applied to the sensitivities."""
        white = []
        for run, x0, one in zip(passes, point.initial, self.inputs, strict=True):
            _, sensitivity = innovations(point.parameters, x0, one)
            scores = np.empty_like(sensitivity)
            for i, sensor in enumerate((run.pitch, run.depth)):
                left = _through(sensor.gain, sensor.decay, sensitivity[i])
                scores[i] = left * one.present[i] / np.sqrt(sensor.variance)
            white.append((run.error / np.sqrt(run.variance[::2]), scores))
        return white

    def _channel(self, recording: int, i: int, residual: Array, noise: Array) -> _Channel:
        """While only one noise level changes, the other sensor stays as it was."""
        key = (recording, i, *noise[i::2].tolist())
        if key not in self._known:
            self._known[key] = _filtered(residual, self.inputs[recording], i, *noise[i::2].tolist())
        return self._known[key]

    def _residuals(self, point: Point) -> list[Array]:
        """Only noise levels change between most calls: the last free runs are kept."""
        kept = len(self._runs) == len(self.inputs) and all(
            parameters is point.parameters and x0 is own
            for (parameters, x0, _), own in zip(self._runs, point.initial, strict=True)
        )
        if not kept:
            self._known.clear()
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
    if not np.isfinite(end.likelihood):
        return run_away(point, inputs, start.free)
    white = model.whitened(end.point, end.passes)
    noise = end.point.noise
    at_end = end.point.with_noise(np.array([*noise[:2], 0.0, 0.0]))
    fit = finished(at_end, white, inputs, start.free, end.likelihood, used, converged)
    return replace(fit, wander=np.array([noise[[2, 4]], noise[[3, 5]], [0.0, 0.0]]))


def _filtered(
    residual: Array, inputs: Inputs, i: int, white: float, wandering: float, time: float
) -> _Channel:
    decay = np.exp(-inputs.drive[3] / time)
    gain, variance = _gains(inputs.present[i], decay, white, wandering)
    error = inputs.present[i] * _through(gain, decay, residual[None])[0]
    return _Channel(error=error, variance=variance, gain=gain, decay=decay)


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
    # A trial may run away: what is infinite is refused by its likelihood.
    return np.asarray(values - solve_banded((1, 0), bands, driven.T, check_finite=False).T)
