"""Maximum likelihood where the sensors' white noise is all that is random: the model runs freely.

With residuals e of the free run, and the noise variances R of pitch and depth at their likeliest values,
-log L = 1/2 sum over the channels of count (log R + 1). A channel whose rounding rules its noise has the
likelihood of intervals (host.likelihood.interval_likelihood); R is then the noise before rounding
and step^2 / 12.
"""

import numpy as np

from host.compiled.side_by_side import side_by_side
from host.dynamics.propagate import Inputs, Run, free_run
from host.dynamics.sensitivities import sensitivities
from host.likelihood.filter_error import whitened_innovations
from host.likelihood.fit import Fit, finished, run_away
from host.likelihood.gauss_newton import GaussNewton, Mask, Point
from host.likelihood.interval_likelihood import (
    LEAST_DEVIATION,
    likeliest_deviation,
    log_probability,
    score_and_information,
)
from host.likelihood.start_prior import start_cost
from host.recordings.recording import Array

# rad^2, m^2: below any sensor, so that noise-free data divide by no zero
SMALLEST_NOISE = np.array([1e-12, 1e-10])
RUNAWAY = 1e7  # of a sensitivity, in SI: the model leaves the recording exponentially
USUAL_DURATION = 300.0  # s; over longer ones sensitivities may be larger
LOST = 1e12  # rad^2, m^2: a run that leaves the recording needs no likelihood of its rounding
PROMISED = 10.0  # times the tolerance: what an undamped step may promise where nothing more is gained
QUICKER = 3.0  # times the pace of its last step, that a search may still gain
LEAST_DAMPING = 1e-9  # once a step was refused: curved valleys are far narrower than they are long
ANNEALING = (0.1, 0.01, 1e-3, 1e-4)  # s, variance of the unknown force over that of all force


def output_error(
    start: Point,
    inputs: list[Inputs],
    free: Mask,
    most_iterations: int = 40,
    tolerance: float = 1e-3,
    least: float = -np.inf,
) -> Fit:
    """Gauss-Newton on the free run, the noise variances concentrated out; ends at a gain below tolerance.

    least  a log-likelihood: it gives up where it would not get there at some times the pace of its last step
    """
    point, damping, converged, iterations = start, 1e-3, False, 0
    runs = _free_runs(point, inputs)
    noise, cost = _cost(point, runs, inputs)
    parts = _innovations(point, runs, inputs)
    if not np.isfinite(cost) or diverges(parts, inputs):
        return run_away(point, inputs, free)
    while not converged and iterations < most_iterations:
        iterations += 1
        step = GaussNewton(_whitened_by(noise, parts, inputs), point, free)
        while True:
            trial = step.trial(damping)
            runs = _free_runs(trial, inputs)
            trial_noise, trial_cost = _cost(trial, runs, inputs)
            if trial_cost < cost or damping > 1e8:
                break
            damping = max(damping * 8.0, LEAST_DAMPING)
        if not trial_cost < cost:
            converged = True
            break
        # In a curved valley steps are short, and gain little, while much is left to gain.
        gained = cost - trial_cost
        converged = gained < tolerance and step.promise() < PROMISED * tolerance
        cost, point, noise = trial_cost, trial, trial_noise
        parts = _innovations(point, runs, inputs)
        damping = damping / 10.0
        if -cost + QUICKER * gained * (most_iterations - iterations) < least:
            break
    point = point.with_noise(np.concatenate([noise, [0.0, 0.0]]))
    white = _whitened_by(noise, parts, inputs)
    deviance = _deviance(noise, parts, white, inputs)
    return finished(point, white, inputs, free, -cost, iterations, converged, deviance)


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
                if diverges(white, inputs, 1e3):
                    return start
                point = GaussNewton(white, point, free).trial(1e-6)
    return point.with_noise(start.noise)


def diverges(parts: list[tuple[Array, Array]], inputs: list[Inputs], scale: float = 1.0) -> bool:
    """Whether a model leaves its recordings exponentially, by sensitivities (2, parameters + 4, N) of each.

    Without restoring, those of depth to a moment grow with the cube of time.
    """
    durations = [float(one.drive[4, -1] - one.drive[4, 0]) for one in inputs]
    limits = [scale * RUNAWAY * max(1.0, duration / USUAL_DURATION) ** 3 for duration in durations]
    return not all(np.abs(S).max(initial=0.0) < limit for (_, S), limit in zip(parts, limits, strict=True))


def free_run_cost(point: Point, inputs: list[Inputs]) -> float:
    """-log L of the free run at a point, but for a constant; inf where it runs away."""
    _, cost = _cost(point, _free_runs(point, inputs), inputs)
    return cost if np.isfinite(cost) else np.inf


