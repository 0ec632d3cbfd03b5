"""Maximum-likelihood identification: output error, and filter error when unknown forces act.

Minimises -log L = 1/2 sum_k [log det S_k + e_k^T S_k^-1 e_k] over the parameters, the initial state of each
recording and the noise levels. In output error the model runs freely and S is the sensors' noise; in filter
error a Kalman filter with white unknown forces gives e and S (Maine and Iliff, NASA RP-1138; Klein and
Morelli, Aircraft System Identification, ch. 6). Parameters move by Gauss-Newton steps with exact
sensitivities at fixed gain, the noise levels between them by a simplex search; every step goes downhill.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from host.equations import PARAMETERS
from host.propagate import NP, NX, Inputs, free_run, innovations, inputs_of, kalman_pass
from host.recording import Array, Recording
from host.start_values import start_values
from host.whiteness import is_white

Mask = NDArray[np.bool_]
LOWER = np.array([parameter.lower for parameter in PARAMETERS])
UPPER = np.array([parameter.upper for parameter in PARAMETERS])
INITIAL_STATE_PRIOR = np.array([1.0, 1.0, 1.0, 100.0])  # std of w, q, theta, zeta; keeps short dives solvable
# rad^2, m^2: below any sensor, so that noise-free data divide by no zero
SMALLEST_NOISE = np.array([1e-12, 1e-10])
NOISE_FREE = 100.0 * SMALLEST_NOISE  # what is left of noise-free data is the integration error


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """The maximum of the likelihood over M recordings.

    parameters   (8,) in the order of host.equations.NAMES
    free         (8,) False where the parameter was held
    information  (8, 8) Fisher information of the parameters, initial states eliminated; zero for held ones
    initial      states (4,) at each recording's first row
    noise        (4,) variances of pitch rad^2, depth m^2; densities of unknown heave, pitch acceleration
    whitened     innovations over their deviation, (2, N) each, NaN where nothing was measured
    scores       whitened sensitivities of the free parameters, (2, free, N) each, what the initial states
                 could explain taken out
    """

    parameters: Array
    free: Mask
    information: Array
    initial: list[Array]
    noise: Array
    whitened: list[Array]
    scores: list[Array]
    log_likelihood: float
    iterations: int
    converged: bool

    @property
    def has_process_noise(self) -> bool:
        return bool(self.noise[2:].any())


@dataclass(frozen=True, slots=True)
class _Point:
    parameters: Array
    initial: list[Array]
    noise: Array


def fit_maximum_likelihood(
    recordings: list[Recording],
    *,
    held: dict[int, float] | None = None,
    noise_model: Literal["auto", "output_error", "filter_error"] = "auto",
    on_progress: Callable[[str], None] = lambda _: None,
) -> Fit:
    """Identifies one vehicle from its recordings, jointly; several starts, the likeliest end wins.

    held  values of parameters (by index in NAMES) that are not to be estimated. Where the recordings
          carry measured speed, u0 is held at its mean: speed and depth together leave it no freedom.
    noise_model  "auto" filters where the free run's residuals are not white and the likelihood gains by it
    """
    held = dict(held) if held is not None else {}
    if recordings[0].has_speed:
        held[5] = float(np.mean([r.speed.mean() for r in recordings]))
    free = np.array([index not in held for index in range(NP)])
    inputs = [inputs_of(recording) for recording in recordings]
    candidates = []
    for parameters, initial in start_values(recordings):
        parameters = np.clip(parameters, LOWER, UPPER)
        for index, value in held.items():
            parameters[index] = value
        on_progress("output error")
        candidates.append(_output_error(_Point(parameters, initial, np.zeros(4)), inputs, free))
    best = max(candidates, key=lambda fit: fit.log_likelihood)
    nothing_left = all(is_white(e) for e in best.whitened) or bool((best.noise[:2] < NOISE_FREE).all())
    if noise_model == "output_error" or (noise_model == "auto" and nothing_left):
        return best
    on_progress("filter error")
    filtered = _filter_error(best, inputs, free)
    samples = sum(int(i.present.sum()) for i in inputs)
    gain = filtered.log_likelihood - best.log_likelihood
    is_better = 2.0 * gain > 2.0 * np.log(samples)
    return filtered if is_better or noise_model == "filter_error" else best


def _output_error(start: _Point, inputs: list[Inputs], free: Mask, most_iterations: int = 40) -> Fit:
    """Gauss-Newton on the free run, the noise variances concentrated out."""
    point, damping, converged, iterations = start, 1e-3, False, 0
    parts = [innovations(point.parameters, x0, i) for x0, i in zip(point.initial, inputs, strict=True)]
    noise = _residual_noise([error for error, _ in parts], inputs)
    cost = _concentrated_cost(noise, inputs)
    while not converged and iterations < most_iterations:
        iterations += 1
        white = [_whiten(e, S, _constant_variance(noise, e.shape[1])) for e, S in parts]
        step = _GaussNewton(white, point, free)
        while True:
            trial = step.trial(damping)
            trial_noise = _residual_noise(_free_run_errors(trial, inputs), inputs)
            trial_cost = _concentrated_cost(trial_noise, inputs)
            if trial_cost < cost or damping > 1e8:
                break
            damping = max(damping * 8.0, 1e-6)
        if not trial_cost < cost:
            converged = True
            break
        converged = cost - trial_cost < 1e-3
        cost, point, noise = trial_cost, trial, trial_noise
        parts = [innovations(point.parameters, x0, i) for x0, i in zip(point.initial, inputs, strict=True)]
        damping = damping / 10.0
    white = [_whiten(e, S, _constant_variance(noise, e.shape[1])) for e, S in parts]
    full_noise = np.concatenate([noise, [0.0, 0.0]])
    return _finished(_with_noise(point, full_noise), white, inputs, free, -cost, iterations, converged)


def _filter_error(start: Fit, inputs: list[Inputs], free: Mask, rounds: int = 6) -> Fit:
    """Alternates noise levels and Gauss-Newton steps at the Kalman gain they imply."""
    step = float(np.median(np.concatenate([i.drive[3] for i in inputs])))
    # Half of what output error calls sensor noise may really be force: a neutral place to begin.
    first = np.concatenate([start.noise[:2] / 2.0, start.noise[:2][::-1] * step])
    point = _Point(start.parameters, start.initial, first)
    point, likelihood = _fit_noise(point, inputs, evaluations=70)
    converged, used = False, 0
    while not converged and used < rounds:
        used, before = used + 1, likelihood
        point, likelihood = _gauss_newton_filter(point, inputs, free, likelihood)
        point, likelihood = _fit_noise(point, inputs, evaluations=30)
        converged = likelihood - before < 0.05
    white = [_whitened_at(point, x0, i) for x0, i in zip(point.initial, inputs, strict=True)]
    return _finished(point, white, inputs, free, likelihood, used, converged)


def _gauss_newton_filter(
    point: _Point,
    inputs: list[Inputs],
    free: np.ndarray,
    likelihood: float,
) -> tuple[_Point, float]:
    damping = 1e-3
    for _ in range(4):
        white = [_whitened_at(point, x0, i) for x0, i in zip(point.initial, inputs, strict=True)]
        step = _GaussNewton(white, point, free)
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


def _fit_noise(point: _Point, inputs: list[Inputs], evaluations: int) -> tuple[_Point, float]:
    """Simplex search over three log ratios to the pitch variance; the common scale has a closed form."""

    def scaled(log_ratios: Array) -> tuple[Array, float]:
        noise = np.concatenate([[1.0], np.exp(np.clip(log_ratios, -60.0, 60.0))]) * point.noise[0]
        quadratic, log_det, count = _filter_terms(_with_noise(point, noise), inputs)
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
    return _with_noise(point, noise), -cost


def _filter_terms(point: _Point, inputs: list[Inputs]) -> tuple[float, float, int]:
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


def _filter_likelihood(point: _Point, inputs: list[Inputs]) -> float:
    quadratic, log_det, _ = _filter_terms(point, inputs)
    value = -0.5 * (quadratic + log_det)
    return float(value) if np.isfinite(value) else -np.inf


def _whitened_at(point: _Point, initial: Array, inputs: Inputs) -> tuple[Array, Array]:
    run = kalman_pass(point.parameters, initial, point.noise, inputs)
    error, sensitivity = innovations(point.parameters, initial, inputs, run.gains)
    return _whiten(error, sensitivity, run.variance)


def _whiten(error: Array, sensitivity: Array, variance: Array) -> tuple[Array, Array]:
    """Multiplies by the inverse Cholesky factor of each row's 2 x 2 innovation variance."""
    l11 = np.sqrt(variance[0])
    l21 = variance[1] / l11
    l22 = np.sqrt(variance[2] - l21**2)
    white = np.empty_like(error)
    white[0] = error[0] / l11
    white[1] = (error[1] - l21 * white[0]) / l22
    scores = np.empty_like(sensitivity)
    scores[0] = sensitivity[0] / l11
    scores[1] = (sensitivity[1] - l21 * scores[0]) / l22
    return white, scores


