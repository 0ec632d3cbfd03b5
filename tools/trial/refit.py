"""What misfit remains when a vehicle's coefficients are fitted to noise-free truth that hides something."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Model = Callable[[Array], Array]
"""(sets, coefficients) -> (sets, rows): residuals over their noise; not finite where a run fails."""


def remaining(
    model: Model, start: Array, steps: Array, most_iterations: int = 20, least: float = 0.0
) -> float:
    """The least sum of squared residuals, by Levenberg and Marquardt with differences over `steps`.

    Over noise of unit deviation this is the expected gain in chi2 of whoever knows what is hidden. Stops
    early once below `least`.
    """
    best = start
    residual = model(best[None, :])[0]
    cost = float(residual @ residual)
    if not np.isfinite(cost):
        return np.inf
    damping = 1e-4
    for _ in range(most_iterations):
        slopes = (model(best + np.diag(steps)) - residual) / steps[:, None]
        scale = np.sqrt(np.sum(slopes**2, axis=1)) + 1e-12
        normal = (slopes / scale[:, None]) @ (slopes / scale[:, None]).T
        gradient = (slopes / scale[:, None]) @ residual
        before = cost
        for _ in range(6):
            change = np.linalg.solve(normal + damping * np.eye(len(best)), -gradient) / scale
            tried = model((best + change)[None, :])[0]
            with np.errstate(over="ignore", invalid="ignore"):
                tried_cost = float(tried @ tried)
            if tried_cost < cost:
                best, residual, cost = best + change, tried, tried_cost
                damping = max(damping / 10, 1e-9)
                break
            damping *= 10
        if cost < least or cost > 0.99 * before:
            break
    return cost
