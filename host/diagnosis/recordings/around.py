"""The part of a recording around a moment at which the vehicle changed."""

from dataclasses import replace

from host.diagnosis.recordings.spans import LONG
from host.errors import RecordingError
from host.recordings.recording import Recording

LONGEST_SIDE = 300.0  # s before the moment, and after it: what was usual, and what has become of it
LEAST_BEFORE = 30.0  # s; with less nobody knows what was usual


def around_alarm(recordings: list[Recording]) -> list[Recording]:
    """The part around the first alarm that a journal holds, with a note; all recordings where none does.

    An alarm right after the start of a stretch has nothing before it to compare with, and is passed over.
    """
    for recording in recordings:
        alarms = [alarm for alarm in recording.alarms if _is_inside(recording, alarm)]
        if alarms:
            told = ", ".join(f"{alarm:.0f} s" for alarm in alarms)
            note = (
                f"`mils run` gave an alarm at {told}: only the part around the first is looked at, for what "
                "changed there; --around SECONDS asks about another moment, --whole about everything"
            )
            return [_cut(recording, alarms[0], note)]
    return [replace(recording, alarms=()) for recording in recordings]


def around(recordings: list[Recording], moment: float) -> list[Recording]:
    """The rows of a recording within five minutes (fewer at high rates) of a moment, s, marked as an alarm.

    Of several recordings the first that holds it. RecordingError where none holds the moment and what came
    before it.
    """
    for recording in recordings:
        if _is_inside(recording, moment):
            return [_cut(recording, moment, f"only the part around {moment:g} s is looked at")]
    stretches = ", ".join(f"{r.name} {r.time[0]:.0f} to {r.time[-1]:.0f} s" for r in recordings)
    raise RecordingError(
        f"--around {moment:g}: no stretch holds that moment and {LEAST_BEFORE:g} s before it ({stretches})"
    )


def _cut(recording: Recording, moment: float, note: str) -> Recording:
    side = min(LONGEST_SIDE, 0.5 * LONG * recording.step)
    part = replace(recording, alarms=(moment,), notes=(*recording.notes, note))
    return part.between(moment - side, moment + side)


def _is_inside(recording: Recording, moment: float) -> bool:
    return bool(recording.time[0] + LEAST_BEFORE <= moment <= recording.time[-1])
