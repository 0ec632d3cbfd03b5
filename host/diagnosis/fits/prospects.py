"""What an effect could gain beside others, one Gauss-Newton step ahead, and from which start values."""

from dataclasses import replace
from math import log
from typing import TYPE_CHECKING

import numpy as np

from host.catalogue import named, structure_of
from host.catalogue.moments import COUNT, FIRST, LAST, SCANS, sizes
from host.catalogue.unknown import ANY_SMOOTH_FORCE, SHAPES
from host.diagnosis.fits.explanation import Explanation
from host.dynamics.equations import Effect
from host.dynamics.propagate import Inputs
from host.likelihood.filter_error import RandomForces, whitened_by, whitened_innovations
from host.likelihood.fit import Fit
from host.likelihood.gauss_newton import GaussNewton, Point
from host.likelihood.kalman import KalmanPass
from host.likelihood.output_error import diverges, residuals_at
from host.likelihood.waves import passes_in_waves, whitened_in_waves
from host.recordings.recording import Array

if TYPE_CHECKING:
    from host.diagnosis.fits.fitter import Fitter

LINES_TRIED = 3
MOMENTS_TRIED = 3
SLIGHT = 1e-9  # damping of a step that is as good as full


def gain(fitter: "Fitter", parent: Explanation, name: str, values: list[Array], is_thorough: bool) -> float:
    """Twice the log-likelihood an effect could gain on top of the parent: one Gauss-Newton step ahead.

    From `values` alone, or where these are none or it is to be thorough, from its own probes, too. So always
    of the plane, whose limits, play and lag show only near their own size: alone they took on that of others.
    """
    effect = named(name)
    is_thorough |= not values or effect.slot == "actuator"
    return max(ahead for ahead, _ in probed(fitter, parent, effect, values, is_thorough))


def form_gains(fitter: "Fitter", parent: Explanation) -> dict[str, float]:
    """What each form of unknown physics could take off the BIC on top of the parent, predicted.

    Those of the motion share the sensitivities of one propagation with all of them at zero; those of the
    plane are a force and a moment in the proportion in which it makes them.
    """
    names = parent.names | {ANY_SMOOTH_FORCE.name}
    structure, inputs = structure_of(names), fitter.inputs(names, parent.fit.has_process_noise)
    point = fitter.point(names, parent, ANY_SMOOTH_FORCE.name, np.zeros(len(ANY_SMOOTH_FORCE.parameters)))
    white, cost = whitened_at(point, inputs, parent)
    own, any_smooth = np.array(structure.names), [p.name for p in ANY_SMOOTH_FORCE.parameters]
    free = fitter.free(names) & ~np.isin(own, any_smooth)
    before, charge = parent.fit.deviance, log(parent.fit.samples)
    gains = {}
    for form in fitter.forms:
        if form.name in parent.names:
            continue
        kind, _, shape = form.parameters[0].name.partition("_")
        if shape in SHAPES:
            seen = _of_plane(white, point, shape) if kind == "plane" else white
            side = "heave" if kind == "plane" else kind
            with_it = free | (own == f"any_{side}_{shape}")
            is_lost = not np.isfinite(cost)
            ahead = -np.inf if is_lost else before - GaussNewton(seen, point, with_it).predicted_cost(cost)
        else:
            ahead = gain(fitter, parent, form.name, [], is_thorough=True)
        gains[form.name] = ahead - charge * fitter.free_parameters(frozenset({form.name}))
    return gains


def _of_plane(white: list[tuple[Array, Array]], point: Point, shape: str) -> list[tuple[Array, Array]]:
    """Sensitivities to a form in heave replaced by those to the same form of the plane."""
    names = point.structure.names
    b1, b2 = (point.parameters[names.index(name)] for name in ("b1", "b2"))
    heave, pitch = (names.index(f"any_{side}_{shape}") for side in ("heave", "pitch"))
    moved = [S.copy() for _, S in white]
    for S in moved:
        S[:, heave] = b1 * S[:, heave] + b2 * S[:, pitch]
    return [(e, S) for (e, _), S in zip(white, moved, strict=True)]


def probed(
    fitter: "Fitter", parent: Explanation, effect: Effect, values: list[Array], is_thorough: bool = True
) -> list[tuple[float, Array]]:
    """Predicted gain and start values of an effect, for each of its probes.

    An oscillation is linear in its sizes: it sets out from none, and starts with those that suit its period.
    """
    names = parent.names | {effect.name}
    inputs, free = fitter.inputs(names, parent.fit.has_process_noise), fitter.free(names)
    before = parent.fit.deviance
    found, steering = [], _steering(fitter, parent, effect)
    for probe in [*values, *(_probes(fitter, effect, parent, steering) if is_thorough else [])]:
        point = fitter.point(names, parent, effect.name, probe)
        own = np.array(point.structure.names)
        white, cost = whitened_at(point, inputs, parent, steering=steering)
        if not np.isfinite(cost):
            found.append((-np.inf, probe))
            continue
        has_no_size = effect.periods is not None and not probe[:-1].any()
        step = GaussNewton(white, point, free & (own != effect.parameters[-1].name) if has_no_size else free)
        found.append((before - step.predicted_cost(cost), probe))
        if has_no_size:
            reached = dict(zip(own, step.trial(SLIGHT).parameters, strict=True))
            found[-1] = found[-1][0], np.array([reached[each.name] for each in effect.parameters])
    return found


def _steering(fitter: "Fitter", parent: Explanation, effect: Effect) -> list[KalmanPass] | None:
    """The parent's filter, if it has one that does for the set with the effect as well, which is new to all.

    A lag of a sensor or a speed that is lost is a state that measurements correct.
    """
    fit = parent.fit
    is_corrected = effect.state is not None and effect.actuator is None
    if is_corrected or not fit.has_process_noise:
        return None
    point = Point(fit.structure, fit.parameters, fit.initial, fit.levels)
    inputs = fitter.inputs(parent.names, for_filter=True)
    return passes_in_waves(point, inputs) if fit.waves.any() else RandomForces(inputs).passes(point)