def _constant_variance(noise: Array, rows: int) -> Array:
    return np.repeat(np.array([[noise[0]], [0.0], [noise[1]]]), rows, axis=1)


def _free_run_errors(point: _Point, inputs: list[Inputs]) -> list[Array]:
    return [
        one.present * (one.measured - free_run(point.parameters, x0, one)[2:])
        for x0, one in zip(point.initial, inputs, strict=True)
    ]


def _residual_noise(errors: list[Array], inputs: list[Inputs]) -> Array:
    count = sum(one.present.sum(axis=1) for one in inputs)
    with np.errstate(over="ignore", invalid="ignore"):
        squares = np.sum([np.sum(error**2, axis=1) for error in errors], axis=0)
        variance: Array = np.maximum(np.nan_to_num(squares / count, nan=np.inf), SMALLEST_NOISE)
    return variance


def _concentrated_cost(noise: Array, inputs: list[Inputs]) -> float:
    count = sum(one.present.sum(axis=1) for one in inputs)
    return 0.5 * float(np.sum(count * (np.log(noise) + 1.0)))


class _GaussNewton:
    """Normal equations with each recording's initial state eliminated by its Schur complement."""

    def __init__(self, white: list[tuple[Array, Array]], point: _Point, free: Mask) -> None:
        self.point, self.free = point, free
        count = int(free.sum())
        self.H, self.g = np.zeros((count, count)), np.zeros(count)
        self.own: list[tuple[Array, Array, Array]] = []
        for error, scores in white:
            J = np.concatenate([scores[:, :NP][:, free], scores[:, NP:]], axis=1)
            flat = J.transpose(1, 0, 2).reshape(count + NX, -1)
            H, g = flat @ flat.T, flat @ error.ravel()
            self.H += H[:count, :count]
            self.g += g[:count]
            Hxx = H[count:, count:] + np.diag(INITIAL_STATE_PRIOR**-2.0)
            self.own.append((H[:count, count:], Hxx, g[count:]))

    def information(self) -> Array:
        """Fisher information of the free parameters alone."""
        reduced = self.H.copy()
        for Hpx, Hxx, _ in self.own:
            reduced -= Hpx @ np.linalg.solve(Hxx, Hpx.T)
        return reduced

    def scores(self, white: list[tuple[Array, Array]]) -> list[Array]:
        """Sensitivities of the free parameters (2, free, N), the initial states eliminated."""
        return [
            S[:, :NP][:, self.free] - np.einsum("px,oxk->opk", np.linalg.solve(Hxx, Hpx.T).T, S[:, NP:])
            for (_, S), (Hpx, Hxx, _) in zip(white, self.own, strict=True)
        ]

    def trial(self, damping: float) -> _Point:
        """The point one damped step on (Levenberg-Marquardt), inside the parameters' bounds."""
        reduced, rhs = self.information(), self.g.copy()
        for Hpx, Hxx, gx in self.own:
            rhs -= Hpx @ np.linalg.solve(Hxx, gx)
        scale = np.sqrt(np.maximum(np.diag(self.H), 1e-300))
        normal = reduced / np.outer(scale, scale) + damping * np.eye(scale.size)
        try:
            delta = cho_solve(cho_factor(normal), rhs / scale) / scale
        except np.linalg.LinAlgError:
            delta = np.linalg.lstsq(normal, rhs / scale, rcond=1e-12)[0] / scale
        parameters = self.point.parameters.copy()
        parameters[self.free] = np.clip(parameters[self.free] + delta, LOWER[self.free], UPPER[self.free])
        moved = parameters[self.free] - self.point.parameters[self.free]
        initial = [
            x0 + np.linalg.solve(Hxx * (1.0 + damping * np.eye(NX)), gx - Hpx.T @ moved)
            for x0, (Hpx, Hxx, gx) in zip(self.point.initial, self.own, strict=True)
        ]
        return _Point(parameters, initial, self.point.noise)


def _with_noise(point: _Point, noise: Array) -> _Point:
    return replace(point, noise=noise)


def _finished(
    point: _Point,
    white: list[tuple[Array, Array]],
    inputs: list[Inputs],
    free: Mask,
    likelihood: float,
    iterations: int,
    converged: bool,
) -> Fit:
    information = np.zeros((NP, NP))
    normal = _GaussNewton(white, point, free)
    information[np.ix_(free, free)] = normal.information()
    return Fit(
        parameters=point.parameters,
        free=free,
        information=information,
        initial=point.initial,
        noise=point.noise,
        whitened=[np.where(i.present > 0.0, e, np.nan) for (e, _), i in zip(white, inputs, strict=True)],
        scores=normal.scores(white),
        log_likelihood=likelihood,
        iterations=iterations,
        converged=converged,
    )
