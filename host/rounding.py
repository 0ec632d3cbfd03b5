"""Channels whose resolution, not their noise, limits what they tell."""

from dataclasses import replace

import numpy as np

from host.recording import Array, Recording

OFF_LATTICE = 0.01  # of a step, to which readings are written


def quantum(pieces: list[Array]) -> float:
    """The step of a quantised channel, that of its readings' lattice; 0 where they lie on none.

    Readings resampled between the steps lie on none, but repeat: there it is the usual distance of two.
    """
    values = np.concatenate([piece[np.isfinite(piece)] for piece in pieces])
    levels = np.unique(np.round(values, 9))
    if levels.size < 2:
        return 0.0
    steps = np.diff(levels)
    if np.allclose(steps / steps.min(), np.round(steps / steps.min()), atol=OFF_LATTICE):
        return float(steps.min())
    return float(np.median(steps)) if levels.size <= values.size / 3 else 0.0


def thinned(recordings: list[Recording]) -> list[Recording]:
    """The recordings with as many values of a quantised channel as its level changes tell.

    For estimators that take errors for normal and independent. While a value stays the same its rounding
    error is one error, not as many as there are rows, nor two. A channel whose noise makes it change level
    all the time, or that has no steps, stays whole.
    """
    depth = _thinned([r.depth for r in recordings])
    pitch = _thinned([r.pitch for r in recordings])
    return [replace(r, depth=d, pitch=p) for r, d, p in zip(recordings, depth, pitch, strict=True)]


def _thinned(pieces: list[Array]) -> list[Array]:
    if quantum(pieces) == 0.0:
        return pieces
    known = [piece[np.isfinite(piece)] for piece in pieces]
    changes = sum(int(np.count_nonzero(np.diff(values))) for values in known)
    every = sum(values.size for values in known) // max(changes, 1)
    if every < 2:
        return pieces
    kept = []
    for piece in pieces:
        rows = np.flatnonzero(np.isfinite(piece))[:: int(every)]
        thin = np.full_like(piece, np.nan)
        thin[rows] = piece[rows]
        kept.append(thin)
    return kept
