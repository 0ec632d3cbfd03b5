"""Damped Gauss-Newton steps on whitened innovations, each recording's initial state eliminated."""

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from host.dynamics.equations import Structure
from host.dynamics.propagate import NX0
from host.likelihood.start_prior import start_normal
from host.likelihood.straightened import slopes, stepped
from host.recordings.recording import Array

Mask = NDArray[np.bool_]
SHORTER = (1e-9, 1e-6, 1e-4)  # dampings, of which the first is as good as none
SOLVABLE = np.diag([1.0, 1.0, 1.0, 1e-4, 1.0])  # information on equations.START, for short dives
DISTINCT = 1e-12  # of the information: what two of them do alike, and much, is told apart by this


@dataclass(frozen=True, slots=True)
class Point:
    """A point of the search: parameters, what each recording begins with (5,), noise (4,), in waves (7,)."""

    structure: Structure
    parameters: Array
    initial: list[Array]
    noise: Array

    def with_noise(self, noise: Array) -> "Point":
        return replace(self, noise=noise)


def whiten(error: Array, sensitivity: Array, variance: Array) -> tuple[Array, Array]:
    """Multiplies by the inverse Cholesky factor of each row's 2 x 2 variance [S11, S12, S22] (3, N).

    What has run away becomes infinite, and no step leads there.
    """
    l11 = np.sqrt(variance[0])
    l21 = variance[1] / l11
    l22 = np.sqrt(variance[2] - l21**2)
    white, scores = np.empty_like(error), np.empty_like(sensitivity)
    with np.errstate(over="ignore", invalid="ignore"):
        white[0] = error[0] / l11
        white[1] = (error[1] - l21 * white[0]) / l22
        scores[0] = sensitivity[0] / l11
        scores[1] = (sensitivity[1] - l21 * scores[0]) / l22
    return white, scores


def _normal(error: Array, scores: Array, free: Mask) -> tuple[Array, Array]:
    """Normal matrix and right-hand side of the free parameters and the initial state."""
    kept = np.append(free, np.ones(NX0, dtype=bool))
    slopes = list(scores) if kept.all() else [channel[kept] for channel in scores]
    with np.errstate(all="ignore"):  # a model that has run away is seen by its numbers
        normal = np.sum([J @ J.T for J in slopes], axis=0)
        return normal, np.sum([J @ e for J, e in zip(slopes, error, strict=True)], axis=0)


