"""Linear state-space models by subspace methods, as nfoursid and SIPPY give them.

They learn pitch and the change of depth over a step: left to find the integrator themselves, they put its
pole beside 1, and the free run drifts off.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, replace
from functools import partial
from io import StringIO

import numpy as np

from host.recordings.recording import Array
from tools.compare.free_run import UNITS, Learner
from tools.compare.series import Series

Matrices = tuple[Array, Array, Array, Array]


@dataclass(frozen=True, slots=True, kw_only=True)
class StateSpace:
    """x(k+1) = A x + B u, y = C x + D u, of plane and outputs less their means, the outputs in `scale`."""

    matrices: Matrices
    plane_mean: float
    output_mean: Array
    scale: Array

    def guess(self, series: Series) -> Array:
        """Least squares for the first state and the first depth: the outputs are linear in them."""
        plane, seen = series.plane[: series.opening], series.outputs[:, : series.opening]
        forced = self.run(self._nothing, plane)
        return _least_squares(self._of_start(plane, forced), seen - forced)

    def levelled(self, series: Series) -> "StateSpace":
        """The means as the free run over the whole series has them: an integrator adds up what is off."""
        forced = self.run(self._nothing, series.plane)
        effects = self._of_start(series.plane, forced)
        for i in range(2):
            raised = replace(self, output_mean=self.output_mean + np.eye(2)[i] * self.scale[i])
            effects.append(raised.run(self._nothing, series.plane) - forced)
        offset = _least_squares(effects, series.outputs - forced)[-2:]
        return replace(self, output_mean=self.output_mean + offset * self.scale)

    def _of_start(self, plane: Array, forced: Array) -> list[Array]:
        return [self.run(one, plane) - forced for one in np.eye(self._nothing.size)]

    def run(self, start: Array, plane: Array) -> Array:
        """start: the state and the first depth."""
        A, B, C, D = self.matrices
        u = plane - self.plane_mean
        states, x = np.empty((len(A), u.size)), start[: len(A)]
        for k in range(u.size):
            states[:, k] = x
            x = A @ x + B[:, 0] * u[k]
        outputs = self.output_mean[:, None] + self.scale[:, None] * (C @ states + D * u)
        outputs[1] = start[-1] + np.concatenate([[0.0], np.cumsum(outputs[1, :-1])])
        return np.asarray(outputs)

    @property
    def _nothing(self) -> Array:
        return np.zeros(len(self.matrices[0]) + 1)


def _least_squares(effects: list[Array], outputs: Array) -> Array:
    G = np.array([(effect / UNITS).ravel() for effect in effects]).T
    if not np.isfinite(G).all():
        raise ValueError("the model runs away")
    return np.asarray(np.linalg.lstsq(G, (outputs / UNITS).ravel(), rcond=None)[0])


def _learn(series: Series, fit: Callable[[Array, Array], Matrices]) -> StateSpace:
    pitch, depth = series.outputs
    outputs, plane = np.array([pitch[:-1], np.diff(depth)]), series.plane[:-1]
    mean, scale = outputs.mean(axis=1), np.maximum(outputs.std(axis=1), 1e-9)
    plane_mean = float(plane.mean())
    matrices = fit((outputs - mean[:, None]) / scale[:, None], plane - plane_mean)
    if not all(np.isfinite(matrix).all() for matrix in matrices):
        raise ValueError("the matrices are not finite")
    found = StateSpace(matrices=matrices, plane_mean=plane_mean, output_mean=mean, scale=scale)
    return found.levelled(series)


def nfoursid_learners() -> list[tuple[int, Learner]]:
    """PO-MOESP: rows to a step, block rows and order."""
    return [
        (every, partial(_learn, fit=partial(_nfoursid, blocks=blocks, order=order)))
        for every in (1, 3)
        for blocks in (10, 25)
        for order in (2, 3, 4, 5)
    ]


def _nfoursid(outputs: Array, plane: Array, blocks: int, order: int) -> Matrices:
    import pandas
    from nfoursid.nfoursid import NFourSID

    table = pandas.DataFrame({"pitch": outputs[0], "depth": outputs[1], "plane": plane})
    method = NFourSID(
        table, output_columns=["pitch", "depth"], input_columns=["plane"], num_block_rows=blocks
    )
    method.subspace_identification()
    found, _ = method.system_identification(rank=order)
    return found.a, found.b, found.c, found.d


def sippy_learners() -> list[tuple[int, Learner]]:
    """N4SID, MOESP, CVA and PARSIM-K: rows to a step, horizon and order."""
    return [
        (
            every,
            partial(
                _learn,
                fit=partial(_sippy, method=method, horizon=horizon, order=order),
            ),
        )
        for every in (1, 3)
        for method, horizon in (("N4SID", 20), ("MOESP", 20), ("CVA", 20), ("PARSIM-K", 20), ("N4SID", 40))
        for order in (3, 4)
    ]


def _sippy(outputs: Array, plane: Array, method: str, horizon: int, order: int) -> Matrices:
    from sippy_unipi import system_identification

    with _no_talk():
        found = system_identification(
            outputs, plane[None, :], method, SS_fixed_order=order, SS_f=horizon, SS_p=horizon
        )
    return found.A, found.B, found.C, found.D


@contextmanager
def _no_talk() -> Iterator[None]:
    """The package prints warnings, and leaves the interpreter where it meets an error."""
    with redirect_stdout(StringIO()):
        try:
            yield
        except SystemExit as left:
            raise ValueError(str(left)) from left
