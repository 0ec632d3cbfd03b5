"""The free trim from which a search sets out, and the offsets of the catalogue in its place."""

from typing import TYPE_CHECKING

import numpy as np

from host.catalogue import named, structure_of
from host.catalogue.kin import OFFSETS, as_trim
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.explanation import Explanation, Names
from host.dynamics.equations import NAMES
from host.likelihood.gauss_newton import Point
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from host.likelihood.valleys import plausibility
from host.recordings.recording import Array

if TYPE_CHECKING:
    from host.diagnosis.fits.fitter import Fitter

HELD = {"heave_offset": 0.0, "pitch_offset": 0.0}  # in a diagnosis an offset is an effect
COMPRESSED = "depth_dependent_buoyancy"


def trimmed(fitter: "Fitter") -> Explanation:
    """The base with a free constant force and moment, from which the search for all else sets out."""
    held = {name: value for name, value in fitter.held.items() if name in NAMES and name not in HELD}
    fit = fit_maximum_likelihood(fitter.recordings, held=held, noise_model="output_error")
    names = frozenset({FREE_TRIM.name})
    values = fit.parameters.copy()
    trim = [NAMES.index(name) for name in HELD]
    offsets, values[trim] = values[trim], 0.0
    structure, base = structure_of(names), fitter.base.fit
    starts = [
        Point(structure, np.concatenate([values, offsets]), fit.initial, fit.noise),
        Point(structure, np.concatenate([base.parameters, np.zeros(2)]), base.initial, base.noise),
    ]
    best = max(map(fitter.carried_on, starts), key=plausibility)
    return fitter.explained(names, best)


def retrimmed(fitter: "Fitter", explanation: Explanation, offsets: Names) -> Explanation:
    """The same set with some of the catalogue's offsets in place of those it has, or of the free trim.

    Not polished: most of the offsets that are tried explain nothing.
    """
    names = (explanation.names - {FREE_TRIM.name, *OFFSETS}) | offsets
    fit = explanation.fit
    known, shift = _offset(explanation)
    chosen = sorted(offsets)
    if not chosen and COMPRESSED in names:  # its neutral depth takes over
        known["neutral_depth"] -= shift[0] / (known["c_wz"] or np.inf)
    table = np.hstack([np.zeros((2, 0)), *(as_trim(known, name) for name in chosen)])
    values = np.linalg.lstsq(table, shift, rcond=1e-8)[0] if chosen else np.zeros(0)
    known |= {named(n).parameters[0].name: float(v) for n, v in zip(chosen, values, strict=True)}
    structure = structure_of(names)
    parameters = np.array([known[name] for name in structure.names])
    start = Point(structure, parameters, fit.initial, fit.levels)
    return fitter.explained(names, fitter.fitted([start], explanation.fit))


def untrimmed(fitter: "Fitter", explanation: Explanation) -> Explanation:
    """The same set with a free trim in the place of its offsets."""
    if FREE_TRIM.name in explanation.names:
        return explanation
    names = explanation.names - {*OFFSETS} | {FREE_TRIM.name}
    _, shift = _offset(explanation)
    return fitter.explained(names, fitter.carried_on(fitter.point(names, explanation, FREE_TRIM.name, shift)))


def _offset(explanation: Explanation) -> tuple[dict[str, float], Array]:
    """The parameters of a set, and the constant force and moment (2,) of its offsets, or its free trim."""
    fit = explanation.fit
    known = dict(zip(fit.structure.names, fit.parameters.tolist(), strict=True))
    shift = np.zeros(2)
    for name in explanation.names & {FREE_TRIM.name, *OFFSETS}:
        shift += as_trim(known, name) @ [known[p.name] for p in named(name).parameters]
    return known, shift
