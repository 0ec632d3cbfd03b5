"""Filter error: maximum likelihood when random forces act, by the innovations of a Kalman filter.

Source: Maine and Iliff, NASA RP-1138; Klein and Morelli, Aircraft System Identification, ch. 6.
"""

import numpy as np

from host.compiled.side_by_side import side_by_side
from host.dynamics.propagate import Inputs
from host.dynamics.sensitivities import innovations
from host.likelihood.ascent import SETTLED, ascend, place
from host.likelihood.fit import Fit, finished, run_away
from host.likelihood.gauss_newton import Mask, Point, whiten
from host.likelihood.kalman import KalmanPass, kalman_pass
from host.recordings.recording import Array


class RandomForces:
    """White forces in heave and pitch; levels: variances of pitch, depth, densities of heave, pitch."""

    least = np.array([1e-12, 1e-10, 1e-16, 1e-16])  # below anything that acts
    most = np.array([1e3, 1e6, 1e3, 1e3])
    signed = np.zeros(4, dtype=bool)

    def __init__(self, inputs: list[Inputs]) -> None:
        self.inputs = inputs

    def passes(self, point: Point) -> list[KalmanPass]:
        """The extended Kalman filter over each recording."""
        each = list(zip(point.initial, self.inputs, strict=True))
        return side_by_side(lambda one: kalman_pass(point.parameters, one[0], point.noise, one[1]), each)

    def whitened(self, point: Point, passes: list[KalmanPass]) -> list[tuple[Array, Array]]:
        """Sensitivities at fixed gain."""
        each = list(zip(passes, point.initial, self.inputs, strict=True))
        return side_by_side(lambda one: _whitened(point, *one), each)


def _whitened(point: Point, run: KalmanPass, initial: Array, inputs: Inputs) -> tuple[Array, Array]:
    error, sensitivity = innovations(point.parameters, initial, inputs, run.gains)
    return whiten(error, sensitivity, run.variance)


def filter_error(start: Fit, inputs: list[Inputs], most_steps: int = 40) -> Fit:
    """Climbs from a fit without forces to the likeliest parameters and noise levels with them."""
    noise = start.noise if start.has_process_noise else _first_noise(start, inputs)
    point = Point(start.structure, start.parameters, start.initial, noise)
    return filter_error_from(point, inputs, start.free, most_steps)


def filter_error_from(
    point: Point,
    inputs: list[Inputs],
    free: Mask,
    most_steps: int = 40,
    holds_noise: bool = False,
    holds_gain: bool = False,
    least: float = -np.inf,
    settled: float = SETTLED,
) -> Fit:
    """The same from any point with forces; or the parameters alone, under these very forces.

    least    a log-likelihood: given up where it would not get there
    settled  of the log-likelihood: a step that gains less is the last
    """
    model = RandomForces(inputs)
    end, used, converged = ascend(point, model, free, most_steps, holds_noise, holds_gain, least, settled)
    if not np.isfinite(end.likelihood):
        return run_away(point, inputs, free)
    white = model.whitened(end.point, end.passes)
    return finished(end.point, white, inputs, free, end.likelihood, used, converged)


def likelihood_under_forces(point: Point, inputs: list[Inputs]) -> float:
    """The log-likelihood at a point with forces; -inf where it leaves the numbers."""
    return place(point, RandomForces(inputs)).likelihood


def whitened_innovations(
    point: Point, inputs: list[Inputs], has_slopes: bool = True
) -> list[tuple[Array, Array]]:
    """The filter's innovations over their deviation (2, N), and their sensitivities at fixed gain.

    has_slopes  or without the sensitivities, (2, 0, N)
    """
    model = RandomForces(inputs)
    passes = model.passes(point)
    if has_slopes:
        return model.whitened(point, passes)
    return [whiten(run.error, np.empty((2, 0, run.error.shape[1])), run.variance) for run in passes]


def whitened_by(
    point: Point, inputs: list[Inputs], passes: list[KalmanPass], states: tuple[str, ...]
) -> list[tuple[Array, Array]]:
    """The same with the gains and variances of another filter, whose `states` are among the point's.

    For equations that differ little, at a fraction of the time: the filter's covariance is most of the work.
    What is driven by the command alone is not corrected, as in the filter itself.
    """
    place = [point.structure.states.index(name) for name in states]
    white = []
    for run, x0, one in zip(passes, point.initial, inputs, strict=True):
        rows = run.gains.shape[1]
        gains = np.zeros((2, len(point.structure.states), rows))
        gains[:, place] = run.gains.reshape((2, len(states), rows))
        error, sensitivity = innovations(point.parameters, x0, one, gains.reshape((-1, rows)))
        white.append(whiten(error, sensitivity, run.variance))
    return white


def _first_noise(start: Fit, inputs: list[Inputs]) -> Array:
    """Half of what output error calls sensor noise may really be force: a neutral place to begin."""
    step = float(np.median(np.concatenate([one.drive[3] for one in inputs])))
    return np.concatenate([start.noise[:2] / 2.0, start.noise[:2][::-1] * step])
