"""Stretches in which other physics acts, that comes and goes: turns, say, whose roll and yaw carry pitch.

Or a thrust that changes where no speed is measured: each stretch that is left begins at a speed of its own.
A free run through them ends far from where the vehicle is, and no effect of the vertical plane explains it.
Over short pieces, each with a start of its own, all that every vehicle has explains the others: the worst are
left out until it does (least trimmed squares: Rousseeuw, J. Am. Stat. Assoc. 79, 1984).
"""

from dataclasses import replace
from math import ceil, inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from host.catalogue.kin import OFFSETS
from host.catalogue.moments import SCANS
from host.catalogue.unknown import IN_LAYERS
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.margins import LITTLE
from host.diagnosis.fits.patience import is_over
from host.diagnosis.fits.prospects import form_gains
from host.diagnosis.fits.workers import Workers
from host.diagnosis.search.outset import FAR_LESS, IN_TIME, says_all
from host.diagnosis.search.short_runs import ShortRuns, best_of_all
from host.likelihood.output_error import output_error
from host.likelihood.valleys import has_usual_heave
from host.recordings.left_out import Span
from host.recordings.recording import Array, Recording

MOST = 0.35  # of all pieces, that may be apart
WORSE = 1.35  # times what the median piece leaves, and the noise floor: four deviations of 250 rows
NOT_TAUGHT = 1.7  # the same of pieces that did not teach: turns leave tens
AT_ONCE = 0.4  # of what the worst leaves: what is less bad may only be bent by that
MOST_ROUNDS = 6
DRAWS, DRAWN, LEAST_DRAWN = 8, 0.35, 6  # of pieces at random, the share of all in each, and the least of them
FAR_WORSE = 3.5  # times the median, where something is left of all pieces: twice that is usual
BENT = 10.0  # times the noise floor: more is no small error of the coefficients
MOST_STEPS = 10  # to the state with which a piece begins, all else held
SHARE = 0.5  # of what leaving out does, that no effect does


class _Taught(NamedTuple):
    """Pieces without the worst, and all that every vehicle has, fitted to them.

    is_all  whether nothing is left of them
    """

    pieces: list[Recording]
    whole: Explanation
    is_all: bool = True


class Apart(NamedTuple):
    """What is apart: stretches, s; or all that every vehicle has with an effect, fitted to the short runs.

    instead  where the effect does as much as leaving stretches out
    """

    spans: list[Span]
    instead: Explanation | None = None


NOTHING = Apart([])


def stretches_apart(short: ShortRuns, jobs: int = 1, as_most_tell: bool = False) -> Apart:
    """The stretches of one recording without which all that every vehicle has leaves white noise.

    None where they are many. What lasts until the end, or from the start, is one of them if something else
    lasted as long: what changed and never comes back is in the catalogue. Of a long recording some pieces
    teach what every vehicle has, and the others are held against that.

    as_most_tell  or without which it leaves far less, as most stretches together tell; that takes longer
    """
    pieces = short.pieces
    fitter, whole = short.fitter, short.whole
    taught = _as_most_tell(fitter, whole, jobs) if as_most_tell else _without_the_worst(fitter, whole)
    if taught is None:
        return NOTHING
    kept = taught.pieces if short.are_all_fitted else _followed(pieces, taught)
    starts = {piece.time[0] for piece in kept}
    apart = _joined([piece for piece in pieces if piece.time[0] not in starts])
    if not apart or len(kept) < (1.0 - MOST) * len(pieces) or _is_for_good(apart, pieces):
        return NOTHING
    least = SHARE * _less(short.whole, taught.whole)
    forms = form_gains(short.fitter, short.whole)
    if _most_of(forms, beside={*IN_TIME, *IN_LAYERS}) > least:
        return NOTHING
    instead = _with_an_effect(short.fitter, short.whole, least, jobs)
    if instead is not None:  # of the catalogue, too, something goes with the depth
        return Apart([], instead)
    return NOTHING if _most_of(forms, beside={*IN_TIME}) > least else Apart(apart)


