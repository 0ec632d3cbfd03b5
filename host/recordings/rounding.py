"""Channels whose resolution, not their noise, limits what they tell."""

from dataclasses import replace

import numpy as np

from host.recordings.recording import Array, Recording

OFF_LATTICE = 0.01  # of a step, to which readings are written
NO_STEPS = np.zeros(2)


def lattice(pieces: list[Array]) -> float:
    """The step of which all readings of a channel are multiples, from one of them; 0 where there is none."""
    levels = _levels(pieces)
    if levels.size < 2:
        return 0.0
    steps = np.diff(levels)
    counts = steps / steps.min()
    return float(steps.min()) if np.allclose(counts, np.round(counts), atol=OFF_LATTICE) else 0.0


def quantum(pieces: list[Array]) -> float:
    """The step of a quantised channel; 0 where hardly any reading repeats.

    Readings held for some rows, or resampled between their steps, are on no lattice, but repeat: there it is
    the usual distance of two.
    """
    step, levels = lattice(pieces), _levels(pieces)
    if step > 0.0 or levels.size < 2:
        return step
    readings = sum(int(np.isfinite(piece).sum()) for piece in pieces)
    return float(np.median(np.diff(levels))) if levels.size <= readings / 3 else 0.0


def _levels(pieces: list[Array]) -> Array:
    return np.unique(np.round(np.concatenate([piece[np.isfinite(piece)] for piece in pieces]), 9))


def thinned(recordings: list[Recording], steps: Array = NO_STEPS) -> list[Recording]:
    """The recordings with as many readings of pitch and depth as their changes tell.

    While a reading stays the same its error is one error, not as many as there are rows, nor two. A channel
    that changes all the time stays whole, and so does one with steps (2,), whose likelihood is that of
    intervals and knows.
    """
    channels = [r.pitch for r in recordings], [r.depth for r in recordings]
    pitch, depth = (p if step > 0.0 else _thinned(p) for p, step in zip(channels, steps, strict=True))
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
