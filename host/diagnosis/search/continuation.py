"""Many effects at once by continuation: first the measurements steer the state, at last they only judge it.

The free run of a vehicle that turns broadside, or of one whose equations lack much, soon has nothing to do
with the recording: its likelihood has many maxima, and none of them tells what is missing. Under unknown
forces as large as all that act, a Kalman filter follows the measurements, and the likelihood is nearly that
of a regression, with one maximum. The forces are let go in stages, the coefficients following; what they
still make up for at some stage is shown by what an effect would gain there, and it joins (continuation, or
homotopy: Allgower and Georg, Introduction to Numerical Continuation Methods). What is large would bend the
rest before it seems to be lacking, so the first stage is asked at once; and two ends are followed, as what
seems to be lacking later may be the other one.
"""

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from host.catalogue import ALONG_THE_HULL, named, structure_of
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.first_guess import first_guess
from host.diagnosis.fits.margins import LITTLE, NAMING_MARGIN
from host.diagnosis.fits.patience import is_over
from host.diagnosis.fits.prospects import gain, probed
from host.diagnosis.fits.starts import idle_values, with_other_moments
from host.diagnosis.search.candidates import candidates
from host.dynamics.equations import NAMES
from host.likelihood.ascent import SETTLED
from host.likelihood.filter_error import filter_error_from
from host.likelihood.gauss_newton import Point
from host.likelihood.valleys import USUAL_SPEED, with_poles_swapped

if TYPE_CHECKING:
    from host.diagnosis.fits.fitter import Fitter
    from host.diagnosis.search.search import Search

STAGES = tuple(10.0 ** (-k / 2) for k in range(1, 17))
"""Variance of the unknown force over that of all force."""
UNDECIDED = 4  # stages, through which sets with an effect that gains at the first are followed side by side
FOLLOWED = 2  # sets, or ends of one set, from then on: that one sits in a side valley shows late
SAME_END, SAME_SPEED = 3.0, 0.05  # of BIC, and of the speed, between two fits of a set
CLEARLY = 50.0  # of BIC, that each must gain by then and at the end, where nothing seems to be lacking
PROMISING, MOST_PROMISING = 2, 3  # effects that are tried where one may join, and at the first stage
PLACES = 2  # in which each of them begins
REGAINED = 0.3  # of what the last stages lost, by an effect that may join
FAR_MORE = 3.0  # times what was left when no effect helped: fewer forces make up for less
SLIGHTLY = 1.05  # times the variance expected: enough for another look at the moments
FEW_STEPS, STEPS = 10, 40  # of the parameters at one stage: many lie along a ridge, where a stage is slow
SPEED = NAMES.index("u0")
Values = Mapping[str, float]
APPARENT = ("pitch_bias", "vertical_current")
"""What no free trim does where heave is not linear, nor shows at one step from a set bent without them."""
BEHIND = 0.1  # of BIC a sample, to the best of the same stage, or of all stages: it leads nowhere
ROUGHLY = 0.3  # of the log-likelihood: under slight forces, which takes longest, a smaller step is the last


def continued(
    search: "Search", names: Names, most_beside: int, known: Values | None = None
) -> Explanation | None:
    """The set beside a bias and a current, with drag along the hull or not, and at most so many effects more.

    None where the filter loses the recording, or where it takes too long.

    known  values with which parameters of its effects begin
    """
    names |= {*APPARENT}
    fitter, common = search.fitter, names | {ALONG_THE_HULL}
    followed = _with_what_is_large(search, names, known or {})
    swapped = [at for one in followed for at in with_poles_swapped(one.fit.end)]
    most, most_lost = LITTLE, NAMING_MARGIN  # without another look at what is lacking
    least = inf  # BIC so far: the true physics gets likelier with every stage
    for share in STAGES[UNDECIDED:]:
        others = _steered(search, [_forced(fitter, at, share) for at in swapped])
        others = _under(search, [one for one in others if _is_near(one, followed[0])], share, STEPS)
        followed = _distinct([*_under(search, followed, share, STEPS), *others])[:FOLLOWED]
        followed = [one for one in followed if _is_near(one, followed[0])]
        followed, swapped = _moved(search, followed), []
        while followed and len(followed[0].names - common) < most_beside:
            left, lost = _left(followed[0]), followed[0].bic - least
            if left < most and lost < most_lost:
                break
            larger = _best_of_each(_larger(search, followed[0], PROMISING))[:1]
            if not larger or larger[0].bic > followed[0].bic - max(NAMING_MARGIN, REGAINED * lost):
                most, most_lost = FAR_MORE * left, max(most_lost, FAR_MORE * lost)
                break
            most, most_lost = LITTLE, NAMING_MARGIN
            followed = [*_moved(search, larger), *followed][:FOLLOWED]
        if not followed or is_over():
            return None
        least = min(least, followed[0].bic)
        likeliest = _kept(search, followed)
        if not _is_near(followed[0], likeliest):
            break
    best = min(followed, key=_charged)
    return fitter.explained(best.names, fitter.fitted([_forced(fitter, best.fit.end, 0.0)]))


def _kept(search: "Search", followed: list[Explanation]) -> Explanation:
    """The likeliest of all stages: of a hull that is unstable, none of the last is."""
    known = [] if search.steered is None else [search.steered]
    search.steered = min([*known, *followed], key=lambda one: one.bic)
    return search.steered


