"""Filter error: maximum likelihood when random forces act, by the innovations of a Kalman filter.

-log L = 1/2 sum_k [log det S_k + e_k^T S_k^-1 e_k] with the filter's innovations e and their variances S
(Maine and Iliff, NASA RP-1138; Klein and Morelli, Aircraft System Identification, ch. 6). Parameters move by
Gauss-Newton steps with exact sensitivities at fixed gain, the noise levels between them by a simplex search.
"""

import numpy as np
from scipy.optimize import minimize

from host.fit import Fit, finished
from host.gauss_newton import GaussNewton, Mask, Point, whiten
from host.kalman import kalman_pass
from host.propagate import Inputs, innovations
from host.recording import Array


def filter_error(start: Fit, inputs: list[Inputs], rounds: int = 6) -> Fit:
    """Alternates noise levels and Gauss-Newton steps at the Kalman gain they imply."""
    noise = start.noise
    if not start.has_process_noise:
        # Half of what output error calls sensor noise may really be force: a neutral place to begin.
        step = float(np.median(np.concatenate([i.drive[3] for i in inputs])))
        noise = np.concatenate([start.noise[:2] / 2.0, start.noise[:2][::-1] * step])
    point = Point(start.structure, start.parameters, start.initial, noise)
    point, likelihood = _fit_noise(point, inputs, evaluations=70)
    converged, used = False, 0
    while not converged and used < rounds:
        used, before = used + 1, likelihood
        point, likelihood = _gauss_newton_filter(point, inputs, start.free, likelihood)
        point, likelihood = _fit_noise(point, inputs, evaluations=30)
        converged = likelihood - before < 0.05
    white = whitened_innovations(point, inputs)
    return finished(point, white, inputs, start.free, likelihood, used, converged)


def whitened_innovations(point: Point, inputs: list[Inputs]) -> list[tuple[Array, Array]]:
    """The filter's innovations over their deviation (2, N), and their sensitivities at fixed gain."""
    white = []
    for x0, one in zip(point.initial, inputs, strict=True):
        run = kalman_pass(point.parameters, x0, point.noise, one)
        error, sensitivity = innovations(point.parameters, x0, one, run.gains)
        white.append(whiten(error, sensitivity, run.variance))
    return white


def _gauss_newton_filter(
    point: Point, inputs: list[Inputs], free: Mask, likelihood: float
) -> tuple[Point, float]:
    damping = 1e-3
    for _ in range(4):
        step = GaussNewton(whitened_innovations(point, inputs), point, free)
        trial, trial_likelihood = point, -np.inf
        while trial_likelihood <= likelihood and damping < 1e8:
            trial = step.trial(damping)
            trial_likelihood = _filter_likelihood(trial, inputs)
            damping *= 8.0
        if trial_likelihood <= likelihood:
            break
        gained, point, likelihood = trial_likelihood - likelihood, trial, trial_likelihood
        damping /= 100.0
        if gained < 0.01:
            break
    return point, likelihood


def _fit_noise(point: Point, inputs: list[Inputs], evaluations: int) -> tuple[Point, float]:
    """Simplex search over three log ratios to the pitch variance; the common scale has a closed form."""

    def scaled(log_ratios: Array) -> tuple[Array, float]:
        noise = np.concatenate([[1.0], np.exp(np.clip(log_ratios, -60.0, 60.0))]) * point.noise[0]
        quadratic, log_det, count = _filter_terms(point.with_noise(noise), inputs)
        scale = quadratic / count
        if not np.isfinite(quadratic) or scale <= 0.0:
            return noise, np.inf
        return noise * scale, 0.5 * (log_det + count * np.log(scale) + count)

    start = np.log(np.maximum(point.noise[1:], 1e-30) / point.noise[0])
    result = minimize(
        lambda ratios: scaled(ratios)[1],
        start,
        method="Nelder-Mead",
        options=dict(
            initial_simplex=start + np.vstack([np.zeros(3), np.diag([0.7, 2.0, 2.0])]),
            xatol=0.05,
            fatol=0.05,
            maxfev=evaluations,
        ),
    )
    noise, cost = scaled(result.x)
    return point.with_noise(noise), -cost


def _filter_terms(point: Point, inputs: list[Inputs]) -> tuple[float, float, int]:
    """sum e^T S^-1 e, sum log det S over what was measured, and the number of values measured."""
    quadratic = log_det = 0.0
    count = 0
    for x0, one in zip(point.initial, inputs, strict=True):
        run = kalman_pass(point.parameters, x0, point.noise, one)
        S11, S12, S22 = run.variance
        missing = 1.0 - one.present
        det = S11 * S22 - S12**2
        e1, e2 = run.error
        quadratic += float(np.sum((S22 * e1**2 - 2.0 * S12 * e1 * e2 + S11 * e2**2) / det))
        # A missing value leaves its sensor variance alone in S: take it out again.
        log_det += float(np.sum(np.log(det)) - missing.sum(axis=1) @ np.log(point.noise[:2]))
        count += int(one.present.sum())
    return quadratic, log_det, count


def _filter_likelihood(point: Point, inputs: list[Inputs]) -> float:
    quadratic, log_det, _ = _filter_terms(point, inputs)
    value = -0.5 * (quadratic + log_det)
    return float(value) if np.isfinite(value) else -np.inf
