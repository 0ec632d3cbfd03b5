"""Whether recordings can teach anything."""

from dataclasses import replace

import numpy as np

from host.diagnosis.recordings.spans import LEAST_MEASURED
from host.errors import RecordingError
from host.recordings.recording import Recording

SHORTEST = 10.0  # s
LARGEST_ANGLE = 1.6  # rad


def check_usable(recordings: list[Recording]) -> None:
    """Raises RecordingError with one line where they are too short, or a sensor is still or hardly read."""
    name, longest = recordings[0].name, max(recording.duration for recording in recordings)
    if longest < SHORTEST:
        raise RecordingError(f"{name}: {longest:.3g} s are too short; at least {SHORTEST:.0f} s are needed")
    for channel in ("pitch", "depth"):
        values = [getattr(recording, channel) for recording in recordings]
        count = sum(int(np.isfinite(one).sum()) for one in values)
        if count < LEAST_MEASURED:
            raise RecordingError(
                f"{name}: {channel} has {count} readings; at least {LEAST_MEASURED} are needed"
            )
        if all(np.nanmax(one) == np.nanmin(one) for one in values if np.isfinite(one).any()):
            raise RecordingError(f"{name}: {channel} never changes: there is no motion to explain")


def with_plane_told(recordings: list[Recording]) -> list[Recording]:
    """With a note where the plane never moves, or further than it can: it may be something else."""
    note: str | None
    largest = max(float(np.abs(recording.rudder).max()) * recording.has_angle for recording in recordings)
    if not any(np.ptp(recording.rudder) > 0.0 for recording in recordings):
        note = (
            "the plane never moves: nothing is learnt of what it does "
            "(is its column or message the right one?)"
        )
    elif largest > LARGEST_ANGLE:
        note = (
            f"the plane was at up to {largest:.3g} rad, further than any can be: degrees or pulse widths "
            "need a unit or a scale in the vehicle file"
        )
    else:
        note = None
    return noted(recordings, note)


def noted(recordings: list[Recording], note: str | None) -> list[Recording]:
    """The recordings with a note more, if there is one."""
    if note is None:
        return recordings
    return [replace(recording, notes=(*recording.notes, note)) for recording in recordings]
