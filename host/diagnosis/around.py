"""The part of a recording around a moment at which the vehicle changed."""

from dataclasses import replace

from host.diagnosis.spans import LONG
from host.errors import RecordingError
from host.recording import Recording

LONGEST_SIDE = 300.0  # s before the moment, and after it: what was usual, and what has become of it
LEAST_BEFORE = 30.0  # s; with less nobody knows what was usual


def around_alarm(recordings: list[Recording]) -> list[Recording]:
    """The part around the first alarm that a journal holds, with a note; all recordings where none does."""
    for recording in recordings:
        if recording.alarms:
            told = ", ".join(f"{alarm:.0f} s" for alarm in recording.alarms)
            note = (
                f"`mils run` gave an alarm at {told}: this is what changed at the first; --around SECONDS "
                "looks at another moment, --whole at everything as if nothing had changed"
            )
            (part,) = around([recording], recording.alarms[0])
            return [replace(part, notes=(*part.notes, note))]
    return recordings


def around(recordings: list[Recording], moment: float) -> list[Recording]:
    """The rows within five minutes (fewer at high rates) of a moment, s, marked as an alarm.

    RecordingError where no stretch holds the moment and what came before it.
    """
    side = LONGEST_SIDE
    for recording in recordings:
        begins, ends = float(recording.time[0]), float(recording.time[-1])
        if begins + LEAST_BEFORE <= moment <= ends:
            side = min(side, 0.5 * LONG * recording.step)
            part = replace(recording, alarms=(moment,))
            return [part.between(moment - side, moment + side)]
    stretches = ", ".join(f"{r.name} {r.time[0]:.0f} to {r.time[-1]:.0f} s" for r in recordings)
    raise RecordingError(
        f"--around {moment:g}: no stretch holds that moment and {LEAST_BEFORE:g} s before it ({stretches})"
    )