def whitened_at(
    point: Point,
    inputs: list[Inputs],
    parent: Explanation,
    has_slopes: bool = True,
    steering: list[KalmanPass] | None = None,
) -> tuple[list[tuple[Array, Array]], float]:
    """Innovations and sensitivities under the parent's noise, and the deviance: inf if lost.

    has_slopes  or without the sensitivities, where those of a point nearby will do; not in waves
    steering    the parent's filter, where its gains do
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        if parent.fit.waves.any():
            white = whitened_in_waves(point, inputs, steering, parent.fit.structure.states)
        elif steering is not None:
            white = whitened_by(point, inputs, steering, parent.fit.structure.states)
        elif parent.fit.has_process_noise:
            white = whitened_innovations(point, inputs, has_slopes)
        else:
            white, deviance = residuals_at(point, inputs, has_slopes)
        if parent.fit.has_process_noise:
            deviance = sum(float(np.sum(e**2)) for e, _ in white)
        return white, np.inf if diverges(white, inputs, 1e3) else deviance


def _probes(
    fitter: "Fitter", effect: Effect, parent: Explanation, steering: list[KalmanPass] | None
) -> list[Array]:
    scales = np.array([fitter.scales[scale] for scale in effect.scales or ("",) * len(effect.parameters)])
    probes = [np.array(probe) * scales for probe in effect.probes]
    if effect.periods is not None:
        # The start values' last entry is a period, and it must be nearly right.
        probes = [
            np.array([*probes[0][:-1], period]) for period in _periods(fitter, effect.periods, parent.fit)
        ]
    if effect.name in SCANS:
        when = effect.scales.index("duration")
        probes = [
            np.array([*probe[:when], moment, *probe[when + 1 :]])
            for moment in _moments(fitter, effect.name, parent, steering)
            for probe in probes
        ]
    if effect.force is not None and len(effect.size_names) == len(effect.parameters):
        # Linear in its sizes, a force is foretold best from none; far off, readings in steps mislead.
        probes.append(np.zeros(len(effect.parameters)))
    return probes


def _moments(
    fitter: "Fitter", name: str, parent: Explanation, steering: list[KalmanPass] | None
) -> list[float]:
    """The times, s, at which a change of this kind would gain most on top of the parent, the best first."""
    first, last = fitter.held[FIRST], fitter.held[LAST]
    coarse = _scanned(fitter, name, parent, steering, first, last)
    apart = (last - first) / (COUNT + 1)
    fine = _scanned(fitter, name, parent, steering, coarse[0] - apart, coarse[0] + apart)
    return [fine[0], *coarse[1:MOMENTS_TRIED]]


def _scanned(
    fitter: "Fitter",
    name: str,
    parent: Explanation,
    steering: list[KalmanPass] | None,
    first: float,
    last: float,
) -> list[float]:
    """The best of the moments between two times, of those side by side only the better."""
    scan = SCANS[name]
    names = parent.names | {scan.name}
    point = fitter.point(names, parent, scan.name, np.zeros(len(scan.parameters)))
    own = np.array(point.structure.names)
    limits = np.where(own == FIRST, first, np.where(own == LAST, last, point.parameters))
    point = replace(point, parameters=limits)
    inputs = fitter.inputs(names, parent.fit.has_process_noise)
    white, cost = whitened_at(point, inputs, parent, steering=steering)
    times = first + (last - first) * np.arange(1, COUNT + 1) / (COUNT + 1)
    if not np.isfinite(cost):
        return [float(time) for time in times[COUNT // 6 :: COUNT // 6]]
    others = fitter.free(names) & ~np.isin(own, sizes(name))
    steps = (GaussNewton(white, point, others | (own == size)) for size in sizes(name))
    left = np.array([step.predicted_cost(cost) for step in steps])
    beside = np.concatenate([[np.inf], left, [np.inf]])
    dips = np.flatnonzero((left <= beside[:-2]) & (left <= beside[2:]))
    return [float(times[k]) for k in dips[np.argsort(left[dips])]]


def _periods(fitter: "Fitter", limits: tuple[float, float], fit: Fit) -> list[float]:
    """The strongest periods in what the longest recording leaves, pitch and depth together, s."""
    longest = max(range(len(fitter.recordings)), key=lambda k: fitter.recordings[k].duration)
    step, residual = fitter.recordings[longest].step, fit.whitened[longest]
    filled = np.where(np.isfinite(residual), residual - np.nanmean(residual, axis=1, keepdims=True), 0.0)
    rows = 4 * filled.shape[1]  # padded fourfold, as phases drift over the whole span
    frequencies = np.fft.rfftfreq(rows, step)[1:]
    size = np.linalg.norm(np.fft.rfft(filled, rows), axis=0)[1:]
    span = step * filled.shape[1]
    inside = (frequencies >= 1.0 / min(limits[1], 1.5 * span)) & (frequencies <= 1.0 / limits[0])
    # What is slower than the recording is long has no line of its own, and the base bends to it.
    periods = [share * span for share in (0.3, 0.7) if limits[0] < share * span < limits[1]]
    lines: list[float] = []
    for k in np.flatnonzero(inside)[np.argsort(-size[inside])]:
        if all(abs(frequencies[k] - line) > 1.0 / span for line in lines):
            lines.append(float(frequencies[k]))
        if len(lines) == LINES_TRIED:
            break
    return [*(1.0 / line for line in lines), *periods] or [limits[0]]
