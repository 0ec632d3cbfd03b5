"""Ascent of the likelihood of innovations, whatever the noise model that makes them.

-log L = 1/2 sum_k [log det S_k + e_k^T S_k^-1 e_k] with innovations e and their variances S. Each step moves
the parameters by Gauss-Newton, with exact sensitivities at fixed gain, and the noise levels by the method of
scoring; every step goes uphill. Of a hull that is unstable under next to no forces the gain changes most as
the parameters do: where steps at fixed gain promise much and gain nothing, the parameters move by the method
of scoring, too (Maine and Iliff, NASA RP-1138).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from host.compiled.side_by_side import side_by_side
from host.likelihood.gauss_newton import GaussNewton, Mask, Point
from host.likelihood.start_prior import start_cost
from host.recordings.recording import Array

DIFFERENCE = 1e-3  # of a log noise level, or of one that has a sign, for derivatives
LONGEST_STRIDE = 2.5  # of the same in one step
SETTLED = 0.02  # of the log-likelihood, by a step that is the last
FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e6
FALSE_PROMISE = 10.0  # of the log-likelihood, by a step that gained nothing: its slopes are not the true ones
QUICKER = 3.0  # times the pace of its last step, that a search may still gain
STRIDE = 1e-3  # of a deviation, by which a parameter or an initial state is moved for derivatives


class Pass(Protocol):
    """Innovations over one recording of N rows.

    error     (2, N) of pitch and depth, 0 where missing
    variance  (3, N) S11, S12, S22; 1, 0, 1 where missing
    """

    @property
    def error(self) -> Array: ...

    @property
    def variance(self) -> Array: ...


P = TypeVar("P", bound=Pass)


class NoiseModel(Protocol[P]):
    """What turns a point, with its noise levels, into innovations.

    least, most  bound the levels
    signed       those that may be negative, and move by differences instead of factors
    """

    least: Array
    most: Array
    signed: Mask

    def passes(self, point: Point) -> list[P]:
        """Of each recording."""

    def whitened(self, point: Point, passes: list[P]) -> list[tuple[Array, Array]]:
        """The innovations over their deviation (2, N), and their sensitivities (2, parameters + 4, N)."""


@dataclass(frozen=True, slots=True)
class Place(Generic[P]):
    """A point of the search, the innovations there, and the log-likelihood."""

    point: Point
    passes: list[P]
    likelihood: float


def place(point: Point, model: NoiseModel[P]) -> Place[P]:
    """The likelihood at a point; a run that leaves the numbers has -inf."""
    with np.errstate(all="ignore"):
        passes = model.passes(point)
        likelihood = -0.5 * sum(float(np.sum(_quadratic(run) + np.log(_det(run)))) for run in passes)
        likelihood -= start_cost(point.initial)
    return Place(point, passes, likelihood if np.isfinite(likelihood) else -np.inf)


def ascend(
    point: Point,
    model: NoiseModel[P],
    free: Mask,
    most_steps: int,
    holds_noise: bool = False,
    holds_gain: bool = False,
    least: float = -np.inf,
    settled: float = SETTLED,
) -> tuple[Place[P], int, bool]:
    """Climbs from a point; gives where it ended, after how many steps, and whether it had converged.

    holds_noise  whether the noise levels stay as they are, which saves most of the work
    holds_gain   whether no step asks how the gain moves with the parameters
    least        a log-likelihood: it gives up where three times the pace of its last step would not get there
    settled      of the log-likelihood: a step that gains less is the last
    """
    here, damping, converged, used = place(point, model), FIRST_DAMPING, False, 0
    moves_gain = False
    while not converged and used < most_steps and np.isfinite(here.likelihood):
        used += 1
        step = GaussNewton(model.whitened(here.point, here.passes), here.point, free)
        scoring = None if holds_noise else _Scoring(here, model)
        if not moves_gain:
            there, damping = _uphill(here, model, step, scoring, damping)
            is_stuck = not there.likelihood - here.likelihood > settled
            moves_gain = is_stuck and not holds_gain and step.promise() > FALSE_PROMISE
        if moves_gain:  # from then on: slopes that were false once are so mostly again
            there, damping = _uphill(here, model, _scored(here, model, step), scoring, FIRST_DAMPING)
        gained = there.likelihood - here.likelihood
        converged = not gained > settled
        if gained > 0.0:
            here = there
        damping /= 20.0
        if here.likelihood + QUICKER * gained * (most_steps - used) < least:
            break
    return here, used, converged


def _uphill(
    here: Place[P], model: NoiseModel[P], step: GaussNewton, scoring: "_Scoring[P] | None", damping: float
) -> tuple[Place[P], float]:
    """The first point uphill, ever closer, and the damping that led there."""
    while True:
        noise = here.point.noise if scoring is None else scoring.trial(damping)
        there = place(step.trial(damping).with_noise(noise), model)
        if there.likelihood > here.likelihood or damping > MOST_DAMPING:
            return there, damping
        damping = max(damping * 10.0, FIRST_DAMPING)


def _scored(here: Place[P], model: NoiseModel[P], step: GaussNewton) -> GaussNewton:
    """The step by scores and Fisher information, the gains moving with the parameters, by differences."""
    point = here.point
    bounds = [p for p, is_free in zip(point.structure.parameters, step.free, strict=True) if is_free]
    strides = STRIDE * step.spread()
    upper = np.array([p.upper for p in bounds])
    strides[point.parameters[step.free] + strides > upper] *= -1.0
    starts = [STRIDE / np.sqrt(np.diag(Hxx)) for _, Hxx, _ in step.own]
    with np.errstate(all="ignore"):
        moved = side_by_side(model.passes, list(step.moved(strides, starts)))
    normal = []
    for k, (run, own) in enumerate(zip(here.passes, starts, strict=True)):
        score, information = _score(run, [passes[k] for passes in moved], np.concatenate([strides, own]))
        known = np.isfinite(score) & np.isfinite(np.diag(information))
        information[~known] = information[:, ~known] = score[~known] = 0.0
        normal.append((information, score))
    return step.with_normal(normal)


class _Scoring(Generic[P]):
    """Scores and Fisher information of the noise levels, by differences.

    A level that loses the recording where it is moved stays as it is.
    """

    def __init__(self, here: Place[P], model: NoiseModel[P]) -> None:
        self.noise, self.model = here.point.noise, model
        levels = self.noise.size
        self.score, self.information = np.zeros(levels), np.zeros((levels, levels))
        with np.errstate(all="ignore"):
            moved = [here.point.with_noise(self._moved(DIFFERENCE * one)) for one in np.eye(levels)]
            self._add_up(here, side_by_side(model.passes, moved))
        lost = ~np.isfinite(self.score) | ~np.isfinite(np.diag(self.information))
        self.score[lost] = 0.0
        self.information[lost, :] = self.information[:, lost] = 0.0
        self.information[lost, lost] = 1.0

    def _add_up(self, here: Place[P], moved: list[list[P]]) -> None:
        strides = np.full(self.noise.size, DIFFERENCE)
        for k, run in enumerate(here.passes):
            score, information = _score(run, [passes[k] for passes in moved], strides)
            self.score += score
            self.information += information

    def trial(self, damping: float) -> Array:
        """The noise levels one damped step on."""
        diagonal = np.diag(self.information)
        normal = self.information + np.diag(damping * diagonal + 1e-6 * diagonal.max())
        stride = np.clip(np.linalg.solve(normal, self.score), -LONGEST_STRIDE, LONGEST_STRIDE)
        return np.asarray(np.clip(self._moved(stride), self.model.least, self.model.most))

    def _moved(self, stride: Array) -> Array:
        signed = self.model.signed
        return np.where(signed, self.noise + stride, self.noise * np.exp(np.where(signed, 0.0, stride)))


def _score(run: Pass, moved: Sequence[Pass], strides: Array) -> tuple[Array, Array]:
    """Score (n,) and Fisher information (n, n) of what was moved by n strides, by differences.

    d log L = 1/2 sum_k [e^T S^-1 dS S^-1 e - tr(S^-1 dS) - 2 e^T S^-1 de]
    F_ij = sum_k [1/2 tr(S^-1 d_i S S^-1 d_j S) + d_i e^T S^-1 d_j e]
    """
    with np.errstate(all="ignore"):
        de = np.array([(one.error - run.error) / h for one, h in zip(moved, strides, strict=True)])
        dS = np.array([(one.variance - run.variance) / h for one, h in zip(moved, strides, strict=True)])
        inverse = _inverse(run)
        e = _times(inverse, run.error)
        # S^-1 dS, row by row of the 2 x 2 matrix
        ratio = np.stack([_times(inverse, dS[:, :2]), _times(inverse, dS[:, 1:])], axis=2)
        pull = dS[:, 0] * e[0] ** 2 + 2.0 * dS[:, 1] * e[0] * e[1] + dS[:, 2] * e[1] ** 2
        trace = ratio[:, 0, 0] + ratio[:, 1, 1]
        score = 0.5 * np.sum(pull - trace, axis=1) - np.einsum("ick,ck->i", de, e)
        information = 0.5 * np.einsum("iabk,jbak->ij", ratio, ratio)
        information += np.einsum("ick,jck->ij", de, _times(inverse, de))
    return score, information


def _det(run: Pass) -> Array:
    S11, S12, S22 = run.variance
    return np.asarray(S11 * S22 - S12**2)


def _inverse(run: Pass) -> Array:
    """S^-1 as its elements 11, 12, 22 (3, N)."""
    S11, S12, S22 = run.variance
    return np.asarray(np.stack([S22, -S12, S11]) / _det(run))


def _times(symmetric: Array, vectors: Array) -> Array:
    """Rows of 2 x 2 matrices (3, N) times vectors (..., 2, N)."""
    m11, m12, m22 = symmetric
    first, second = vectors[..., 0, :], vectors[..., 1, :]
    return np.stack([m11 * first + m12 * second, m12 * first + m22 * second], axis=-2)


def _quadratic(run: Pass) -> Array:
    return np.asarray(np.sum(run.error * _times(_inverse(run), run.error), axis=0))
