"""Maximum-likelihood identification: output error, and filter error when unknown forces act.

Minimises -log L = 1/2 sum_k [log det S_k + e_k^T S_k^-1 e_k] over the parameters, the initial state of each
recording and the noise levels. In output error (host.likelihood.output_error) the model runs freely and S is
the sensors' noise; in filter error (host.likelihood.filter_error, host.likelihood.waves) a Kalman filter
gives e and S; where the sensors' errors wander, a filter in each sensor does
(host.likelihood.coloured_noise). Source: Maine and Iliff, NASA RP-1138; Klein and Morelli, Aircraft System
Identification, ch. 6.
"""

from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np

from host.dynamics.equations import BASE, Structure
from host.dynamics.propagate import Inputs, inputs_of
from host.likelihood.coloured_noise import coloured_noise
from host.likelihood.filter_error import filter_error
from host.likelihood.fit import Fit
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import SMALLEST_NOISE, output_error
from host.likelihood.start_values import start_values
from host.likelihood.valleys import are_apart, other_valleys, plausibility, with_rivals
from host.likelihood.waves import in_waves, in_waves_from, is_sea
from host.noise.drift import whitenings
from host.noise.noise_floor import noise_floor, resolution
from host.noise.speed_error import speed_errors
from host.noise.whiteness import is_white
from host.recordings.recording import Array, Recording, mean_speed
from host.recordings.rounding import thinned

NoiseModel = Literal["auto", "output_error", "filter_error"]
Start = tuple[Array, list[Array]]

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
        held["u0"] = mean_speed(recordings)
    free = np.array([name not in held for name in structure.names])
    floor = noise_floor(recordings)
    errors, steps = speed_errors(recordings, floor[1], resolution(recordings))
    told = thinned(recordings, steps)
    inputs = [
        inputs_of(recording, structure, steps=steps, whitening=whitenings(None, error))
        for recording, error in zip(told, errors, strict=True)
    ]
    if starts is None:
        own = [value for effect in structure.effects for value in effect.probes[0]]
        starts = [(np.concatenate([base, own]), initial) for base, initial in start_values(recordings)]
    candidates = []
    for parameters, initial in starts:
        parameters = structure.clipped(parameters)
        for name, value in held.items():
            parameters[structure.names.index(name)] = value
        on_progress("output error")
        candidates.append(output_error(Point(structure, parameters, initial, np.zeros(4)), inputs, free))
    best = max(candidates, key=plausibility)
    on_progress("other valleys")
    candidates += other_valleys(best, inputs)
    best = max(candidates, key=plausibility)
    others = [fit for fit in candidates if fit is not best]
    nothing_left = all(is_white(e) for e in best.whitened) or bool((best.noise[:2] < NOISE_FREE).all())
    if noise_model == "output_error" or (noise_model == "auto" and nothing_left):
        return with_rivals(best, others)
    on_progress("random forces, wandering sensors, waves")
    plain, rows = best, zip(thinned(recordings), errors, strict=True)
    inputs = [inputs_of(r, structure, whitening=whitenings(None, error)) for r, error in rows]
    if steps.any():  # a filter takes errors for normal: it is compared with a free run that does, too
        start = Point(structure, best.parameters, best.initial, best.noise)
        plain = output_error(start, inputs, free)
    if noise_model == "filter_error":
        chosen = filter_error(plain, inputs)
    else:
        chosen = plain
        for fit in _noise_models(plain, inputs):
            chosen = min(chosen, fit, key=lambda fit: fit.bic)
            if chosen is fit and all(is_white(e) for e in fit.whitened):
                break
    if chosen is plain:
        return with_rivals(best, others)
    near = [fit for fit in others if fit.log_likelihood > best.log_likelihood - NEAR * best.samples]
    return with_rivals(chosen, [_like(chosen, fit, inputs) for fit in near if are_apart(fit, best)])


def _noise_models(start: Fit, inputs: list[Inputs]) -> Iterator[Fit]:
    """The fits that explain coloured residuals, the likelier and cheaper kinds first."""
    filtered = filter_error(start, inputs)
    yield filtered
    yield coloured_noise(start, inputs)
    if filtered.bic < start.bic and is_sea(waves := in_waves(filtered, inputs)):
        yield waves


def _like(chosen: Fit, start: Fit, inputs: list[Inputs]) -> Fit:
    """Another end under the noise model that was chosen."""
    if chosen.waves.any():
        point = Point(start.structure, start.parameters, start.initial, chosen.levels)
        return in_waves_from(point, inputs, start.free, holds_noise=True)
    if chosen.has_process_noise:
        return filter_error(start, inputs)
    return coloured_noise(start, inputs) if chosen.has_coloured_noise else start
