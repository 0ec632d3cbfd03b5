"""Where the fit of a set begins: from a parent with one effect less, and from what needs no parent.

A search ends in the valley in which it begins, and a parent that lacks an effect may be bent far from the
truth to make up for it. So a set begins from several places, goes a few steps from each and on from the best.
"""

from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from host.catalogue import named, structure_of
from host.catalogue.kin import AS_A_LEVER, measure_alike
from host.catalogue.moments import FIRST, LAST
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.first_guess import first_guess
from host.diagnosis.fits.margins import LARGEST_SET
from host.diagnosis.fits.prospects import probed, whitened_at
from host.dynamics.propagate import Inputs
from host.likelihood.gauss_newton import GaussNewton, Mask, Point
from host.likelihood.output_error import annealed
from host.likelihood.valleys import A2, A3, B2, SHARING_POLES, has_usual_heave, look_alikes, with_usual_heave
from host.recordings.recording import Array

if TYPE_CHECKING:
    from host.diagnosis.fits.fitter import Fitter

FAR = 5.0  # times the noise floor: a base bent so far may sit in another valley than the truth
SCANS_OF_A_MOMENT = (24, 96)  # times, the second between the neighbours of the best
NEAR_A_MOMENT, NEARBY = 0.06, (40, 9)  # of the recording to either side; places there, and beside the best
CLEARLY = 4.0  # of a deviance: more than rounding
FEW = 1  # members of a set, the free trim among them, that lacks the most
LIKELY = {"restoring_share": 1.0, "kinematics_share": 1.0, "pendulum_share": 1.0}  # sin, cos; a pendulum
SLUGGISH, USUAL_PITCH_DAMPING = -0.3, -3.0  # 1/s, of a2: a base that lacks a slow plane is a slow hull


def starts_of(
    fitter: "Fitter", parent: Explanation, name: str, values: list[Array], rival: Explanation | None
) -> list[Point]:
    """Starts of the parent's set with one effect more, the most promising first; see Fitter.grown."""
    likely = sorted(probed(fitter, parent, named(name), values), key=lambda pair: -pair[0])
    del likely[1 if len(parent.names) >= LARGEST_SET else 2 :]  # fits of large sets cost most
    names = parent.names | {name}
    starts = [fitter.point(names, parent, name, probe) for _, probe in likely]
    if rival is not None:
        probes = [probe for _, probe in likely] + _same_size(fitter, rival, parent, name)
        starts += [fitter.point(names, rival, name, probe) for probe in probes]
        return starts + _with_depth_moved_alike(fitter, rival, parent, name)
    guesses = [guess(fitter, starts[0], names)] if may_be_bent(fitter, parent) else []
    if is_far(fitter, parent):
        del starts[1:]
    if not has_usual_heave(starts[0]):
        starts += [usual for start in starts for usual in with_usual_heave(start)]
    return starts + guesses


def starts_again(
    fitter: "Fitter", parent: Explanation, name: str, values: list[Array], end: Explanation
) -> list[Point]:
    """Starts of the same set where the end of its first fit may lie in a poor valley.

    Points of much the same motion, or with the heave or the pitch of a usual vehicle, or with other moments.
    A parent that lacks what joins may have put its poles in each other's place: that is asked of its set,
    too, where much is left.
    """
    at = end.fit.end
    sharing = at.structure.names if is_far(fitter, end) else (named(name).parameters[0].name,)
    starts = look_alikes(at) if {*SHARING_POLES} & {*sharing} else []
    if not has_usual_heave(at):
        starts += with_usual_heave(at)
    return starts + with_usual_pitch(fitter, parent, name, values) + with_other_moments(fitter, end)


def idle(start: Point, name: str) -> Point:
    """A start at which the effect does not act yet, as near as its bounds allow."""
    values = np.where(np.isin(start.structure.names, named(name).size_names), 0.0, start.parameters)
    return replace(start, parameters=start.structure.clipped(values))


