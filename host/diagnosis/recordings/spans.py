"""Which parts of the recordings teach, and which only judge."""

from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import inf

import numpy as np

from host.recordings.recording import Recording

SHORTEST_DIVIDED = 48.0  # s; a shorter recording judges as a whole or not at all
SHORTEST_SPAN = 8.0  # s; a free run over less says little
JUDGING_SHARE, MOST_JUDGING = 0.1, 0.2  # of a recording, in each of two spans: usually, and of a slow sensor
ALARM_LATE = 90.0  # s, by which an alarm may come after what it tells of
LONGEST_RUN = 600.0  # s; a teaching run starts anew after so long, or the smallest drift would rule it
LONG = 8000  # rows of all teaching runs, beyond which a search begins with an excerpt
EXCERPT, PIECE = 4000, 2000  # rows of an excerpt, and at least of each of its pieces
LED, LED_PIECE = 1600, 800  # the same of what a continuation goes through; half as many again are no excerpt
LEAST_MEASURED = 20  # values of each channel, for a span to be of use
ENOUGH = 1.2  # times as many: readings do not come evenly


@dataclass(frozen=True, slots=True)
class Spans:
    """Recordings to learn from, and stretches that are used for nothing but the final score.

    In the teaching recordings the judging spans are blank: the plane is known there, the measurements are
    not. So a free run passes through them, and what it learns before and after belongs to one motion.

    unseen  row by row beside each teaching recording, what was blanked there: measured where that is not;
            empty where recordings judge as a whole
    """

    teaching: list[Recording]
    judging: list[Recording]
    unseen: list[Recording] = field(default_factory=list)


def divide(recordings: list[Recording]) -> Spans:
    """Two spans of each recording judge; of many short recordings, every third one as a whole."""
    if all(recording.duration < SHORTEST_DIVIDED for recording in recordings):
        if len(recordings) < 3:
            return Spans(recordings, [])
        return Spans(
            [r for i, r in enumerate(recordings) if i % 3 != 1],
            [r for i, r in enumerate(recordings) if i % 3 == 1],
        )
    teaching: list[Recording] = []
    judging: list[Recording] = []
    unseen: list[Recording] = []
    for recording in recordings:
        kept = recording
        for start, end in _set_aside(recording):
            piece = recording.between(start, end)
            if is_measured(piece):
                judging.append(piece)
                kept = _blanked(kept, start, end)
        for run, whole in zip(_runs(kept), _runs(recording), strict=True):
            if is_measured(run):
                teaching.append(_begun(run))
                unseen.append(_less(whole.between(teaching[-1].time[0], inf), teaching[-1]))
    return Spans(teaching, judging, unseen if judging else [])


def clear_of(spans: Spans, moments: list[float]) -> Spans:
    """Less the stretches that judge in which one of these moments lies, s, unless none is left.

    What teaches tells that something changed there, but hardly when. Of one vehicle's recordings that are
    several nothing tells which a moment belongs to.
    """
    judging, unseen = [], spans.unseen
    for piece in spans.judging:
        start, end = float(piece.time[0]), float(piece.time[-1] + piece.step)
        if any(start <= moment <= end for moment in moments):
            unseen = [_blanked(one, start, end) for one in unseen]
        else:
            judging.append(piece)
    is_one = len({recording.name for recording in spans.teaching}) == 1
    return replace(spans, judging=judging, unseen=unseen) if judging and is_one else spans


def excerpt(teaching: list[Recording], like: list[Recording] | None = None) -> list[Recording]:
    """Of long recordings the pieces in which the plane moves most; else all.

    Few and long ones: each adds a start that is to be found, and what acts late shows only in the rest.

    like  the same recordings with another plane, by which the pieces are chosen
    """
    if _rows(teaching) <= LONG:
        return teaching
    return _most_moved(teaching, like or teaching, EXCERPT, PIECE)


def led_excerpt(teaching: list[Recording]) -> list[Recording]:
    """The same, as short as tells the valley in which many coefficients lie together; else all."""
    return teaching if _rows(teaching) <= 1.5 * LED else _most_moved(teaching, teaching, LED, LED_PIECE)


