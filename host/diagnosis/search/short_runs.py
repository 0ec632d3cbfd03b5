"""One recording in short pieces, each with a start of its own: what all that every vehicle has makes of them.

Over half a minute a free run has few maxima, and a vehicle that is unstable, or near a surface that pulls at
it, is still where it ought to be (multiple shooting: Bock, in Modelling of Chemical Reaction Systems, 1981).
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import LITTLE, MUCH, margin
from host.diagnosis.recordings.spans import is_measured, pieces_of
from host.diagnosis.search.outset import ends_of, is_enough_beside, names_of_all, says_all
from host.recordings.recording import Recording

if TYPE_CHECKING:
    from host.diagnosis.search.search import Search

PIECE, LEAST_ROWS = 25.0, 100  # s and rows of a piece, at least
LEAST_PIECES = 8
MOST_ROWS, SPREAD = 6000, 4000  # rows that are fitted at once; of more so many, spread
NEAR = 30.0  # times the noise floor, from where a fit may still come to its end
MOST_POLISHED = 4
SLIGHTEST = 1e-3  # of the variance of all force, to begin with


class ShortRuns(NamedTuple):
    """All pieces of a recording, and all that every vehicle has, fitted to these or to some of them."""

    pieces: list[Recording]
    fitter: Fitter
    whole: Explanation

    @property
    def are_all_fitted(self) -> bool:
        return len(self.fitter.recordings) == len(self.pieces)


def short_runs(recordings: list[Recording], like: Explanation | None = None) -> ShortRuns | None:
    """The pieces of one recording; None where they are few, of several recordings, or of one with alarms.

    like  all that every vehicle has, fitted to long runs, maybe beside what leads
    """
    cut = [piece for one in recordings for piece in pieces_of(one, max(LEAST_ROWS, round(PIECE / one.step)))]
    pieces = [piece for piece in cut if is_measured(piece)]
    names = {recording.name for recording in recordings}
    if len(pieces) < LEAST_PIECES or len(names) > 1 or any(recording.alarms for recording in recordings):
        return None
    fitter = Fitter(_spread(pieces))
    return ShortRuns(pieces, fitter, best_of_all(fitter, like))


def _spread(pieces: list[Recording]) -> list[Recording]:
    """Some of many pieces, evenly spaced: they are as good as all, and take less time."""
    rows = sum(piece.time.size for piece in pieces)
    if rows <= MOST_ROWS:
        return pieces
    few = np.linspace(0, len(pieces) - 1, max(LEAST_PIECES, len(pieces) * SPREAD // rows))
    return [pieces[k] for k in np.unique(np.rint(few).astype(int))]


def best_of_all(fitter: Fitter, like: Explanation | None = None) -> Explanation:
    """The root with all that every vehicle has, from the first start that leaves nothing, or the best.

    like  the same of other stretches: a start, if anything leads there
    """
    best = fitter.root
    if like is not None and not like.names <= names_of_all(fitter):
        best = fitter.polished(fitter.refitted(like))
    for found in ends_of(fitter, names_of_all(fitter)):
        best = min(best, found, key=lambda e: e.bic)
        if says_all(fitter, best):
            break
    return best


def followed_shortly(search: "Search", whole: Explanation, short: ShortRuns) -> Explanation | None:
    """The same under slight random forces, where these and what short runs teach explain what is lost so.

    None where something is left of the short runs, where the forces are not slight, or where anything in the
    catalogue, or a form of unknown physics, gains beside them.

    whole  all that every vehicle has, as the long free runs tell it
    """
    fitter = search.fitter
    if short.fitter.excess(short.whole.fit) > NEAR:
        return None
    taught = _polished(short.fitter, short.whole)
    if short.fitter.excess(taught.fit) > MUCH:
        return None
    forces = SLIGHTEST * np.square(fitter.accelerations)
    start = fitter.carried_over(taught).with_noise(np.array([*fitter.floor, *forces]))
    sea = fitter.explained(taught.names, fitter.carried_on(start))
    is_followed = sea.leaves_white and fitter.excess(sea.fit) < LITTLE and fitter.are_slight(sea.fit.noise)
    return sea if is_followed and is_enough_beside(search, sea, whole) else None


def _polished(fitter: Fitter, found: Explanation) -> Explanation:
    """Carried on as long as it gains: a long way lies between what the pieces tell and where a fit begins."""
    for _ in range(MOST_POLISHED):
        before, found = found.bic, fitter.polished(found)
        if found.bic > before - margin(found):
            break
    return found
