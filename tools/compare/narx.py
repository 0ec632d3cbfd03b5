"""Polynomial NARX by SysIdentPy: pitch from the plane, depth from plane and pitch."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares

from host.recordings.recording import Array
from tools.compare.free_run import Learner
from tools.compare.series import Series

SMOOTHED = 0.7  # s, over which the first guess of the start is smoothed


@dataclass(frozen=True, slots=True, kw_only=True)
class Narx:
    """Two models in a row; depth counts from the first row of the start, for it integrates."""

    pitch: Any
    depth: Any
    lag: int

    def guess(self, series: Series) -> Array:
        """The first outputs, on a straight line through the first rows."""
        rows = np.arange(max(self.lag + 1, round(SMOOTHED / series.step)))
        lines = [np.polyfit(rows, y[: rows.size], 1) for y in series.outputs]
        return np.concatenate([np.polyval(line, np.arange(self.lag)) for line in lines])

    def run(self, start: Array, plane: Array) -> Array:
        """start: the first `lag` values of pitch, then of depth."""
        if plane.size <= self.lag:
            return np.array([start[: self.lag], start[self.lag :]])[:, : plane.size]
        datum = start[self.lag]
        pitch = self._simulated(self.pitch, plane[:, None], start[: self.lag])
        depth = self._simulated(self.depth, np.column_stack([plane, pitch]), start[self.lag :] - datum)
        return np.array([pitch, depth + datum])

    def _simulated(self, model: Any, inputs: Array, first: Array) -> Array:
        outputs = model.predict(X=inputs, y=first[: model.max_lag, None])[:, 0]
        outputs[: min(model.max_lag, self.lag)] = first[: model.max_lag]
        return np.asarray(outputs, dtype=np.float64)


def narx_learners() -> list[tuple[int, Learner]]:
    """Rows to a step, lags and degree; FROLS orders the terms, BIC counts them."""
    return [
        (every, partial(_learn, lag=lag, degree=degree))
        for every in (1, 3, 5)
        for lag, degree in ((2, 1), (4, 1), (2, 2), (2, 3))
    ]


def _learn(series: Series, lag: int, degree: int) -> Narx:
    pitch, depth = series.outputs
    return Narx(
        pitch=_fitted(series.plane[:, None], pitch, lag, degree),
        depth=_fitted(np.column_stack([series.plane, pitch]), depth - depth[0], lag, degree),
        lag=lag,
    )


def _fitted(inputs: Array, output: Array, lag: int, degree: int) -> Any:
    lags = list(range(1, lag + 1))
    model = FROLS(
        order_selection=True,
        n_info_values=15,
        info_criteria="bic",
        ylag=lag,
        xlag=lags if inputs.shape[1] == 1 else [lags] * inputs.shape[1],
        estimator=LeastSquares(),
        basis_function=Polynomial(degree=degree),
        model_type="NARMAX",
    )
    return model.fit(X=inputs, y=output[:, None])
