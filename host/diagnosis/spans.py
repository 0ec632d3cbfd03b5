"""Which parts of the recordings teach, and which only judge."""

from dataclasses import dataclass

import numpy as np

from host.recording import Recording

BLOCKS = 6  # the second and the fifth judge: a change at a moment has teaching data on both sides
SHORTEST_BLOCK = 8.0  # s; a free run over less says little


@dataclass(frozen=True, slots=True)
class Spans:
    """Stretches to learn from, and stretches that are used for nothing but the final score."""

    teaching: list[Recording]
    judging: list[Recording]


def divide(recordings: list[Recording]) -> Spans:
    """Two blocks of six of each recording judge; of many short recordings, every third one as a whole."""
    if all(recording.duration < BLOCKS * SHORTEST_BLOCK for recording in recordings):
        if len(recordings) < 3:
            return Spans(recordings, [])
        return Spans(
            [r for i, r in enumerate(recordings) if i % 3 != 1],
            [r for i, r in enumerate(recordings) if i % 3 == 1],
        )
    teaching: list[Recording] = []
    judging: list[Recording] = []
    for recording in recordings:
        if recording.duration < BLOCKS * SHORTEST_BLOCK:
            teaching.append(recording)
            continue
        edges = np.linspace(recording.time[0], recording.time[-1] + recording.step, BLOCKS + 1)
        runs = ((0, 1, teaching), (1, 2, judging), (2, 4, teaching), (4, 5, judging), (5, 6, teaching))
        for first, last, side in runs:
            piece = recording.between(float(edges[first]), float(edges[last]))
            if np.isfinite(piece.depth).sum() >= 20 and np.isfinite(piece.pitch).sum() >= 20:
                side.append(piece)
    return Spans(teaching, judging)
