"""Searches that begin with all that every vehicle has, among waves or forces that were told beside it."""

from collections.abc import Callable
from dataclasses import replace

from host.diagnosis.disturbances.seas import (
    Explained,
    Waves,
    beside_own_waves,
    left_among,
    search_among,
    searched_among,
    told_waves,
)
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import Leftover, leftover
from host.diagnosis.fits.margins import NAMING_MARGIN, margin
from host.diagnosis.fits.prospects import form_gains
from host.diagnosis.fits.sea_fits import again_in_waves, as_filtered, with_sea
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search.outset import FAIR_PART
from host.diagnosis.search.search import Search
from host.diagnosis.search.whole_vehicle import is_real

TRACE = 0.1  # of what waves are worth


def in_a_swell(calm: Search, swell: Explanation) -> Explained | None:
    """The search from all that every vehicle has among waves estimated beside it; None if few of it pay.

    Or if more is left than a trace, or waves are no likelier than white forces: as no search without them was
    made, nothing speaks for them then.
    """
    fitter = calm.fitter
    search = search_among(calm, swell)
    found = search.run_from(swell)
    if not is_real(found.names):
        return None
    found, fitted = beside_own_waves(search, swell, found)
    told = told_waves(fitter, fitted, with_sea(fitter, fitted).bic - fitted.bic)
    left = left_among(fitter, told)
    is_enough = told.delta_bic > NAMING_MARGIN and _is_trace(fitter, told, left)
    return Explained(found, search, left, told, is_of_all=True) if is_enough else None


def _is_trace(fitter: Fitter, told: Waves, left: Leftover) -> bool:
    """Whether nothing is left, or no more than a form that gains a fraction of what the waves are worth.

    No sea is as the filter has it, which in large waves shows.
    """
    if not replace(left, is_smooth=False).is_nothing:
        return False
    return not left.is_smooth or max(form_gains(fitter, told.fitted).values()) < TRACE * told.delta_bic


def again_in_a_swell(
    fitter: Fitter, workers: Workers, on_progress: Callable[[str], None], part: Explained, waves: Waves
) -> Explained:
    """What was found so on a part of the recordings, on the whole of them in the same waves."""
    calm = Search(fitter, workers, on_progress, fitter.base, fitter.root, part.search)
    first = again_in_waves(fitter, waves.fitted)
    search, found, told = searched_among(calm, first, with_sea(fitter, first).bic)
    return Explained(found, search, leftover(fitter, told.fitted), told)


def pushed_about(calm: Search, pushed: Explanation, are_far_likelier: bool) -> Explained | None:
    """What pays of all that every vehicle has under random forces; None if little does, or nothing is left.

    Of forces that leave nothing it must be asked whether they are any, unless they are far likelier than
    none; where a form of unknown physics gains beside these, they stand for physics in part.
    """
    search = _under_forces(calm)
    found = search.run_from(pushed, is_all=True)
    left = leftover(calm.fitter, found)
    if not is_real(found.names) or (left.is_nothing and not are_far_likelier):
        return None
    return Explained(found, search, _unless_a_form_gains(calm.fitter, found, left), None, is_of_all=True)


def among_forces(calm: Search, pushed: Explanation, without: Explanation) -> Explained:
    """The same, and what else gains a fair part of what the forces do.

    without  all that every vehicle has, without forces
    """
    search = _under_forces(calm)
    least = FAIR_PART * (as_filtered(calm.fitter, without).bic - pushed.bic)
    found = search.run_from(pushed, is_all=max(search.gains(pushed).values()) < least)
    left = _unless_a_form_gains(calm.fitter, found, leftover(calm.fitter, found))
    return Explained(found, search, left, None, is_of_all=True)


def _under_forces(calm: Search) -> Search:
    calm.on_progress("random forces")
    base, root = with_sea(calm.fitter, calm.base), with_sea(calm.fitter, calm.root)
    return Search(calm.fitter, calm.workers, calm.on_progress, base, root)


def _unless_a_form_gains(fitter: Fitter, found: Explanation, left: Leftover) -> Leftover:
    """What is left, or what a form of unknown physics gains where that is nothing."""
    gains_more = left.is_nothing and max(form_gains(fitter, found).values()) > margin(found)
    return replace(left, is_smooth=True) if gains_more else left