def residuals_at(
    point: Point, inputs: list[Inputs], has_slopes: bool = True
) -> tuple[list[tuple[Array, Array]], float]:
    """Free-run residuals whitened by the point's sensor noise, their sensitivities, and the deviance.

    has_slopes  or without the sensitivities, (2, 0, N), which take three times as long as the run
    """
    runs = _free_runs(point, inputs)
    if has_slopes:
        parts = _innovations(point, runs, inputs)
    else:
        parts = [(error, np.empty((2, 0, error.shape[1]))) for error in _errors(runs, inputs)]
    white = _whitened_by(point.noise, parts, inputs)
    return white, _deviance(point.noise, parts, white, inputs)


def _cost(point: Point, runs: list[Run], inputs: list[Inputs]) -> tuple[Array, float]:
    """The likeliest noise variances (2,) of free runs, and -log L there, that of their start with it."""
    noise, cost = _likeliest_noise(_errors(runs, inputs), inputs)
    return noise, cost + start_cost(point.initial)


def _free_runs(point: Point, inputs: list[Inputs]) -> list[Run]:
    each = list(zip(point.initial, inputs, strict=True))
    return side_by_side(lambda one: free_run(point.parameters, *one), each)


def _errors(runs: list[Run], inputs: list[Inputs]) -> list[Array]:
    with np.errstate(invalid="ignore"):  # a trial that runs away is infinite, and refused for it
        errors = [one.present * (one.measured - run.outputs) for run, one in zip(runs, inputs, strict=True)]
    return [_whitened(error, one) for error, one in zip(errors, inputs, strict=True)]


def _whitened(values: Array, inputs: Inputs) -> Array:
    """Residuals (2, N) or sensitivities (2, c, N) with what drifts, or came of a plane unseen, whitened."""
    for i, whitening in enumerate(inputs.whitening):
        if whitening is not None:
            channel = np.atleast_2d(values[i])
            with np.errstate(invalid="ignore", over="ignore"):
                values[i] = inputs.present[i] * whitening.whitened(channel).reshape(values[i].shape)
    return values if inputs.unseen is None else inputs.unseen.whitened(values)


def _innovations(point: Point, runs: list[Run], inputs: list[Inputs]) -> list[tuple[Array, Array]]:
    each = list(zip(_errors(runs, inputs), runs, inputs, strict=True))
    return side_by_side(lambda one: _innovation(point, *one), each)


def _innovation(point: Point, error: Array, run: Run, inputs: Inputs) -> tuple[Array, Array]:
    return error, _whitened(sensitivities(point.parameters, inputs, run), inputs)


def _whitened_by(
    noise: Array, parts: list[tuple[Array, Array]], inputs: list[Inputs]
) -> list[tuple[Array, Array]]:
    """Residuals e and sensitivities S such that S^T e is the score and S^T S the information."""
    scale = np.sqrt(noise[:2])
    with np.errstate(over="ignore", invalid="ignore"):  # what has run away becomes infinite
        white = [(e / scale[:, None], S / scale[:, None, None]) for e, S in parts]
    steps = inputs[0].steps
    for i in np.flatnonzero(steps):
        deviation = _before_rounding(noise[i], steps[i])
        for (error, sensitivity), (e, S), one in zip(parts, white, inputs, strict=True):
            score, information = score_and_information(error[i], steps[i], deviation)
            e[i] = one.present[i] * score / np.sqrt(information)
            S[i] = sensitivity[i] * np.sqrt(information)
    return white


def _deviance(
    noise: Array, parts: list[tuple[Array, Array]], white: list[tuple[Array, Array]], inputs: list[Inputs]
) -> float:
    steps, total = inputs[0].steps, 0.0
    for (error, _), (e, _), one in zip(parts, white, inputs, strict=True):
        for i in range(2):
            if steps[i] == 0.0:
                total += float(np.sum(e[i] ** 2))
            else:
                known = error[i, one.present[i] > 0.0]
                deviation = _before_rounding(noise[i], steps[i])
                total -= 2.0 * float(log_probability(known, steps[i], deviation).sum())
    return total


def _before_rounding(variance: float, step: float) -> float:
    """Deviation of the noise that was rounded."""
    return float(np.sqrt(max(variance - step**2 / 12.0, (LEAST_DEVIATION * step) ** 2)))


def _likeliest_noise(errors: list[Array], inputs: list[Inputs]) -> tuple[Array, float]:
    """Variances (2,) of pitch and depth under which the errors are likeliest, and -log L there."""
    count = sum(one.present.sum(axis=1) for one in inputs)
    with np.errstate(over="ignore", invalid="ignore"):
        squares = np.sum([np.sum(error**2, axis=1) for error in errors], axis=0)
        variance = np.maximum(np.nan_to_num(squares / count, nan=np.inf), SMALLEST_NOISE)
    costs = 0.5 * count * (np.log(variance) + 1.0)
    steps = inputs[0].steps
    for i in np.flatnonzero(steps * (variance < LOST)):
        known = [error[i, one.present[i] > 0.0] for error, one in zip(errors, inputs, strict=True)]
        deviation, costs[i] = likeliest_deviation(np.concatenate(known), steps[i])
        variance[i] = deviation**2 + steps[i] ** 2 / 12.0
    charge = sum(each.charge for one in inputs for each in one.whitening if each is not None)
    return variance, float(np.sum(costs)) + charge
