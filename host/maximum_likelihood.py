"""Maximum-likelihood identification: output error, and filter error when unknown forces act.

Minimises -log L = 1/2 sum_k [log det S_k + e_k^T S_k^-1 e_k] over the parameters, the initial state of each
recording and the noise levels. In output error the model runs freely and S is the sensors' noise; in filter
error a Kalman filter with white unknown forces gives e and S (Maine and Iliff, NASA RP-1138; Klein and
Morelli, Aircraft System Identification, ch. 6). Parameters move by Gauss-Newton steps with exact
sensitivities at fixed gain, the noise levels between them by a simplex search; every step goes downhill.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import minimize

from host.equations import BASE, Structure
from host.gauss_newton import GaussNewton, Mask, Point, whiten
from host.propagate import Inputs, free_run, innovations, inputs_of, kalman_pass
from host.recording import Array, Recording
from host.start_values import start_values
from host.whiteness import is_white

NoiseModel = Literal["auto", "output_error", "filter_error"]
Start = tuple[Array, list[Array]]

# rad^2, m^2: below any sensor, so that noise-free data divide by no zero
SMALLEST_NOISE = np.array([1e-12, 1e-10])
RUNAWAY = 1e7  # of a sensitivity, in SI: the model leaves the recording exponentially
ANNEALING = (0.1, 0.01, 1e-3, 1e-4)  # s, variance of the unknown force over that of all force
NOISE_FREE = 100.0 * SMALLEST_NOISE  # what is left of noise-free data is the integration error


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """The maximum of the likelihood over M recordings.

    parameters   (n,) in the order of structure.names
    free         (n,) False where the parameter was held
    information  (n, n) Fisher information of the parameters, initial states eliminated; zero for held ones
    initial      states (4,) at each recording's first row
    noise        (4,) variances of pitch rad^2, depth m^2; densities of unknown heave, pitch acceleration
    whitened     innovations over their deviation, (2, N) each, NaN where nothing was measured
    scores       whitened sensitivities of the free parameters, (2, free, N) each, what the initial states
                 could explain taken out
    """

    structure: Structure
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

    @property
    def samples(self) -> int:
        """Values measured, pitch and depth together."""
        return sum(int(np.isfinite(e).sum()) for e in self.whitened)


def fit_maximum_likelihood(
    recordings: list[Recording],
    *,
    structure: Structure = BASE,
    held: dict[str, float] | None = None,
    noise_model: NoiseModel = "auto",
    starts: list[Start] | None = None,
    on_progress: Callable[[str], None] = lambda _: None,
) -> Fit:
    """Identifies one vehicle from its recordings, jointly; several starts, the likeliest end wins.

    held  values of parameters by name that are not to be estimated. Where the recordings carry measured
          speed, u0 is held at its mean: speed and depth together leave it no freedom.
    noise_model  "auto" filters where the free run's residuals are not white and the likelihood gains by it
    starts  (parameters, initial states of each recording); by default found for the base equations,
            with the effects' own parameters at their first probe
    """
    held = dict(held) if held is not None else {}
    if recordings[0].has_speed:
        held["u0"] = float(np.mean([r.speed.mean() for r in recordings]))
    free = np.array([name not in held for name in structure.names])
    inputs = [inputs_of(recording, structure) for recording in recordings]
    if starts is None:
        own = [value for effect in structure.effects for value in effect.probes[0]]
        starts = [(np.concatenate([base, own]), initial) for base, initial in start_values(recordings)]
    candidates = []
    for parameters, initial in starts:
        parameters = np.clip(
            parameters,
            [parameter.lower for parameter in structure.parameters],
            [parameter.upper for parameter in structure.parameters],
        )
        for name, value in held.items():
            parameters[structure.names.index(name)] = value
        on_progress("output error")
        candidates.append(output_error(Point(structure, parameters, initial, np.zeros(4)), inputs, free))
    best = max(candidates, key=lambda fit: fit.log_likelihood)
    nothing_left = all(is_white(e) for e in best.whitened) or bool((best.noise[:2] < NOISE_FREE).all())
    if noise_model == "output_error" or (noise_model == "auto" and nothing_left):
        return best
    on_progress("filter error")
    filtered = filter_error(best, inputs)
    gain = filtered.log_likelihood - best.log_likelihood
    is_better = 2.0 * gain > 2.0 * np.log(best.samples)
    return filtered if is_better or noise_model == "filter_error" else best


def output_error(
    start: Point, inputs: list[Inputs], free: Mask, most_iterations: int = 40, tolerance: float = 1e-3
) -> Fit:
    """Gauss-Newton on the free run, the noise variances concentrated out; ends at a gain below tolerance."""
    point, damping, converged, iterations = start, 1e-3, False, 0
    parts = _innovations(point, inputs)
    noise = _residual_noise([error for error, _ in parts], inputs)
    cost = _concentrated_cost(noise, inputs)
    if not np.isfinite(cost) or not all(np.abs(S).max() < RUNAWAY for _, S in parts):
        # A start from which the model runs away: nothing can be improved from here.
        return _finished(
            point.with_noise(np.ones(4)), [(0 * e, 0 * S) for e, S in parts], inputs, free, -np.inf, 0, False
        )
    while not converged and iterations < most_iterations:
        iterations += 1
        step = GaussNewton(_whitened_by(noise, parts), point, free)
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
        converged = cost - trial_cost < tolerance
        cost, point, noise = trial_cost, trial, trial_noise
        parts = _innovations(point, inputs)
        damping = damping / 10.0
    point = point.with_noise(np.concatenate([noise, [0.0, 0.0]]))
    return _finished(point, _whitened_by(noise, parts), inputs, free, -cost, iterations, converged)


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
    white = _whitened_at(point, inputs)
    return _finished(point, white, inputs, start.free, likelihood, used, converged)


def annealed(start: Point, inputs: list[Inputs], free: Mask, accelerations: tuple[float, float]) -> Point:
    """The start moved into the right valley: Gauss-Newton while the measurements still steer the state.

    With much unknown force the filter follows the measurements, and the criterion is nearly that of
    regression, with one minimum; with little it is that of the free run. The force is let go in stages.

    accelerations  rms of w' (m/s^2) and q' (rad/s^2), the size of all forces together
    """
    point = start
    for share in ANNEALING:
        forces = [share * acceleration**2 for acceleration in accelerations]
        point = point.with_noise(np.array([*start.noise[:2], *forces]))
        for _ in range(2):
            with np.errstate(all="ignore"):
                white = _whitened_at(point, inputs)
                if not all(np.abs(S).max() < 1e3 * RUNAWAY for _, S in white):
                    return start
                point = GaussNewton(white, point, free).trial(1e-6)
    return point.with_noise(start.noise)


def _gauss_newton_filter(
    point: Point, inputs: list[Inputs], free: Mask, likelihood: float
) -> tuple[Point, float]:
    damping = 1e-3
    for _ in range(4):
        step = GaussNewton(_whitened_at(point, inputs), point, free)
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


def residuals_at(point: Point, inputs: list[Inputs]) -> list[tuple[Array, Array]]:
    """Free-run residuals whitened by the point's sensor noise, and their sensitivities."""
    return _whitened_by(point.noise, _innovations(point, inputs))


