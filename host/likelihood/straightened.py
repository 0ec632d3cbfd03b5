"""Coordinates in which the valleys of the likelihood are nearly straight.

A vehicle whose damping and whose forces grow together turns into the same steady motion, only sooner; what a
recording tells about how soon it tells with little certainty, and a lag of the servo blurs it. So the
coefficients of heave go together with a1, those of pitch with a2, along curved valleys. A step d from
coefficients p is therefore taken as

    a -> a exp(d_a / a),    c -> (c + d_c) exp(d_a / a)    for every coefficient c of the equation of a,

which is d itself plus c d_a / a to first order. Where a hardly damps there is no such valley, and the step is
d itself: a damping that is too small by far would otherwise never grow, as all else would grow with it.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np

from host.recordings.recording import Array

LARGEST = 2.0  # of a logarithm, in one step
HARDLY_DAMPS = -0.1  # 1/s, of a damping: what brakes the vehicle is something else
EQUATIONS = {
    "a1": ("b1", "heave_offset", "trim_heave"),
    "a2": ("a3", "b2", "pitch_offset", "trim_pitch"),
}
PREFIXES = {"a1": "c_w", "a2": "c_q"}  # of the coefficients that the catalogue adds


def slopes(names: tuple[str, ...], parameters: Array) -> Array:
    """Derivatives (n, n) of the parameters by a step, where it begins."""
    table = np.eye(len(names))
    for damping, own in _straight(names, parameters):
        table[own, damping] = parameters[own] / parameters[damping]
    return table


def stepped(names: tuple[str, ...], parameters: Array, step: Array) -> Array:
    """The parameters (n,) one step on."""
    after = parameters + step
    for damping, own in _straight(names, parameters):
        growth = np.exp(np.clip(step[damping] / parameters[damping], -LARGEST, LARGEST))
        after[damping] = parameters[damping] * growth
        after[own] *= growth
    return after


def _straight(names: tuple[str, ...], parameters: Array) -> list[tuple[int, Sequence[int]]]:
    """Where the dampings that brake the vehicle are, each with what grows with it."""
    equations = [(names.index(damping), coefficients_beside(names, damping)) for damping in EQUATIONS]
    return [(damping, own) for damping, own in equations if parameters[damping] < HARDLY_DAMPS]


@cache
def coefficients_beside(names: tuple[str, ...], damping: str) -> Sequence[int]:
    """Where the other coefficients of the equation of a damping, a1 or a2, are."""
    named, prefix = EQUATIONS[damping], PREFIXES[damping]
    return [k for k, name in enumerate(names) if name in named or name.startswith(prefix)]
