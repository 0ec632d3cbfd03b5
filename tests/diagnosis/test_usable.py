"""Recordings from which nothing can be learnt: one line says why."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hidden_dive import hidden_dive

from host.diagnosis.diagnose import diagnose
from host.diagnosis.recordings.usable import with_plane_told
from host.errors import RecordingError
from host.recordings.recording import Recording


def still(recording: Recording) -> Recording:
    return replace(recording, depth=np.full_like(recording.depth, 10.0))


def hardly_read(recording: Recording) -> Recording:
    seldom = np.arange(recording.time.size) % 50 == 0
    return replace(recording, pitch=np.where(seldom, recording.pitch, np.nan))


def short(recording: Recording) -> Recording:
    return recording.between(0.0, 5.0)


@pytest.mark.parametrize(
    ("spoilt", "why"),
    [
        (still, "depth never changes: there is no motion to explain"),
        (hardly_read, "pitch has 12 readings; at least 20 are needed"),
        (short, "s are too short; at least 10 s are needed"),
    ],
)
def test_nothing_is_learnt_from_them(spoilt: Callable[[Recording], Recording], why: str) -> None:
    with pytest.raises(RecordingError, match=why):
        diagnose([spoilt(hidden_dive(duration=60.0))])


def test_a_plane_that_never_moves_is_told() -> None:
    dive = hidden_dive(duration=30.0)
    still = replace(dive, rudder=np.full_like(dive.rudder, 0.1))
    both = [dive, still]
    assert with_plane_told(both) is both
    (told,) = with_plane_told([still])
    assert told.notes[-1].startswith("the plane never moves: nothing is learnt of what it does")


def test_a_plane_in_degrees_is_told() -> None:
    dive = hidden_dive(duration=30.0)
    (told,) = with_plane_told([replace(dive, rudder=np.rad2deg(dive.rudder))])
    assert told.notes[-1].startswith("the plane was at up to 14.")
    assert with_plane_told([dive])[0].notes == dive.notes
