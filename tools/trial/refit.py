"""What misfit remains when a vehicle's coefficients are fitted to noise-free truth that hides something."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Model = Callable[[Array], Array]
"""(sets, coefficients) -> (sets, rows): residuals over their noise; not finite where a run fails."""


def remaining(
    model: Model,
    start: Array,
    steps: Array,
    most_iterations: int = 20,
    least: float = 0.0,
    is_dear: bool = False,
) -> float:
    """The least sum of squared residuals, by Levenberg and Marquardt with differences over `steps`.

    Over noise of unit deviation this is the expected gain in chi2 of whoever knows what is hidden. Stops
    early once below `least`.

    is_dear    learn the slopes from each step (Broyden's update) and take differences again only where
               learnt ones no longer lead down
    """
    best = start
    residual = model(best[None, :])[0]
    cost = float(residual @ residual)
    if not np.isfinite(cost):
        return np.inf
    damping = 1e-4
    learnt = False
    slopes = _slopes(model, best, residual, steps)
    for _ in range(most_iterations):
        if not np.isfinite(slopes).all():
            break  # beside a run that fails there is nowhere to go
        scale = np.sqrt(np.sum(slopes**2, axis=1)) + 1e-12
        scaled = slopes / scale[:, None]
        before = cost
        for _ in range(6):
            step = (
                np.linalg.solve(scaled @ scaled.T + damping * np.eye(len(best)), -scaled @ residual) / scale
            )
            tried = model((best + step)[None, :])[0]
            with np.errstate(over="ignore", invalid="ignore"):
                tried_cost = float(tried @ tried)
            if tried_cost < cost:
                if is_dear:
                    share = step * scale**2 / float(step @ (step * scale**2))
                    slopes = slopes + np.outer(share, tried - residual - step @ slopes)
                best, residual, cost = best + step, tried, tried_cost
                damping = max(damping / 10, 1e-9)
                break
            damping *= 10
        if cost < least or (cost > 0.99 * before and not learnt):
            break
        learnt = is_dear and cost < 0.8 * before
        if not learnt:
            slopes = _slopes(model, best, residual, steps)
    return cost


def foretold(model: Model, start: Array, steps: Array, least: float = 0.0) -> float:
    """The same as one step foretells it, were the model linear: for many coefficients and long runs.

    Of what is weak it errs low, as slopes that point the same way may be followed to any length; of what is
    very strong a fit of the equations themselves may leave several times less. Below `least` without any
    step, that is all.
    """
    residual = model(start[None, :])[0]
    cost = float(residual @ residual)
    if not np.isfinite(cost):
        return np.inf
    if cost < least:
        return cost
    slopes = _slopes(model, start, residual, steps)
    if not np.isfinite(slopes).all():
        return np.inf  # beside a run that fails there is nowhere to go
    scaled = slopes / (np.sqrt(np.sum(slopes**2, axis=1)) + 1e-12)[:, None]
    step, *_ = np.linalg.lstsq(scaled.T, residual, rcond=1e-10)
    left = residual - scaled.T @ step
    return float(left @ left)


def _slopes(model: Model, at: Array, residual: Array, steps: Array) -> Array:
    """(coefficients, rows)."""
    return (model(at + np.diag(steps)) - residual) / steps[:, None]
