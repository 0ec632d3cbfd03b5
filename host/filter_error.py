"""Filter error: maximum likelihood when random forces act, by the innovations of a Kalman filter.

-log L = 1/2 sum_k [log det S_k + e_k^T S_k^-1 e_k] with the filter's innovations e and their variances S
(Maine and Iliff, NASA RP-1138; Klein and Morelli, Aircraft System Identification, ch. 6). Each step moves
the parameters by Gauss-Newton, with exact sensitivities at fixed gain, and the noise levels by the method
of scoring; every step goes downhill.
"""

from dataclasses import dataclass

import numpy as np

from host.fit import Fit, finished
from host.gauss_newton import GaussNewton, Point, whiten
from host.kalman import KalmanPass, kalman_pass
from host.propagate import Inputs, innovations
from host.recording import Array

LEAST_NOISE = np.array([1e-12, 1e-10, 1e-16, 1e-16])  # rad^2, m^2 and densities: below anything that acts
DIFFERENCE = 1e-3  # of a log noise level, for derivatives
LONGEST_STRIDE = 2.5  # of a log noise level in one step
SETTLED = 0.02  # of the log-likelihood: a step that gains less is the last


def filter_error(start: Fit, inputs: list[Inputs], most_steps: int = 40) -> Fit:
    """Climbs from a fit without forces to the likeliest parameters and noise levels with them."""
    noise = start.noise if start.has_process_noise else _first_noise(start, inputs)
    here = _Place.at(Point(start.structure, start.parameters, start.initial, noise), inputs)
    damping, converged, used = 1e-3, False, 0
    while not converged and used < most_steps:
        used += 1
        step = GaussNewton(_whitened(here.point, here.passes, inputs), here.point, start.free)
        scoring = _Scoring(here, inputs)
        while True:
            there = _Place.at(step.trial(damping).with_noise(scoring.trial(damping)), inputs)
            if there.likelihood > here.likelihood or damping > 1e6:
                break
            damping = max(damping * 10.0, 1e-3)
        gained = there.likelihood - here.likelihood
        converged = not gained > SETTLED
        if gained > 0.0:
            here = there
        damping /= 20.0
    white = _whitened(here.point, here.passes, inputs)
    return finished(here.point, white, inputs, start.free, here.likelihood, used, converged)


def whitened_innovations(point: Point, inputs: list[Inputs]) -> list[tuple[Array, Array]]:
    """The filter's innovations over their deviation (2, N), and their sensitivities at fixed gain."""
    return _whitened(point, _passes(point, point.noise, inputs), inputs)


@dataclass(frozen=True, slots=True)
class _Place:
    """A point of the search, the filter's passes over the recordings there, and the log-likelihood."""

    point: Point
    passes: list[KalmanPass]
    likelihood: float

    @classmethod
    def at(cls, point: Point, inputs: list[Inputs]) -> "_Place":
        with np.errstate(all="ignore"):  # a trial that runs away is refused for it
            passes = _passes(point, point.noise, inputs)
            likelihood = -0.5 * sum(float(np.sum(_quadratic(run) + np.log(_det(run)))) for run in passes)
        return cls(point, passes, likelihood if np.isfinite(likelihood) else -np.inf)


class _Scoring:
    """Scores and Fisher information of the log noise levels, by differences of the innovations.

    d log L = 1/2 sum_k [e^T S^-1 dS S^-1 e - tr(S^-1 dS) - 2 e^T S^-1 de]
    F_ij = sum_k [1/2 tr(S^-1 d_i S S^-1 d_j S) + d_i e^T S^-1 d_j e]
    """

    def __init__(self, here: _Place, inputs: list[Inputs]) -> None:
        self.noise = here.point.noise
        levels = self.noise.size
        self.score, self.information = np.zeros(levels), np.zeros((levels, levels))
        moved = [
            _passes(here.point, self.noise * np.exp(DIFFERENCE * np.eye(levels)[i]), inputs)
            for i in range(levels)
        ]
        for k, run in enumerate(here.passes):
            de = np.array([(passes[k].error - run.error) / DIFFERENCE for passes in moved])
            dS = np.array([(passes[k].variance - run.variance) / DIFFERENCE for passes in moved])
            inverse = _inverse(run)
            e = _times(inverse, run.error)
            # S^-1 dS, row by row of the 2 x 2 matrix
            ratio = np.stack([_times(inverse, dS[:, :2]), _times(inverse, dS[:, 1:])], axis=2)
            pull = dS[:, 0] * e[0] ** 2 + 2.0 * dS[:, 1] * e[0] * e[1] + dS[:, 2] * e[1] ** 2
            trace = ratio[:, 0, 0] + ratio[:, 1, 1]
            self.score += 0.5 * np.sum(pull - trace, axis=1) - np.einsum("ick,ck->i", de, e)
            self.information += 0.5 * np.einsum("iabk,jbak->ij", ratio, ratio)
            self.information += np.einsum("ick,jck->ij", de, _times(inverse, de))

    def trial(self, damping: float) -> Array:
        """The noise levels one damped step on."""
        diagonal = np.diag(self.information)
        normal = self.information + np.diag(damping * diagonal + 1e-6 * diagonal.max())
        stride = np.clip(np.linalg.solve(normal, self.score), -LONGEST_STRIDE, LONGEST_STRIDE)
        return np.asarray(np.maximum(self.noise * np.exp(stride), LEAST_NOISE))


def _first_noise(start: Fit, inputs: list[Inputs]) -> Array:
    """Half of what output error calls sensor noise may really be force: a neutral place to begin."""
    step = float(np.median(np.concatenate([one.drive[3] for one in inputs])))
    return np.concatenate([start.noise[:2] / 2.0, start.noise[:2][::-1] * step])


def _passes(point: Point, noise: Array, inputs: list[Inputs]) -> list[KalmanPass]:
    return [
        kalman_pass(point.parameters, x0, noise, one) for x0, one in zip(point.initial, inputs, strict=True)
    ]


def _whitened(point: Point, passes: list[KalmanPass], inputs: list[Inputs]) -> list[tuple[Array, Array]]:
    white = []
    for run, x0, one in zip(passes, point.initial, inputs, strict=True):
        error, sensitivity = innovations(point.parameters, x0, one, run.gains)
        white.append(whiten(error, sensitivity, run.variance))
    return white


def _det(run: KalmanPass) -> Array:
    S11, S12, S22 = run.variance
    return np.asarray(S11 * S22 - S12**2)


def _inverse(run: KalmanPass) -> Array:
    """S^-1 as its elements 11, 12, 22 (3, N)."""
    S11, S12, S22 = run.variance
    return np.asarray(np.stack([S22, -S12, S11]) / _det(run))


def _times(symmetric: Array, vectors: Array) -> Array:
    """Rows of 2 x 2 matrices (3, N) times vectors (..., 2, N)."""
    m11, m12, m22 = symmetric
    first, second = vectors[..., 0, :], vectors[..., 1, :]
    return np.stack([m11 * first + m12 * second, m12 * first + m22 * second], axis=-2)


def _quadratic(run: KalmanPass) -> Array:
    return np.asarray(np.sum(run.error * _times(_inverse(run), run.error), axis=0))