class GaussNewton:
    """Normal equations of one iteration.

    white  whitened innovations (2, N) and sensitivities (2, parameters + 5, N) of each recording
    """

    def __init__(self, white: list[tuple[Array, Array]], point: Point, free: Mask) -> None:
        self.point, self.free = point, free
        self._add_up([_normal(error, scores, free) for error, scores in white])

    def with_normal(self, normal: list[tuple[Array, Array]]) -> "GaussNewton":
        """The same with other matrices and right-hand sides of the free parameters + 5 for each recording."""
        other = copy(self)
        other._add_up(normal)
        return other

    def _add_up(self, normal: list[tuple[Array, Array]]) -> None:
        count = int(self.free.sum())
        self.H, self.g = np.zeros((count, count)), np.zeros(count)
        self.own: list[tuple[Array, Array, Array]] = []
        self._eliminated: tuple[Array, Array] | None = None  # once asked
        for (H, g), x0 in zip(normal, self.point.initial, strict=True):
            self.H += H[:count, :count]
            self.g += g[:count]
            information, score = start_normal(x0)
            Hxx = H[count:, count:] + information + SOLVABLE
            Hxx += DISTINCT * np.diag(np.diag(Hxx))
            self.own.append((H[:count, count:], Hxx, g[count:] + score))

    def spread(self) -> Array:
        """Deviation of each free parameter if all else were known."""
        return np.asarray(1.0 / np.sqrt(np.maximum(np.diag(self.H), 1e-300)))

    def moved(self, strides: Array, starts: list[Array]) -> Iterator[Point]:
        """The points with one free parameter moved, then those with one initial state, of all recordings."""
        for k, stride in zip(np.flatnonzero(self.free), strides, strict=True):
            parameters = self.point.parameters.copy()
            parameters[k] += stride
            yield replace(self.point, parameters=parameters)
        for axis in np.eye(NX0):
            initial = [x0 + axis * start for x0, start in zip(self.point.initial, starts, strict=True)]
            yield replace(self.point, initial=initial)

    def predicted_cost(self, cost: float) -> float:
        """Deviance, of `cost` here, after the best of some steps if the equations were linear.

        That is the full one, unless it would leave the bounds far: what stops there early, while the others
        go on along a ridge, may leave them worse than here.
        """
        return cost - 2.0 * max(map(self._promised, SHORTER))

    def promise(self) -> float:
        """What the full step would gain in log-likelihood if the equations were linear."""
        return self._promised(SHORTER[0])

    def _promised(self, damping: float) -> float:
        reduced, rhs = self._reduced()
        if not _is_finite(reduced, rhs):
            return 0.0  # as no step is taken there
        start = sum(float(gx @ np.linalg.solve(Hxx, gx)) for _, Hxx, gx in self.own)
        scale = np.sqrt(np.maximum(np.diag(self.H), 1e-300))
        step = self._reached(reduced, rhs, damping, scale) - self.point.parameters[self.free]
        return 0.5 * (start + float(step @ (2.0 * rhs - reduced @ step)))

    def information(self) -> Array:
        """Fisher information of the free parameters alone."""
        reduced = self.H.copy()
        with np.errstate(all="ignore"):
            for Hpx, Hxx, _ in self.own:
                reduced -= Hpx @ np.linalg.solve(Hxx, Hpx.T)
        return reduced

    def scores(self, white: list[tuple[Array, Array]]) -> list[Array]:
        """Sensitivities of the free parameters (2, free, N), the initial states eliminated."""
        count = self.free.size
        return [
            S[:, :count][:, self.free] - np.einsum("px,oxk->opk", np.linalg.solve(Hxx, Hpx.T).T, S[:, count:])
            for (_, S), (Hpx, Hxx, _) in zip(white, self.own, strict=True)
        ]

    def trial(self, damping: float) -> Point:
        """The point one damped step on (Levenberg-Marquardt), inside the parameters' bounds.

        In the coordinates of host.likelihood.straightened.
        """
        reduced, rhs = self._reduced()
        if not _is_finite(reduced, rhs):
            return self.point  # the model has run away: no step is better than none
        names, here = self.point.structure.names, self.point.parameters
        T = slopes(names, here)[np.ix_(self.free, self.free)]
        scale = np.sqrt(np.maximum(np.diag(T.T @ self.H @ T), 1e-300))
        step = np.zeros(here.size)
        step[self.free] = self._reached(T.T @ reduced @ T, T.T @ rhs, damping, scale) - here[self.free]
        parameters = self.point.structure.clipped(stepped(names, here, step))
        parameters[~self.free] = here[~self.free]
        moved = parameters[self.free] - here[self.free]
        initial = [
            x0 + np.linalg.solve(Hxx * (1.0 + damping * np.eye(NX0)), gx - Hpx.T @ moved)
            for x0, (Hpx, Hxx, gx) in zip(self.point.initial, self.own, strict=True)
        ]
        return replace(self.point, parameters=parameters, initial=initial)

    def _reduced(self) -> tuple[Array, Array]:
        """Normal matrix and right-hand side of the free parameters, the initial states eliminated."""
        if self._eliminated is None:
            rhs = self.g.copy()
            with np.errstate(all="ignore"):
                for Hpx, Hxx, gx in self.own:
                    rhs -= Hpx @ np.linalg.solve(Hxx, gx)
            self._eliminated = self.information(), rhs
        return self._eliminated

    def _reached(self, reduced: Array, rhs: Array, damping: float, scale: Array) -> Array:
        """Free parameters after a damped step; what would leave its bounds stops there, others suit that."""
        normal = reduced / np.outer(scale, scale) + damping * np.eye(scale.size)
        lower, upper = (bound[self.free] for bound in self.point.structure.bounds)
        here = self.point.parameters[self.free]
        reached, inside = here.copy(), np.ones(scale.size, dtype=bool)
        while inside.any():
            stopped = ((reached - here) * scale)[~inside]
            left = rhs[inside] / scale[inside] - normal[np.ix_(inside, ~inside)] @ stopped
            step = _solve(normal[np.ix_(inside, inside)], left) / scale[inside]
            reached[inside] = here[inside] + step
            leaving = (reached < lower) | (reached > upper)
            if not leaving.any():
                break
            reached = np.clip(reached, lower, upper)
            inside &= ~leaving
        return reached


def _is_finite(reduced: Array, rhs: Array) -> bool:
    return bool(np.isfinite(reduced).all() and np.isfinite(rhs).all())


def _solve(normal: Array, rhs: Array) -> Array:
    try:
        return np.asarray(cho_solve(cho_factor(normal), rhs))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(normal, rhs, rcond=1e-12)[0])
