"""Maximum likelihood where the sensors' white noise is all that is random: the model runs freely.

With residuals e of the free run, and the noise variances R of pitch and depth at their likeliest values,
-log L = 1/2 sum over the channels of count (log R + 1).
"""

import numpy as np

from host.filter_error import whitened_innovations
from host.fit import Fit, finished, run_away
from host.gauss_newton import GaussNewton, Mask, Point, whiten
from host.propagate import Inputs, free_run, innovations
from host.recording import Array

# rad^2, m^2: below any sensor, so that noise-free data divide by no zero
SMALLEST_NOISE = np.array([1e-12, 1e-10])
RUNAWAY = 1e7  # of a sensitivity, in SI: the model leaves the recording exponentially
ANNEALING = (0.1, 0.01, 1e-3, 1e-4)  # s, variance of the unknown force over that of all force


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


def free_run_cost(point: Point, inputs: list[Inputs]) -> float:
    """-log L of the free run at a point, but for a constant; inf where it runs away."""
    cost = _concentrated_cost(_residual_noise(_free_run_errors(point, inputs), inputs), inputs)
    return cost if np.isfinite(cost) else np.inf


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
