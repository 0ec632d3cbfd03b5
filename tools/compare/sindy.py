"""Sparse regression by PySINDy, weak form, on pitch and, from smoothing, its rate and that of depth."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np
import pysindy
from scipy.signal import savgol_filter

from host.recordings.recording import Array
from tools.compare.free_run import Learner
from tools.compare.series import Series

Term = Callable[..., Array]
LINEAR: tuple[Term, ...] = (lambda x: x,)
MODULUS: tuple[Term, ...] = (*LINEAR, lambda x: x * np.abs(x))
PRODUCTS: tuple[Term, ...] = (*MODULUS, lambda x, y: x * y)
DOMAINS = 300  # in which the equations are integrated
FIRST, SECOND = np.array(list(combinations(range(4), 2))).T
CUBIC = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Sindy:
    """d/dt (theta, q, v) = coefficients (3, L) times the terms of z = (theta, q, v, delta); v = zeta'."""

    terms: tuple[Term, ...]
    coefficients: Array
    window: float
    step: float

    def guess(self, series: Series) -> Array:
        """theta, q, v, zeta at the first row."""
        return np.array([*_states(series, self.window)[0], series.outputs[1, 0]])

    def run(self, start: Array, plane: Array) -> Array:
        """Runge-Kutta, the plane held over each step."""
        outputs, x, h = np.full((2, plane.size), np.inf), start, self.step
        for k, delta in enumerate(plane.tolist()):
            outputs[:, k] = x[0], x[3]
            k1 = self._rate(x, delta)
            k2 = self._rate(x + 0.5 * h * k1, delta)
            k3 = self._rate(x + 0.5 * h * k2, delta)
            k4 = self._rate(x + h * k3, delta)
            x = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
            if not np.abs(x).max() < 1e6:
                break
        return outputs

    def _rate(self, x: Array, delta: float) -> Array:
        z = np.array([x[0], x[1], x[2], delta])
        features = [np.ones(1), *(term(z) for term in self.terms[:2])]
        if self.terms is PRODUCTS:
            features.append(z[FIRST] * z[SECOND])
        return np.append(self.coefficients @ np.concatenate(features), x[2])


def sindy_learners() -> list[tuple[int, Learner]]:
    """Smoothing window, span of the weak form's domains, terms, threshold."""
    return [
        (1, partial(_learn, window=window, span=span, terms=terms, threshold=threshold))
        for window in (0.5, 1.5)
        for span in (1.0, 2.0)
        for terms in (LINEAR, MODULUS, PRODUCTS)
        for threshold in (0.0, 0.05)
    ]


def _learn(series: Series, window: float, span: float, terms: tuple[Term, ...], threshold: float) -> Sindy:
    np.random.seed(0)  # the library draws its domains from the global generator
    model = pysindy.SINDy(
        optimizer=pysindy.STLSQ(threshold=threshold, alpha=1e-6),
        feature_library=pysindy.WeakPDELibrary(
            function_library=pysindy.CustomLibrary(list(terms), include_bias=True),
            spatiotemporal_grid=series.time,
            K=DOMAINS,
            H_xt=[span],
        ),
    )
    model.fit(_states(series, window), t=series.time, u=series.plane[:, None])
    coefficients = np.asarray(model.coefficients(), dtype=np.float64)
    return Sindy(terms=terms, coefficients=coefficients, window=window, step=series.step)


def _states(series: Series, window: float) -> Array:
    """theta, q, v (N, 3), by local cubics over the window."""
    length = max(round(window / series.step) // 2 * 2 + 1, CUBIC + 2)
    theta, q = (savgol_filter(series.outputs[0], length, CUBIC, deriv=n, delta=series.step) for n in (0, 1))
    v = savgol_filter(series.outputs[1], length, CUBIC, deriv=1, delta=series.step)
    return np.column_stack([theta, q, v])