def _most_of(forms: dict[str, float], beside: set[str]) -> float:
    return max(worth for name, worth in forms.items() if name not in beside)


def _without_the_worst(fitter: Fitter, whole: Explanation) -> _Taught | None:
    """The pieces, refitted without those of which most is left; None where too many would have to go.

    whole  all that every vehicle has, fitted to all of them
    """
    pieces = kept = fitter.recordings
    for _ in range(MOST_ROUNDS):
        left = _left(fitter, whole)
        is_apart = left > max(_most(left), AT_ONCE * float(left.max()))
        if not is_apart.any():
            is_told = says_all(fitter, whole) or fitter.excess(whole.fit) < LITTLE
            return _Taught(kept, whole) if is_told else None
        kept = [piece for piece, apart in zip(kept, is_apart, strict=True) if not apart]
        if len(kept) < (1.0 - MOST) * len(pieces):
            return None
        fitter = Fitter(kept)
        whole = best_of_all(fitter, whole)
    return None


def _as_most_tell(fitter: Fitter, whole: Explanation, jobs: int) -> _Taught | None:
    """The pieces that most of them explain together, where these leave far less than all; else None.

    Something may be left of them, that acts on all. None where it takes too long, nor by a hull that hardly
    heaves: what each piece begins with then does for whatever pushes it.
    """
    pieces, left = fitter.recordings, fitter.excess(whole.fit)
    if left < BENT:
        return None
    rng, count = np.random.default_rng(0), max(LEAST_DRAWN, ceil(DRAWN * len(pieces)))
    most = ceil((1.0 - MOST) * len(pieces))
    draws = [np.sort(rng.choice(len(pieces), count, replace=False)) for _ in range(DRAWS)]
    found: list[tuple[Explanation, Array]] = []
    with Workers(fitter, jobs) as workers:
        for k in range(0, DRAWS, jobs):
            found += workers.results([(_of_some, (drawn, whole)) for drawn in draws[k : k + jobs]])
            if is_over():
                return None
    best, by_best = min(found, key=lambda each: float(np.sort(each[1])[:most].mean()))
    if not np.isfinite(by_best).any():
        return None
    kept: list[int] = []
    for _ in range(MOST_ROUNDS):
        before, kept = kept, np.sort(np.argsort(by_best)[:most]).tolist()
        if kept == before:
            break
        best = _taught_by([pieces[k] for k in kept], best)
        by_best = _left_by(pieces, best)
        if is_over():
            return None
    followed = _not_far_worse(pieces, by_best)
    best = _taught_by(followed, best)
    is_less = Fitter(followed).excess(best.fit) < FAR_LESS * left and has_usual_heave(best.fit.end)
    return _Taught(followed, best, is_all=False) if is_less else None


def _of_some(fitter: Fitter, drawn: NDArray[np.intp], whole: Explanation) -> tuple[Explanation, Array]:
    """All that every vehicle has, as some of the pieces tell it, and what it leaves of each of all."""
    one = best_of_all(Fitter([fitter.recordings[k] for k in drawn]), whole)
    left = _left_by(fitter.recordings, one)
    return one, left if has_usual_heave(one.fit.end) else np.full_like(left, inf)


def _not_far_worse(pieces: list[Recording], left: Array) -> list[Recording]:
    """Those of which not far more is left than of most, and never fewer than most."""
    best = float(np.sort(left)[ceil((1.0 - MOST) * len(pieces)) - 1])
    limit = max(FAR_WORSE * max(float(np.median(left)), 1.0), best)
    return [piece for piece, each in zip(pieces, left, strict=True) if each <= limit]


def _taught_by(pieces: list[Recording], known: Explanation) -> Explanation:
    """All that every vehicle has, as these pieces tell it, from where others do and anew."""
    fitter = Fitter(pieces)
    begun = fitter.polished(fitter.refitted(known))
    if says_all(fitter, begun):
        return begun
    return min(begun, best_of_all(fitter, known), key=lambda e: e.bic)