def _rows(runs: list[Recording]) -> int:
    return sum(run.time.size for run in runs)


def _most_moved(
    teaching: list[Recording], like: list[Recording], most: int, least_piece: int
) -> list[Recording]:
    parts, judged = (
        [part for run in runs for part in pieces_of(run, least_piece)] for runs in (teaching, like)
    )
    ordered = np.argsort([-float(np.std(part.rudder)) * is_measured(part) for part in judged])
    rows = np.cumsum([parts[k].time.size for k in ordered])
    chosen = ordered[: 1 + int(np.searchsorted(rows, most))]
    return [parts[k] for k in sorted(chosen)]


def pieces_of(run: Recording, least: int) -> list[Recording]:
    """The run in pieces of equal length, of at least so many rows."""
    edges = np.linspace(run.time[0], run.time[-1] + run.step, 1 + max(1, run.time.size // least))
    return [_begun(run.between(float(start), float(end))) for start, end in pairwise(edges)]


def _begun(run: Recording) -> Recording:
    """The run from where the first value is measured: nothing would tell the state long before it."""
    measured = np.isfinite(run.depth) | np.isfinite(run.pitch)
    return run.between(float(run.time[np.argmax(measured)]), inf)


def _set_aside(recording: Recording) -> list[tuple[float, float]]:
    """Where a recording judges, s: teaching data on both sides of each, and of an alarm's change as well."""
    begins, ends = float(recording.time[0]), float(recording.time[-1])
    length = max(SHORTEST_SPAN, JUDGING_SHARE * recording.duration)
    length = max(length, min(_long_enough(recording), MOST_JUDGING * recording.duration))
    if recording.duration < SHORTEST_DIVIDED:
        return []
    if not recording.alarms:
        centres = [begins + share * recording.duration for share in (0.3, 0.75)]
        return [(centre - 0.5 * length, centre + 0.5 * length) for centre in centres]
    sides = [(begins, recording.alarms[0] - ALARM_LATE), (recording.alarms[0], ends)]
    lengths = [min(length, (end - start) / 3.0) for start, end in sides]
    return [
        (0.5 * (start + end - share), 0.5 * (start + end + share))
        for (start, end), share in zip(sides, lengths, strict=True)
        if share >= SHORTEST_SPAN
    ]


def _long_enough(recording: Recording) -> float:
    """s, in which the slower sensor is read often enough for a span to be of use."""
    return ENOUGH * LEAST_MEASURED * recording.duration / max(_readings(recording), 1)


def _readings(recording: Recording) -> int:
    return int(min(np.isfinite(recording.depth).sum(), np.isfinite(recording.pitch).sum()))


def is_measured(recording: Recording) -> bool:
    return _readings(recording) >= LEAST_MEASURED


def _blanked(recording: Recording, start: float, end: float) -> Recording:
    inside = (recording.time >= start) & (recording.time < end)
    return replace(
        recording,
        depth=np.where(inside, np.nan, recording.depth),
        pitch=np.where(inside, np.nan, recording.pitch),
        pitch_rate=np.where(inside, np.nan, recording.pitch_rate),
    )


def _less(whole: Recording, run: Recording) -> Recording:
    """What the whole has measured and the run has not."""
    return replace(
        whole,
        depth=np.where(np.isnan(run.depth), whole.depth, np.nan),
        pitch=np.where(np.isnan(run.pitch), whole.pitch, np.nan),
    )


def runs_of(recordings: list[Recording]) -> list[Recording]:
    """All of the recordings, in runs as short as those that teach, with nothing set aside."""
    return [_begun(run) for recording in recordings for run in _runs(recording)]


def _runs(recording: Recording) -> list[Recording]:
    count = max(1, round(recording.duration / LONGEST_RUN))
    edges = np.linspace(recording.time[0], recording.time[-1] + recording.step, count + 1)
    return [recording.between(float(start), float(end)) for start, end in pairwise(edges)]
