"""What the plane did between two rows: held the recorded angle, or moved on evenly to the next.

A commanded angle is held until the next command; a measured one was read off a plane that moved. Taken for
the other it comes half a row too late or too early, and other physics is bent to make up for that. The mean
angle of a plane that moves on evenly from row k to k + 1 is

    delta_k + (t_(k+1) - t_k) s_k / 2,  |s_k| = min(|d_k|, 2 max(|d_(k-1)|, |d_(k+1)|)),  d_k the slope there

A plane that rests before and after has stepped: a step stays a step.
"""

from dataclasses import replace

import numpy as np

from host.recordings.recording import Recording

NOTE = "the plane is taken to move evenly from row to row: the recording follows that better than angles held"


def with_moving_plane(recording: Recording) -> Recording:
    """The recording with the mean angles of a plane that moves on evenly."""
    slopes = np.diff(recording.rudder) / np.diff(recording.time)
    if recording.has_moving_plane or slopes.size < 3:
        return recording
    beside = np.maximum(np.abs(slopes[:-2]), np.abs(slopes[2:]))
    slope = np.zeros_like(recording.rudder)
    slope[1:-2] = np.clip(slopes[1:-1], -2.0 * beside, 2.0 * beside)
    rudder = recording.rudder + 0.5 * recording.intervals * slope
    return replace(recording, rudder=rudder, has_moving_plane=True, notes=(*recording.notes, NOTE))
