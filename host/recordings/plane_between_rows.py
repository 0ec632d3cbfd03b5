"""What the plane did between two rows: held the recorded angle, or moved on evenly to the next.

A commanded angle is held until the next command; a measured one was read off a plane that moved. Taken for
the other it comes half a row too late or too early, and other physics is bent to make up for that. The mean
angle of a plane that moves on evenly from row k to k + 1 is

    delta_k + (t_(k+1) - t_k) s_k / 2,  |s_k| = min(|d_k|, 2 max(|d_(k-1)|, |d_(k+1)|)),  d_k the slope there

A plane that rests before and after has stepped: a step stays a step. Where the plane was read in few of the
rows its readings count in their place, and a step is about halfway between two
(host.recordings.plane_readings).
"""

from dataclasses import replace

import numpy as np

from host.recordings.plane_readings import PlaneReadings
from host.recordings.recording import Array, Recording

NOTE = "the plane is taken to move evenly from row to row: the recording follows that better than angles held"

NOTE_ASTRAY = (
    "the plane moved more often than it was recorded: its mean angle in a row is off by {:.2g} of how far it"
    " moved there, which counts as noise; record it as often as it is steered"
)
NOTE_BETWEEN = "the plane was not read in every row: it is taken to move on from reading to reading"


def with_moving_plane(recording: Recording) -> Recording:
    """The recording with the mean angles of a plane that moves on evenly."""
    if recording.has_moving_plane:
        return recording
    if recording.plane is not None and _counts(recording.plane):
        return between_readings(recording, recording.plane)
    slopes = np.diff(recording.rudder) / np.diff(recording.time)
    if slopes.size < 3:
        return recording
    beside = np.maximum(np.abs(slopes[:-2]), np.abs(slopes[2:]))
    slope = np.zeros_like(recording.rudder)
    slope[1:-2] = np.clip(slopes[1:-1], -2.0 * beside, 2.0 * beside)
    moved = recording.intervals * slope
    rudder, notes = recording.rudder + 0.5 * moved, (*recording.notes, NOTE)
    return replace(recording, rudder=rudder, plane_moved=moved, has_moving_plane=True, notes=notes)


def with_plane_astray(recording: Recording, share: float) -> Recording:
    """The same where the mean angle of a plane that moved on is known but for this share of what it moved.

    As of an autopilot that steers it more often than it is recorded.
    """
    return replace(recording, plane_astray=share, notes=(*recording.notes, NOTE_ASTRAY.format(share)))


def between_readings(
    recording: Recording,
    plane: PlaneReadings,
    moments: Array | None = None,
    holds_between: bool = False,
    note: str = NOTE_BETWEEN,
) -> Recording:
    """The recording with the mean angles of a plane that stepped at these moments, and else moved on evenly.

    moments, holds_between  as of PlaneReadings.means
    """
    ends = recording.time + recording.intervals
    rudder = plane.means(recording.time, ends, moments, holds_between)
    return replace(recording, rudder=rudder, has_moving_plane=True, notes=(*recording.notes, note))


def ways_between(recordings: list[Recording]) -> list[list[Recording]]:
    """The recordings with a plane that held, and with one that moved on from row to row.

    Where it was read in few of the rows, with one that moved on from reading to reading, all the time or from
    row to row.
    """
    others = [[with_moving_plane(recording) for recording in recordings]]
    planes = [recording.plane for recording in recordings if recording.plane is not None]
    if any(_counts(plane) and plane.pace > 0.0 for plane in planes):
        others.append([_from_row_to_row(recording) for recording in recordings])
    return [recordings, *(other for other in others if not _are_alike(recordings, other))]


def _counts(plane: PlaneReadings) -> bool:
    """Whether its readings count in place of the rows: of a plane that steps only where most have none.

    What is doubtful only counts where the moments of its steps are estimated (host.diagnosis.plane_moments):
    that it always stepped halfway may be as likely as a delay.
    """
    return not plane.is_doubtful and (plane.is_slow or not plane.is_stepping)


def _from_row_to_row(recording: Recording) -> Recording:
    if recording.has_moving_plane or recording.plane is None or not _counts(recording.plane):
        return recording
    return between_readings(recording, recording.plane, holds_between=True)


def _are_alike(recordings: list[Recording], others: list[Recording]) -> bool:
    return all(np.array_equal(a.rudder, b.rudder) for a, b in zip(recordings, others, strict=True))