def idle_values(fitter: "Fitter", names: Names, known: dict[str, float]) -> Array:
    """Values of a set's parameters: the known ones; else sizes of none, or usual ones, and probes."""
    structure, values = structure_of(names), dict(known)
    for effect in structure.effects:
        for parameter, probe in zip(effect.parameters, effect.probes[0], strict=True):
            is_size = parameter.name in effect.size_names
            values.setdefault(parameter.name, LIKELY.get(parameter.name, 0.0 if is_size else probe))
    values |= {name: value for name, value in fitter.held_in(names).items() if name in values}
    return structure.clipped(np.array([values[name] for name in structure.names]))


def begun_beside(fitter: "Fitter", at: Point, names: Names) -> Point:
    """A start of a larger set at a point of a smaller one: what joins hardly acts there yet."""
    known = dict(zip(at.structure.names, at.parameters.tolist(), strict=True))
    return Point(structure_of(names), idle_values(fitter, names, known), at.initial, at.noise)


def begun_from(fitter: "Fitter", found: Explanation, names: Names) -> Point:
    """The same where a smaller set ended, under its noise."""
    fit = found.fit
    return begun_beside(fitter, Point(fit.structure, fit.parameters, fit.initial, fit.levels), names)


def scanned(fitter: "Fitter", start: Point) -> Point:
    """The start with each of its moments where the recordings are likeliest, all else held.

    A moment that lay between the stretches an explanation was fitted to may lie anywhere between them, and of
    its likelihood, which has many maxima, none is seen from far.
    """
    names = start.structure.effect_names
    own, free = start.structure.names, fitter.free(names)
    for k in (k for k, name in enumerate(own) if name in start.structure.moments and free[k]):
        first, last = fitter.held[FIRST], fitter.held[LAST]
        for count in SCANS_OF_A_MOMENT:
            apart = (last - first) / (count + 1)
            times = [start.parameters[k], *(first + apart * np.arange(1, count + 1))]
            tried = [_with_value(start, k, float(time)) for time in times]
            start = max(tried, key=fitter.likelihood)
            first, last = start.parameters[k] - apart, start.parameters[k] + apart
    return start


def with_other_moments(fitter: "Fitter", end: Explanation) -> list[Point]:
    """For each moment of a fit the likeliest near it, all else one step ahead, where likelier than its end.

    Where the plane moves much a moment has a maximum in every rest of it.
    """
    fit, inputs = end.fit, fitter.inputs(end.names)
    at = Point(fit.structure, fit.parameters, fit.initial, fit.levels)
    starts = []
    for k, name in enumerate(fit.structure.names):
        if name not in fit.structure.moments or not fit.free[k]:
            continue
        others = fit.free & (np.arange(fit.free.size) != k)
        best, least, reach = at, inf, NEAR_A_MOMENT * (fitter.held[LAST] - fitter.held[FIRST])
        for count in NEARBY:
            shifts = np.linspace(-reach, reach, count)
            near = [_with_value(best, k, best.parameters[k] + shift) for shift in shifts]
            foretold = _foretold(near, best, others, inputs, end)
            nearest = int(np.argmin(foretold))
            best, least, reach = near[nearest], foretold[nearest], 2.0 * reach / count
        if least < fit.deviance - CLEARLY:
            starts.append(best)
    return starts


def _foretold(
    points: list[Point], among: Point, others: Mask, inputs: list[Inputs], end: Explanation
) -> list[float]:
    """The deviance at each point, all else one step ahead with the sensitivities of one among them."""
    slopes, cost = whitened_at(among, inputs, end)
    if not np.isfinite(cost):
        return [inf] * len(points)
    costs = []
    for point in points:
        white, cost = whitened_at(point, inputs, end, has_slopes=False)
        seen = [(error, S) for (error, _), (_, S) in zip(white, slopes, strict=True)]
        costs.append(GaussNewton(seen, point, others).predicted_cost(cost) if np.isfinite(cost) else inf)
    return costs