def _with_what_is_large(search: "Search", names: Names, known: Values) -> list[Explanation]:
    """The set through the first stages, or with an effect that shows there, before it bends the rest.

    The speed that is likeliest without an effect may be one that does its work, so it is asked from all of
    them what gains; and until fewer forces are there another effect may gain more than the one at work.
    """
    fitter = search.fitter
    begun = [_begun(fitter, names, speed, known) for speed in _speeds(fitter)]
    plain = _distinct(_steered(search, [_forced(fitter, point, STAGES[0]) for point in begun]))
    along = _distinct(_steered(search, [at for one in plain for at in _starts(search, one, ALONG_THE_HULL)]))
    followed = [*plain, *along]
    for parents in (plain, _best_of_each(along)):
        larger = [end for parent in parents for end in _larger(search, parent, MOST_PROMISING)]
        kept = {one.names for one in _best_of_each(larger)[:MOST_PROMISING]}
        followed += _distinct([one for one in larger if one.names in kept])
    for share in STAGES[1:UNDECIDED]:
        followed = sorted(_distinct(_under(search, followed, share)), key=_charged)
        followed = followed[: max(FOLLOWED, len(followed) // 2)]
    return followed[:FOLLOWED]


def _charged(one: Explanation) -> float:
    return one.bic + CLEARLY * len(one.names)


def _speeds(fitter: "Fitter") -> list[float]:
    """Forward speeds, m/s, to begin with: that of the base, which may be bent, and usual ones."""
    if fitter.recordings[0].has_speed:
        return [fitter.speed]
    return [fitter.speed, *(factor * USUAL_SPEED for factor in (0.5, 1.0, 2.0))]


def _forced(fitter: "Fitter", point: Point, share: float) -> Point:
    """The point under this share of all force, with the sensors' noise."""
    forces = [share * acceleration**2 for acceleration in fitter.accelerations]
    return point.with_noise(np.array([*fitter.floor, *forces]))


def _under(
    search: "Search", followed: list[Explanation], share: float, steps: int = FEW_STEPS
) -> list[Explanation]:
    return _steered(search, [_forced(search.fitter, one.fit.end, share) for one in followed], steps)


def _left(steered: Explanation) -> float:
    """What is left, in the worse channel, over what forces and noise account for."""
    return max(float(np.nanmean(np.hstack(steered.fit.whitened)[channel] ** 2)) for channel in range(2))


def _best_of_each(found: list[Explanation]) -> list[Explanation]:
    """The likeliest of each set, the likeliest set first."""
    best: dict[Names, Explanation] = {}
    for one in sorted(found, key=lambda one: one.bic):
        best.setdefault(one.names, one)
    return list(best.values())


def _distinct(found: list[Explanation]) -> list[Explanation]:
    """The likeliest first, each end of a set once."""
    ends: list[Explanation] = []
    for one in sorted(found, key=lambda one: one.bic):
        if not any(_is_same(one, end) for end in ends):
            ends.append(one)
    return ends


def _is_same(one: Explanation, end: Explanation) -> bool:
    """Whether two fits of a set are as likely, at the same speed: others may part as the forces fall."""
    speed, there = (float(each.fit.parameters[SPEED]) for each in (one, end))
    is_as_likely = one.bic <= end.bic + SAME_END
    return one.names == end.names and is_as_likely and abs(speed - there) < SAME_SPEED * there


def _is_near(one: Explanation, best: Explanation) -> bool:
    return one.bic < best.bic + BEHIND * best.fit.samples


def _larger(search: "Search", parent: Explanation, most: int) -> list[Explanation]:
    """The set with one effect more, of those that promise most under these forces."""
    # What a free run made of an effect alone is no start here, so each is foretold from its own probes.
    names = candidates(search, parent)
    ahead = search.workers.results([(gain, (parent, name, [], True)) for name in names])
    gains = dict(zip(names, ahead, strict=True))
    names = sorted(gains, key=lambda name: -gains[name])[:most]
    return _steered(search, [start for name in names for start in _starts(search, parent, name)])


def _starts(search: "Search", parent: Explanation, name: str) -> list[Point]:
    """The set with this effect more, where that promises most."""
    likely = sorted(probed(search.fitter, parent, named(name), []), key=lambda pair: -pair[0])
    names = parent.names | {name}
    return [search.fitter.point(names, parent, name, probe) for _, probe in likely[:PLACES]]


def _moved(search: "Search", steered: list[Explanation]) -> list[Explanation]:
    """The likeliest, its moments in another rest of the plane where as the forces fall that is likelier."""
    if not steered or _left(steered[0]) <= SLIGHTLY:
        return steered
    return _distinct([*steered, *_steered(search, with_other_moments(search.fitter, steered[0]))])[:FOLLOWED]


def _steered(search: "Search", points: list[Point], steps: int = FEW_STEPS) -> list[Explanation]:
    """Where steps of the parameters lead under each point's forces, unless it loses the recording.

    Nowhere once it takes too long.
    """
    if is_over():
        return []
    found = search.workers.results([(_climbed, (point, steps)) for point in points])
    return [one for one in found if np.isfinite(one.fit.log_likelihood)]


def _climbed(fitter: "Fitter", point: Point, steps: int) -> Explanation:
    names = point.structure.effect_names
    inputs = fitter.inputs(names, for_filter=True)
    free, are_slight = fitter.free(names), fitter.are_slight(point.noise)
    fit = filter_error_from(
        point,
        inputs,
        free,
        steps,
        holds_noise=True,
        holds_gain=not are_slight,
        settled=ROUGHLY if are_slight else SETTLED,
    )
    return fitter.explained(names, fit)


def _begun(fitter: "Fitter", names: Names, speed: float, known: Values) -> Point:
    """The values of a regression at this speed, those of most vehicles, or none: no set is needed."""
    root, rough = fitter.root.fit, first_guess(fitter.thinned, speed, names)
    values = dict(zip(root.structure.names, root.parameters.tolist(), strict=True)) | rough
    return Point(
        structure_of(names), idle_values(fitter, names, values | dict(known)), root.initial, root.levels
    )