def _followed(pieces: list[Recording], taught: _Taught) -> list[Recording]:
    """The pieces that others explain as well as themselves; none where what is doubted would not be taught.

    A few may not have shown all that the hull does, so what they leave a little of teaches as well.
    """
    left = _left_by(pieces, taught.whole)
    if not taught.is_all:
        return _not_far_worse(pieces, left)
    is_doubted = (left > _most(left)) & (left < BENT)
    doubted = [piece for piece, doubt in zip(pieces, is_doubted, strict=True) if doubt]
    if doubted:
        few = np.linspace(0, len(doubted) - 1, min(len(doubted), len(taught.pieces)))
        more = {piece.time[0]: piece for piece in [*taught.pieces, *(doubted[round(k)] for k in few)]}
        fitter = Fitter([more[time] for time in sorted(more)])
        again = _without_the_worst(fitter, best_of_all(fitter, taught.whole))
        if again is None:
            return []
        left = _left_by(pieces, again.whole)
    most = NOT_TAUGHT * max(float(np.median(left)), 1.0)
    return [piece for piece, each in zip(pieces, left, strict=True) if each <= most]


def _left_by(pieces: list[Recording], whole: Explanation) -> Array:
    """What the coefficients that others taught leave of each piece."""
    fitter = Fitter(pieces, known=whole)
    # At their speed, to which the coefficients belong, not at the mean of all pieces.
    start = replace(fitter.carried_over(whole), parameters=whole.fit.parameters)
    held = np.zeros(start.parameters.size, dtype=bool)
    fit = output_error(start, fitter.inputs(whole.names), held, MOST_STEPS)
    if not np.isfinite(fit.log_likelihood):  # it runs away from one of them at least
        return np.full(len(pieces), inf)
    return _left(fitter, fitter.explained(whole.names, fit))


def _most(left: Array) -> float:
    """What a piece may leave."""
    return WORSE * max(float(np.median(left)), 1.0)


def _is_for_good(apart: list[Span], pieces: list[Recording]) -> bool:
    """Whether the longest of these stretches alone is so long, and begins or ends with the recording.

    What changed before it ends, or after it began, never comes back.
    """
    start, end = max(apart, key=lambda span: span[1] - span[0])
    at_an_end = start <= pieces[0].time[0] or end > pieces[-1].time[-1]
    others = [span for span in apart if span != (start, end)]
    return at_an_end and all(end - start > until - since + pieces[0].step for since, until in others)


def _with_an_effect(fitter: Fitter, bent: Explanation, least: float, jobs: int) -> Explanation | None:
    """All that every vehicle has with the effect that takes away most of what is left; None if not so much.

    What acts only far over, or fast, or deep, is as local in time as a turn. What goes with time alone is not
    asked.
    """
    beside = {*IN_TIME, *SCANS, *OFFSETS, *bent.names}
    names = [one.name for one in fitter.candidates if one.name not in beside and not one.changes]
    with Workers(fitter, jobs) as workers:
        grown: list[Explanation] = workers.results([(Fitter.grown, (bent, name, [])) for name in names])
    best = min(grown, key=lambda e: e.bic)
    return best if _less(bent, best) > least else None


def _less(bent: Explanation, other: Explanation) -> float:
    """By how much the squared errors over their variance are less."""
    rows = sum(np.isfinite(e).sum(axis=1) for e in bent.fit.whitened)
    return float(np.sum(rows * (1.0 - other.fit.noise[:2] / bent.fit.noise[:2])))


def _left(fitter: Fitter, whole: Explanation) -> Array:
    """Squared errors of each piece over the noise floor, in the worse channel."""
    scale = whole.fit.noise[:2] / fitter.floor
    return np.array([np.nanmax(np.nanmean(e**2, axis=1) * scale) for e in whole.fit.whitened])


def _joined(pieces: list[Recording]) -> list[Span]:
    spans: list[Span] = []
    for piece in pieces:
        start, end = float(piece.time[0]), float(piece.time[-1] + piece.step)
        if spans and start - spans[-1][1] < 1.5 * piece.step:
            start = spans.pop()[0]
        spans.append((start, end))
    return spans
