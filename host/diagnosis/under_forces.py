"""Fits of a set under random forces or waves, by a Kalman filter.

The equations of a filter take longer to compile than to run over a recording, and each set has its own. So a
set of many is fitted in the equations of what nearly every set of many holds, all that is not its own held
where it does not act: those are compiled once.
"""

from typing import TYPE_CHECKING

import numpy as np

from host.ascent import SETTLED
from host.catalogue import FAINT, ORDINARY, named, structure_of
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.explanation import Names
from host.diagnosis.margins import LARGEST_SET
from host.filter_error import filter_error_from, likelihood_under_forces
from host.fit import Fit
from host.gauss_newton import Point
from host.propagate import Inputs
from host.waves import in_waves_from, likelihood_in_waves

if TYPE_CHECKING:
    from host.diagnosis.fitter import Fitter

CARRIED = frozenset(
    name
    for name in (*ORDINARY, *FAINT, FREE_TRIM.name)
    if named(name).state is None and named(name).size_names
)
"""What acts nowhere where its coefficients are zero, and moves no state of its own."""


def climbed(
    fitter: "Fitter", start: Point, holds_noise: bool, least: float = -np.inf, settled: float = SETTLED
) -> Fit:
    """The likeliest parameters of the start's set, from there.

    While sets are compared, forces stay as they were first found (`holds_noise`), and waves to the end. Their
    levels take most of the time, and a set that is better than another is so at any of them.

    least    a log-likelihood: given up where it would not get there
    settled  of the log-likelihood: a step that gains less is the last
    """
    names = frozenset(effect.name for effect in start.structure.effects)
    wider, inputs = _carried(fitter, start)
    own = dict(zip(start.structure.names, fitter.free(names).tolist(), strict=True))
    free = np.array([own.get(name, False) for name in wider.structure.names])
    if start.noise.size > 4:
        fit = in_waves_from(wider, inputs, free, holds_noise=True, least=least, settled=settled)
    else:
        gain_held = not fitter.are_slight(start.noise)
        fit = filter_error_from(
            wider,
            inputs,
            free,
            holds_noise=holds_noise,
            holds_gain=gain_held,
            least=least,
            settled=settled,
        )
    return fit.within(start.structure)


def likelihood(fitter: "Fitter", point: Point) -> float:
    """The log-likelihood of the filter at a point; -inf where it leaves the numbers."""
    under = likelihood_in_waves if point.noise.size > 4 else likelihood_under_forces
    return under(*_carried(fitter, point))


def _carried(fitter: "Fitter", point: Point) -> tuple[Point, list[Inputs]]:
    """The point in the equations in which its set is fitted, and what drives these."""
    names: Names = frozenset(effect.name for effect in point.structure.effects)
    wider = names | CARRIED if len(names - {FREE_TRIM.name}) > LARGEST_SET else names
    known, structure = (
        dict(zip(point.structure.names, point.parameters.tolist(), strict=True)),
        structure_of(wider),
    )
    values = np.array([known.get(name, 0.0) for name in structure.names])
    return Point(structure, values, point.initial, point.noise), fitter.inputs(wider, for_filter=True)
