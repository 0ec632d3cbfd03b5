"""When a plane stepped that was read more seldom than the vehicle answered to it.

Held until its next reading each step comes late, by up to the time between two; and no physics is late by
another time at each step. So the moments f_j, 0 to 1 between the readings, are estimated from what the
vehicle did, with all that every vehicle has: about a run of that model the residuals are

    e = S dp + B df,  B = de/df,

with the sensitivities S to its coefficients p and to the start, and a normal prior of the mean and variance
that f_j has anywhere between the readings. What the recordings tell of the moments costs log det(1 + B^T B V)
of BIC, twice the logarithm by which the posterior is narrower than the prior of variances V; if all steps are
where the rows of a table were, it costs which row each was at. The recordings are handed on with what another
moment of each step would do, B V^(1/2), which counts for nothing from then on (host.noise.unseen_plane): the
model the moments were estimated with is none of the answer.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import lsq_linear

from host.catalogue import FAINT, ORDINARY
from host.catalogue.nuisance import FREE_TRIM
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import NAMING_MARGIN
from host.diagnosis.fits.starts import begun_from
from host.diagnosis.recordings.spans import excerpt, runs_of
from host.diagnosis.recordings.unseen_steps import UnseenSteps
from host.diagnosis.search.whole_vehicle import ended
from host.dynamics.propagate import NX0
from host.likelihood.gauss_newton import Point
from host.likelihood.output_error import residuals_at
from host.recordings.recording import Array, Recording
from host.recordings.rounding import NO_STEPS

MOST_ROUNDS = 15
SHARES = (1.0, 0.5, 0.2)  # of a step, until it leads down
SLIGHT = 2.0  # of a deviance: less is not worth another round
SHIFT = 0.1  # of the time between two readings, over which a difference is taken
SCATTERED = 0.15  # deviation of moments from one another: half that of any from 0 to 1
RUN_AWAY = 1e3  # rad or m, that a step at another moment would do
TINY = 1e-9  # of a moment, so that its bounds lie apart
RIDGE = 1e-9  # of the information: what two coefficients do alike


class Moved(NamedTuple):
    """The plane stepped at some moments (J,), and all that every vehicle has, fitted to that.

    cost  -2 log of likelihood and prior, but for a constant
    """

    moments: Array
    fitter: Fitter
    whole: Explanation
    cost: float


class Aim(NamedTuple):
    """Where moments and coefficients are likeliest together, were the residuals linear in them.

    charge  of BIC, for knowing the moments
    """

    moments: Array
    parameters: Array
    charge: float


def with_plane_moments(
    recordings: list[Recording], on_progress: Callable[[str], None] = lambda _: None
) -> list[Recording]:
    """The recordings with the plane's steps at their likeliest moments between its readings.

    As they are where each row has its own reading, or may have and the steps are all as late after one; and
    where a plane that held until the next is about as likely.
    """
    unseen = UnseenSteps(recordings)
    if not unseen.steps:
        return recordings
    on_progress("when the plane moved")
    held, best, charge = _whole(recordings)[1], _anew(unseen, unseen.mean), 0.0
    for _ in range(MOST_ROUNDS):
        aim = _likeliest(unseen, best)
        found, charge = _towards(unseen, best, aim), aim.charge
        if found.cost > best.cost - SLIGHT:
            # Bent to suit moments that were far off, the coefficients may have led elsewhere.
            found = _anew(unseen, best.moments)
        if found.cost > best.cost - SLIGHT:
            break
        best = found
    on_rows, theirs = _on_rows(unseen, best)
    if theirs < best.cost + charge:
        best, charge = on_rows, theirs - on_rows.cost
    if best.cost + charge > -2.0 * held.fit.log_likelihood - NAMING_MARGIN:
        return recordings
    if unseen.are_doubtful and best.moments.std() < SCATTERED:
        return recordings  # each as late as the others: the plane's own steps, and a delay that is lacking
    return _with_doubt(unseen, best)


def _whole(recordings: list[Recording]) -> tuple[Fitter, Explanation]:
    """All that every vehicle has, fitted to all of the recordings."""
    runs = runs_of(recordings)
    part = excerpt(runs)
    first = Fitter(part)
    names = frozenset({FREE_TRIM.name, *ORDINARY, *FAINT})
    names |= {*first.tools_beside(names)}
    found = ended(first, begun_from(first, first.root, names), names)
    if part is runs:
        return first, found
    fitter = Fitter(runs, known=found)
    return fitter, fitter.refitted(found)


def _anew(unseen: UnseenSteps, moments: Array) -> Moved:
    fitter, whole = _whole(unseen.moved(moments))
    return Moved(moments, fitter, whole, unseen.off(moments) - 2.0 * whole.fit.log_likelihood)


def _towards(unseen: UnseenSteps, best: Moved, aim: Aim) -> Moved:
    """The vehicle fitted anew with the plane moved there, or as much of the way as is likelier."""
    fit, found = best.whole.fit, best
    for share in SHARES:
        moments = best.moments + share * (aim.moments - best.moments)
        fitter = Fitter(runs_of(unseen.moved(moments)), known=best.whole)
        parameters = fit.structure.clipped(fit.parameters + share * (aim.parameters - fit.parameters))
        starts = [Point(fit.structure, p, fit.initial, fit.levels) for p in (parameters, fit.parameters)]
        whole = fitter.polished(fitter.explained(best.whole.names, fitter.fitted(starts)))
        found = Moved(moments, fitter, whole, unseen.off(moments) - 2.0 * whole.fit.log_likelihood)
        if found.cost < best.cost:
            break
    return found


def _on_rows(unseen: UnseenSteps, best: Moved) -> tuple[Moved, float]:
    """The vehicle fitted anew with each step at the nearest row that nobody read, and what that costs of BIC.

    Which of k rows it was costs 2 log k, and no more is learnt of it.
    """
    moments = unseen.on_rows(best.moments)
    if moments is None:
        return best, np.inf
    fitter = Fitter(runs_of(unseen.moved(moments)), known=best.whole)
    whole = fitter.polished(best.whole)
    cost = -2.0 * whole.fit.log_likelihood
    return Moved(moments, fitter, whole, cost), cost + 2.0 * float(np.log(unseen.rows).sum())


def _likeliest(unseen: UnseenSteps, moved: Moved) -> Aim:
    """A step of Gauss and Newton in moments and coefficients, as far as the moments may go."""
    fit = moved.whole.fit
    p, count = int(fit.free.sum()), moved.moments.size
    normal, rhs = np.zeros((p + count, p + count)), np.zeros(p + count)
    weight = 1.0 / np.sqrt(fit.noise[:2])
    for error, slopes, shifts in _residuals(unseen, moved):
        if not (np.isfinite(slopes).all() and np.isfinite(shifts).all()):
            return Aim(moved.moments, fit.parameters, 0.0)  # it has run away: no step leads anywhere
        columns = np.concatenate([slopes[:, : fit.free.size][:, fit.free], shifts], axis=1)
        flat = (columns * weight[:, None, None]).transpose(1, 0, 2).reshape(p + count, -1)
        start = (slopes[:, -NX0:] * weight[:, None, None]).transpose(1, 0, 2).reshape(NX0, -1)
        start = np.linalg.qr(start.T)[0]
        flat -= (flat @ start) @ start.T
        normal += flat @ flat.T
        rhs += flat @ (error * weight[:, None]).ravel()
    pp = normal[:p, :p] + RIDGE * np.diag(1.0 + np.diag(normal)[:p])
    away = np.linalg.solve(pp, np.column_stack([normal[:p, p:], rhs[:p]]))
    ff = normal[p:, p:] - normal[p:, :p] @ away[:, :-1]
    L = cholesky(ff + np.diag(1.0 / unseen.variance), lower=True)
    f = rhs[p:] - normal[p:, :p] @ away[:, -1] - (moved.moments - unseen.mean) / unseen.variance
    inside = (-moved.moments - TINY, 1.0 - moved.moments + TINY)
    step = lsq_linear(L.T, solve_triangular(L, f, lower=True), inside).x
    parameters = fit.parameters.copy()
    parameters[fit.free] += away[:, -1] - away[:, :-1] @ step
    charge = 2.0 * np.log(np.diag(L)).sum() + np.log(unseen.variance).sum()
    return Aim(np.clip(moved.moments + step, 0.0, 1.0), parameters, float(charge))


def _residuals(unseen: UnseenSteps, moved: Moved) -> list[tuple[Array, Array, Array]]:
    """Of each run the residuals (2, N), rad and m, with their slopes by coefficients and start, and moments.

    As under white noise, also of what is rounded: (2, n + 5, N) and (2, J, N).
    """
    fit = moved.whole.fit
    point = Point(fit.structure, fit.parameters, fit.initial, np.ones(4))
    inputs = [replace(one, steps=NO_STEPS) for one in moved.fitter.inputs(moved.whole.names)]
    owners = [i for i, one in enumerate(unseen.recordings) for _ in runs_of([one])]
    found = []
    for r, (error, slopes) in enumerate(residuals_at(point, inputs)[0]):
        run, alone = moved.fitter.recordings[r], replace(point, initial=[point.initial[r]])
        shifts = np.zeros((2, moved.moments.size, error.shape[1]))
        for j in unseen.within(owners[r], run):
            shifted = moved.moments.copy()
            shifted[j] += (by := SHIFT if shifted[j] < 0.5 else -SHIFT)
            one = inputs[r].with_rudder(unseen.angles(owners[r], run, shifted))
            ((other, _),), _ = residuals_at(alone, [one], has_slopes=False)
            shifts[:, j] = (error - other) / by
        found.append((error, slopes, shifts))
    return found


def _with_doubt(unseen: UnseenSteps, moved: Moved) -> list[Recording]:
    """The recordings with the plane moved, and what another moment of each step would do."""
    recordings = unseen.moved(moved.moments)
    doubts = [np.zeros((moved.moments.size, 2, one.time.size)) for one in recordings]
    owners = [i for i, one in enumerate(recordings) for _ in runs_of([one])]
    deviations = np.sqrt(unseen.variance)[:, None, None]
    runs = zip(owners, moved.fitter.recordings, _residuals(unseen, moved), strict=True)
    for i, run, (_, _, shifts) in runs:
        if not np.abs(shifts).max(initial=0.0) < RUN_AWAY:
            return recordings  # no hull that is unstable tells how far another moment would lead it
        rows = np.searchsorted(recordings[i].time, run.time)
        doubts[i][:, :, rows] = deviations * shifts.transpose(1, 0, 2)
    return [
        replace(one, plane_doubt=doubt[doubt.any(axis=(1, 2))]) if doubt.any() else one
        for one, doubt in zip(recordings, doubts, strict=True)
    ]
