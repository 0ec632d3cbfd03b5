"""Many effects at once by continuation: first the measurements steer the state, at last they only judge it.

The free run of a vehicle that turns broadside, or of one whose equations lack much, soon has nothing to do
with the recording: its likelihood has many maxima, and none of them tells what is missing. Under unknown
forces as large as all that act, a Kalman filter follows the measurements, and the likelihood is nearly that
of a regression, with one maximum. The forces are let go in stages, the coefficients following; what they
still make up for at some stage is shown by what an effect would gain there, and it joins (continuation, or
homotopy: Allgower and Georg, Introduction to Numerical Continuation Methods).
"""

from math import log
from typing import TYPE_CHECKING

import numpy as np

from host.catalogue import named, structure_of
from host.diagnosis.explanation import Explanation, Names
from host.diagnosis.first_guess import first_guess
from host.diagnosis.margins import LITTLE, NAMING_MARGIN
from host.diagnosis.prospects import probed
from host.diagnosis.starts import with_other_moments
from host.filter_error import filter_error_from
from host.gauss_newton import Point
from host.valleys import USUAL_SPEED, plausibility

if TYPE_CHECKING:
    from host.diagnosis.fitter import Fitter
    from host.diagnosis.search import Search

STAGES = tuple(10.0 ** (-k / 2) for k in range(1, 17))
"""Variance of the unknown force over that of all force."""
FOLLOWED = 2  # of the stages, before anything may join
WHERE_ASKED = 0.02  # the share down to which it is asked what gains, although nothing seems to be lacking
CLEARLY = 50.0  # of BIC, that it must gain there
PLACES = 3  # in which an effect that joins begins
STEPS = 10  # of the parameters at each stage
LIKELY = {"restoring_share": 1.0, "kinematics_share": 1.0, "pendulum_share": 1.0}  # sin, cos; a pendulum


def continued(
    search: "Search", names: Names, most_beside: int, asks_early: bool = True
) -> Explanation | None:
    """The set, with at most so many effects more; None where the filter loses the recording.

    asks_early  whether the first stages ask what gains although nothing seems to be lacking: what is large
                shows there before it bends the rest, what is small may be mistaken
    """
    fitter, joined = search.fitter, 0
    starts = [_begun(fitter, names, speed) for speed in _speeds(fitter)]
    ends = [end for start in starts if (end := _followed(fitter, start)) is not None]
    steered = max(ends, key=lambda end: plausibility(end.fit), default=None)
    for share in STAGES[FOLLOWED - 1 :]:
        if steered is None:
            return None
        steered = _steered(fitter, _under(fitter, _at(steered), share))
        while steered is not None and joined < most_beside:
            if _lacks_something(steered):
                steered = _with_moments_moved(fitter, steered)
            is_lacking = _lacks_something(steered)
            if not is_lacking and not (asks_early and share > WHERE_ASKED):
                break
            larger = _larger(search, steered, NAMING_MARGIN if is_lacking else CLEARLY)
            if larger is None:
                break
            steered, joined = larger, joined + 1
    if steered is None:
        return None
    return fitter.explained(steered.names, fitter.fitted([_under(fitter, _at(steered), 0.0)]))


def _speeds(fitter: "Fitter") -> list[float]:
    """Forward speeds, m/s, to begin with: that of the base, which may be bent, and usual ones."""
    if fitter.recordings[0].has_speed:
        return [fitter.speed]
    return [fitter.speed, *(factor * USUAL_SPEED for factor in (0.5, 1.0, 2.0))]


def _followed(fitter: "Fitter", point: Point) -> Explanation | None:
    """Through the first stages, in which the coefficients leave those of the regression."""
    steered = None
    for share in STAGES[:FOLLOWED]:
        steered = _steered(fitter, _under(fitter, point, share))
        if steered is None:
            return None
        point = _at(steered)
    return steered


def _under(fitter: "Fitter", point: Point, share: float) -> Point:
    """The point under this share of all force, with the sensors' noise."""
    forces = [share * acceleration**2 for acceleration in fitter.accelerations]
    return point.with_noise(np.array([*fitter.floor, *forces]))


def _lacks_something(steered: Explanation) -> bool:
    """Whether these forces and the sensors' noise are not enough for what is left."""
    squares = [np.nanmean(np.hstack(steered.fit.whitened)[channel] ** 2) for channel in range(2)]
    return bool(max(squares) > LITTLE)


def _larger(search: "Search", steered: Explanation, least: float) -> Explanation | None:
    """The set with the effect that gains most under these forces, where any gains so much of BIC."""
    fitter, charge = search.fitter, log(steered.fit.samples)
    gains = {
        name: ahead - charge * fitter.free_parameters(frozenset({name}))
        for name, ahead in search.gains(steered).items()
    }
    name = max(gains, key=lambda one: gains[one])
    likely = sorted(probed(fitter, steered, named(name), []), key=lambda pair: -pair[0])
    starts = [fitter.point(steered.names | {name}, steered, name, probe) for _, probe in likely]
    best = _likeliest(fitter, starts[:PLACES], steered)
    return best if best.fit.log_likelihood > steered.fit.log_likelihood + least / 2.0 else None


def _with_moments_moved(fitter: "Fitter", steered: Explanation) -> Explanation:
    """The set with its moments where they are likeliest: as the forces fall, another rest of the plane."""
    return _likeliest(fitter, with_other_moments(fitter, steered), steered)


def _likeliest(fitter: "Fitter", starts: list[Point], steered: Explanation) -> Explanation:
    ends = [end for start in starts if (end := _steered(fitter, start)) is not None]
    return max([steered, *ends], key=lambda end: end.fit.log_likelihood)


def _at(steered: Explanation) -> Point:
    fit = steered.fit
    return Point(fit.structure, fit.parameters, fit.initial, fit.noise)


def _steered(fitter: "Fitter", point: Point) -> Explanation | None:
    """A few steps of the parameters under the point's forces."""
    names = frozenset(effect.name for effect in point.structure.effects)
    inputs = fitter.inputs(names, for_filter=True)
    fit = filter_error_from(point, inputs, fitter.free(names), STEPS, holds_noise=True)
    return fitter.explained(names, fit) if np.isfinite(fit.log_likelihood) else None


def _begun(fitter: "Fitter", names: Names, speed: float) -> Point:
    """The values of a regression at this speed, those of most vehicles, or none: no set is needed."""
    structure, root = structure_of(names), fitter.root.fit
    rough = first_guess(fitter.thinned, speed, names)
    values = dict(zip(root.structure.names, root.parameters.tolist(), strict=True))
    for effect in structure.effects:
        for parameter, probe in zip(effect.parameters, effect.probes[0], strict=True):
            is_size = parameter.name in effect.size_names
            values.setdefault(parameter.name, LIKELY.get(parameter.name, 0.0 if is_size else probe))
    values |= {name: value for name, value in (rough | fitter.held).items() if name in values}
    start = structure.clipped(np.array([values[name] for name in structure.names]))
    return Point(structure, start, root.initial, root.levels)
