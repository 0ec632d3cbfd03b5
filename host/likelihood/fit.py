"""The maximum of the likelihood over recordings, and what it says of its own accuracy."""

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from host.dynamics.equations import Structure
from host.dynamics.propagate import NX0, Inputs
from host.likelihood.gauss_newton import GaussNewton, Mask, Point
from host.recordings.recording import Array

NO_WANDER = np.zeros((3, 2))


class Rival(NamedTuple):
    """Another maximum: its parameters, and the logarithm of its odds against the best, at most 0."""

    parameters: Array
    log_odds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """The maximum of the likelihood over M recordings.

    parameters   (n,) in the order of structure.names
    free         (n,) False where the parameter was held
    information  (n, n) Fisher information of the parameters, initial states eliminated; zero for held ones
    initial      what each recording begins with, host.dynamics.equations.START (5,)
    noise        (4,) variances of pitch rad^2, depth m^2; densities of unknown heave, pitch acceleration,
                 or of what stands for them among waves
    wander       variance and correlation time s of the part of each sensor's error, pitch and depth, that
                 wanders, and of a vertical current (3, 2), see host.noise.drift; zero where there is none
    waves        frequency rad/s and damping ratio, and what else host.likelihood.waves tells of them, (5,);
                 zero where there are none
    deviance     -2 log-likelihood at these noise levels, but for what depends on them alone: the sum of the
                 squared innovations, unless readings are rounded
    rivals       other maxima that are almost as likely
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
    deviance: float
    iterations: int
    converged: bool
    wander: Array = field(default_factory=lambda: NO_WANDER)
    waves: Array = field(default_factory=lambda: np.zeros(5))
    rivals: tuple[Rival, ...] = ()

    @property
    def has_process_noise(self) -> bool:
        return bool(self.noise[2:].any())

    @property
    def end(self) -> Point:
        """Where it ended, under its noise without waves."""
        return Point(self.structure, self.parameters, self.initial, self.noise)

    @property
    def levels(self) -> Array:
        """What a fit that goes on from here starts with: `noise`; in waves (7,) of host.likelihood.waves."""
        return np.concatenate([self.noise[:2], self.waves]) if self.waves.any() else self.noise

    @property
    def has_coloured_noise(self) -> bool:
        return bool(self.wander.any())

    @property
    def relative_wander(self) -> Array:
        """What wanders with its variances in units of the white noise of the sensor it shows in (3, 2)."""
        return np.asarray(self.wander / np.column_stack([self.noise[[0, 1, 1]], np.ones(3)]))

    def with_wander(self, relative: Array) -> "Fit":
        """The same fit, said to have been found beside what wanders so."""
        return replace(self, wander=relative * np.column_stack([self.noise[[0, 1, 1]], np.ones(3)]))

    @property
    def noise_levels(self) -> int:
        """How many numbers describe the noise."""
        if self.has_process_noise:
            return 7 if self.waves.any() else 4
        return 2 + 2 * int(np.count_nonzero(self.wander[:, 0]))

    @property
    def bic(self) -> float:
        """Bayesian information criterion as far as the noise model goes: less is better."""
        return float(self.noise_levels * np.log(self.samples) - 2.0 * self.log_likelihood)

    @property
    def samples(self) -> int:
        """Values measured, pitch and depth together."""
        return sum(int(np.isfinite(e).sum()) for e in self.whitened)


def run_away(point: Point, inputs: list[Inputs], free: Mask) -> Fit:
    """What a start ends as from which the model leaves the numbers: of no likelihood, chosen by nobody.

    Forces are random in it if they were: what goes on from there is of the same kind.
    """
    rows = [one.drive.shape[1] for one in inputs]
    nothing = [(np.zeros((2, count)), np.zeros((2, free.size + NX0, count))) for count in rows]
    noise = np.concatenate([np.ones(2), np.sign(point.noise[2:4])])
    return finished(point.with_noise(noise), nothing, inputs, free, -np.inf, 0, False)


def finished(
    point: Point,
    white: list[tuple[Array, Array]],
    inputs: list[Inputs],
    free: Mask,
    likelihood: float,
    iterations: int,
    converged: bool,
    deviance: float | None = None,
) -> Fit:
    """The fit at a point, from its whitened innovations and sensitivities."""
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
        deviance=sum(float(np.sum(e**2)) for e, _ in white) if deviance is None else deviance,
        iterations=iterations,
        converged=converged,
    )