def _innovations(point: Point, inputs: list[Inputs]) -> list[tuple[Array, Array]]:
    return [innovations(point.parameters, x0, one) for x0, one in zip(point.initial, inputs, strict=True)]


def _whitened_by(noise: Array, parts: list[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    variance = np.array([[noise[0]], [0.0], [noise[1]]])
    return [whiten(e, S, np.repeat(variance, e.shape[1], axis=1)) for e, S in parts]


def _whitened_at(point: Point, inputs: list[Inputs]) -> list[tuple[Array, Array]]:
    white = []
    for x0, one in zip(point.initial, inputs, strict=True):
        run = kalman_pass(point.parameters, x0, point.noise, one)
        error, sensitivity = innovations(point.parameters, x0, one, run.gains)
        white.append(whiten(error, sensitivity, run.variance))
    return white


def _free_run_errors(point: Point, inputs: list[Inputs]) -> list[Array]:
    with np.errstate(invalid="ignore"):  # a trial that runs away is infinite, and refused for it
        return [
            one.present * (one.measured - free_run(point.parameters, x0, one).outputs)
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


def _finished(
    point: Point,
    white: list[tuple[Array, Array]],
    inputs: list[Inputs],
    free: Mask,
    likelihood: float,
    iterations: int,
    converged: bool,
) -> Fit:
    normal = GaussNewton(white, point, free)
    information = np.zeros((free.size, free.size))
    information[np.ix_(free, free)] = normal.information()
    return Fit(
        structure=point.structure,
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
