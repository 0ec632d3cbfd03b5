"""Maximum-likelihood identification: output error, and filter error when unknown forces act.

Minimises -log L = 1/2 sum_k [log det S_k + e_k^T S_k^-1 e_k] over the parameters, the initial state of each
recording and the noise levels. In output error the model runs freely and S is the sensors' noise; in filter
error (host.filter_error, host.wave_forces) a Kalman filter gives e and S; where the sensors' errors wander,
a filter in each sensor does (host.coloured_noise). Source: Maine and Iliff, NASA RP-1138; Klein and Morelli,
Aircraft System Identification, ch. 6.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Literal

import numpy as np

from host.coloured_noise import coloured_noise
from host.equations import BASE, Structure
from host.filter_error import filter_error, whitened_innovations
from host.fit import Fit, finished, run_away
from host.gauss_newton import GaussNewton, Mask, Point, whiten
from host.propagate import Inputs, free_run, innovations, inputs_of
from host.recording import Array, Recording
from host.start_values import start_values
from host.wave_forces import wave_forces
from host.whiteness import is_white

NoiseModel = Literal["auto", "output_error", "filter_error"]
Start = tuple[Array, list[Array]]

# rad^2, m^2: below any sensor, so that noise-free data divide by no zero
SMALLEST_NOISE = np.array([1e-12, 1e-10])
RUNAWAY = 1e7  # of a sensitivity, in SI: the model leaves the recording exponentially
ANNEALING = (0.1, 0.01, 1e-3, 1e-4)  # s, variance of the unknown force over that of all force
ALMOST_AS_LIKELY = 3.0  # of a log-likelihood: odds of 20 to 1 and less rule nothing out
APART = 4.0  # standard deviations between two modes
NEAR = 0.05  # of a log-likelihood for each value measured: the noise model may still change the order
NOISE_FREE = 100.0 * SMALLEST_NOISE  # what is left of noise-free data is the integration error


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
    noise_model  "auto": where the free run's residuals are not white, random forces, sensors that
                 wander or waves, or none of them, whichever has the least BIC
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
    others = [fit for fit in candidates if fit is not best]
    nothing_left = all(is_white(e) for e in best.whitened) or bool((best.noise[:2] < NOISE_FREE).all())
    if noise_model == "output_error" or (noise_model == "auto" and nothing_left):
        return _with_rivals(best, others)
    on_progress("random forces, wandering sensors, waves")
    if noise_model == "filter_error":
        chosen = filter_error(best, inputs)
    else:
        chosen = best
        for fit in _noise_models(best, inputs):
            chosen = min(chosen, fit, key=lambda fit: fit.bic)
            if chosen is fit and all(is_white(e) for e in fit.whitened):
                break
    near = [fit for fit in others if fit.log_likelihood > best.log_likelihood - NEAR * best.samples]
    return _with_rivals(chosen, [_like(chosen, fit, inputs) for fit in near if _are_apart(fit, best)])


def _noise_models(start: Fit, inputs: list[Inputs]) -> Iterator[Fit]:
    """The fits that explain coloured residuals, the likelier and cheaper kinds first."""
    filtered = filter_error(start, inputs)
    yield filtered
    yield coloured_noise(start, inputs)
    if filtered.bic < start.bic:
        yield wave_forces(filtered, inputs)


def _like(chosen: Fit, start: Fit, inputs: list[Inputs]) -> Fit:
    """Another end under the noise model that was chosen."""
    if chosen.waves.any():
        return wave_forces(filter_error(start, inputs), inputs)
    if chosen.has_process_noise:
        return filter_error(start, inputs)
    return coloured_noise(start, inputs) if chosen.has_coloured_noise else start


def _with_rivals(fit: Fit, others: list[Fit]) -> Fit:
    """The likeliest of all, with the other ends that the recording cannot rule out."""
    best = max([fit, *others], key=lambda end: end.log_likelihood)
    rivals: list[Fit] = []
    for other in sorted([fit, *others], key=lambda end: -end.log_likelihood):
        is_near = other.log_likelihood > best.log_likelihood - ALMOST_AS_LIKELY
        if is_near and all(_are_apart(other, known) for known in (best, *rivals)):
            rivals.append(other)
    return replace(best, rivals=tuple(rival.parameters for rival in rivals))


def _are_apart(one: Fit, other: Fit) -> bool:
    """Whether two ends are two modes: further apart than the deviations of either."""
    apart = one.parameters - other.parameters
    return min(float(apart @ fit.information @ apart) for fit in (one, other)) > APART**2


def output_error(
    start: Point, inputs: list[Inputs], free: Mask, most_iterations: int = 40, tolerance: float = 1e-3
) -> Fit:
    """Gauss-Newton on the free run, the noise variances concentrated out; ends at a gain below tolerance."""
    point, damping, converged, iterations = start, 1e-3, False, 0
    parts = _innovations(point, inputs)
    noise = _residual_noise([error for error, _ in parts], inputs)
    cost = _concentrated_cost(noise, inputs)
    if not np.isfinite(cost) or not all(np.abs(S).max() < RUNAWAY for _, S in parts):
        return run_away(point, inputs, free)
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
    return finished(point, _whitened_by(noise, parts), inputs, free, -cost, iterations, converged)


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
                white = whitened_innovations(point, inputs)
                if not all(np.abs(S).max() < 1e3 * RUNAWAY for _, S in white):
                    return start
                point = GaussNewton(white, point, free).trial(1e-6)
    return point.with_noise(start.noise)


def residuals_at(point: Point, inputs: list[Inputs]) -> list[tuple[Array, Array]]:
    """Free-run residuals whitened by the point's sensor noise, and their sensitivities."""
    return _whitened_by(point.noise, _innovations(point, inputs))


def _innovations(point: Point, inputs: list[Inputs]) -> list[tuple[Array, Array]]:
    return [innovations(point.parameters, x0, one) for x0, one in zip(point.initial, inputs, strict=True)]


def _whitened_by(noise: Array, parts: list[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    variance = np.array([[noise[0]], [0.0], [noise[1]]])
    return [whiten(e, S, np.repeat(variance, e.shape[1], axis=1)) for e, S in parts]


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
