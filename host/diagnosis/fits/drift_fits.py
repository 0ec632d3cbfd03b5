"""Fits of sets beside what drifts (host.noise.drift): a sensor that wanders, water that rises and sinks."""

from dataclasses import replace

import numpy as np

from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import leftover
from host.diagnosis.fits.margins import NAMING_MARGIN
from host.diagnosis.fits.sea_fits import as_filtered, with_sea
from host.dynamics.propagate import free_run
from host.likelihood.fit import NO_WANDER, Fit
from host.noise.drift import drifts_of
from host.noise.drift_levels import OF_DEPTH, OF_PITCH, SENSOR, WATER, likeliest_drift
from host.recordings.recording import Array

ROUNDS = 3  # of levels and coefficients in turn
SETTLED = 1.0  # of BIC, by another round


def drifting(fitter: Fitter, explanation: Explanation) -> Explanation | None:
    """The same set beside what drifts, which is estimated with it; None where nothing does."""
    best: Explanation | None = None
    now = replace(explanation, fit=_without_forces(explanation.fit))
    for _ in range(ROUNDS):
        levels = levels_beside(fitter, now)
        if not levels.any():
            break
        among = beside(fitter, levels)
        now = among.polished(now)
        if best is not None and now.bic > best.bic - SETTLED:
            break
        best = now
    return best


def beside(fitter: Fitter, levels: Array) -> Fitter:
    """The fitter of the same recordings where these levels (3, 2) drift beside whatever is fitted."""
    base = fitter.base
    return Fitter(fitter.recordings, known=replace(base, fit=base.fit.with_wander(levels)))


def plain_drift(fitter: Fitter, explanation: Explanation) -> Explanation | None:
    """A set that leaves much, beside what drifts, where that is plain to see.

    That is: white noise is all that is left then, and random forces, which excuse most of what physics that
    was left out does, do not explain as much.
    """
    sea = with_sea(fitter, explanation)
    # The free run of either may be far from the recording, and what drifts beside it then makes up for that.
    both = [drifting(fitter, one) for one in (explanation, sea)]
    found = min((one for one in both if one is not None), key=lambda e: e.bic, default=None)
    if found is None or found.bic > min(sea.bic, as_filtered(fitter, explanation).bic) - NAMING_MARGIN:
        return None
    left = leftover(beside(fitter, found.fit.relative_wander), found)
    return None if left.is_coloured or left.is_above_floor else found


def levels_beside(fitter: Fitter, explanation: Explanation) -> Array:
    """Variances in units of the white noise, and time constants s, of pitch, depth and current (3, 2)."""
    fit = explanation.fit
    inputs = fitter.inputs(explanation.names, for_filter=True)
    runs = [free_run(fit.parameters, x0, one) for x0, one in zip(fit.initial, inputs, strict=True)]
    errors = [one.present * (one.measured - run.outputs) for run, one in zip(runs, inputs, strict=True)]
    each = zip(fitter.thinned, fitter.speed_errors, strict=True)
    drifts = [drifts_of(recording, error, NO_WANDER) for recording, error in each]
    pitch, depth = (
        likeliest_drift([pair[i] for pair in drifts], [error[i] for error in errors], longest)
        for i, longest in enumerate((OF_PITCH, OF_DEPTH))
    )
    nothing = (0.0, 0.0)
    return np.array([pitch.get(SENSOR, nothing), depth.get(SENSOR, nothing), depth.get(WATER, nothing)])


def _without_forces(fit: Fit) -> Fit:
    return replace(fit, noise=np.array([*fit.noise[:2], 0.0, 0.0]), waves=np.zeros_like(fit.waves))