def _with_value(point: Point, k: int, value: float) -> Point:
    parameters = point.parameters.copy()
    parameters[k] = value
    return replace(point, parameters=point.structure.clipped(parameters))


def is_far(fitter: "Fitter", parent: Explanation) -> bool:
    """Whether a set leaves much."""
    return fitter.excess(parent.fit) > FAR


def may_be_bent(fitter: "Fitter", parent: Explanation) -> bool:
    """Whether the coefficients of a parent may have gone far to make up for what it lacks."""
    return not parent.fit.has_process_noise and (len(parent.names) <= FEW or is_far(fitter, parent))


def guess(fitter: "Fitter", start: Point, names: Names) -> Point:
    """The rough values of regression where it gives some, `start` elsewhere, moved into their valley."""
    rough = first_guess(fitter.thinned, fitter.speed, names)
    rough = {name: value for name, value in rough.items() if name not in fitter.held_in(names)}
    own = zip(start.structure.names, start.parameters, strict=True)
    values = np.array([rough.get(name, value) for name, value in own])
    point = Point(start.structure, values, start.initial, np.array([*fitter.floor, 0.0, 0.0]))
    return annealed(point, fitter.inputs(names, for_filter=True), fitter.free(names), fitter.accelerations)


def with_usual_pitch(fitter: "Fitter", parent: Explanation, name: str, values: list[Array]) -> list[Point]:
    """Starts of a set with the pitch damping of a usual vehicle, where a bent parent is a sluggish one.

    It turns as much in the end. What a sluggish hull promises of an effect does not choose between probes.
    """
    a2 = parent.fit.parameters[A2]
    if not (may_be_bent(fitter, parent) and a2 > SLUGGISH):
        return []
    starts = []
    for _, probe in probed(fitter, parent, named(name), values):
        start = fitter.point(parent.names | {name}, parent, name, probe)
        parameters = start.parameters.copy()
        parameters[[A2, A3, B2]] *= USUAL_PITCH_DAMPING / a2
        start = replace(start, parameters=start.structure.clipped(parameters))
        starts += [start] if has_usual_heave(start) else with_usual_heave(start)[:1]
    return starts


def _same_size(fitter: "Fitter", rival: Explanation, parent: Explanation, name: str) -> list[Array]:
    """A start of an effect where the one that the rival has in its place ended, if these measure alike.

    Of two limits of the plane each is blind but near the right angle.
    """
    (other,) = rival.names - parent.names
    effect, its = named(name), named(other)
    if not measure_alike(effect, its):
        return []
    value = rival.fit.parameters[rival.fit.structure.names.index(its.parameters[0].name)]
    scales = [fitter.scales[scale] for scale in (effect.scales or ("",) * len(effect.parameters))]
    return [np.array([value, *(np.array(effect.probes[0]) * scales)[1:]])]


def _with_depth_moved_alike(
    fitter: "Fitter", rival: Explanation, parent: Explanation, name: str
) -> list[Point]:
    """The start at which a lever arm of the depth sensor stands for what q' does to heave, or the other way.

    A sensor x ahead moves by w_s = w - x q, which follows the equations of w and q themselves with

        c_wa = -x,    c_wq + a1 x,    a2 + c_qw x

    in the place of c_wq and a2: far from where either is none.
    """
    (other,) = rival.names - parent.names
    if {name, other} != {*AS_A_LEVER}:
        return []
    known = dict(zip(rival.fit.structure.names, rival.fit.parameters.tolist(), strict=True))
    size = known[AS_A_LEVER[other]]
    start = fitter.point(parent.names | {name}, rival, name, np.array([-size]))
    beside = {"c_wq": known["a1"] * size, "a2": known.get("c_qw", 0.0) * size}
    moved = [beside.get(own, 0.0) for own in start.structure.names]
    return [replace(start, parameters=start.structure.clipped(start.parameters + moved))]
