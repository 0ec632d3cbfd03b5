"""A recording on its time grid: what identification, prediction and diagnosis work on."""

import hashlib
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from host.recordings.plane_readings import PlaneReadings

Array = NDArray[np.float64]
NEEDED = ("depth", "pitch", "rudder")
LONGEST_BETWEEN_SPEEDS = 2.5  # s, between two readings: a manoeuvre slows the vehicle within a few
STANDING = 0.02  # m/s
LED_IN = 6.0  # s: what a servo still has of its commands, a delay of them, and where play was left
USUAL_GAPS = 5.0  # of those between two readings of the plane, beyond which it is lost


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """One uninterrupted stretch of a recording. All arrays have shape (N,); NaN means "not measured".

    time        s, strictly increasing, from the start of the file
    depth       m, positive down
    pitch       rad, positive nose up
    rudder      rad, stern plane, held constant until the next row; never NaN
    speed       m/s through the water, as measured; all NaN where the vehicle has no speed sensor
    pitch_rate  rad/s; all NaN where it is not recorded
    step        s, nominal interval
    has_angle   whether rudder is an angle in rad; False for another actuator in a unit of its own
    has_moving_plane  whether rudder holds the means of a plane that moved on to the next row's angle
    plane       its readings, where these are further apart than the rows
    plane_doubt  rad and m (J, 2, N): what pitch and depth do where one of J moments at which the plane
                stepped between its readings is off by a deviation; None where all of them are known
    plane_moved  rad (N,): how far the plane moved on in each row; None where it held its angles
    plane_astray  deviation of its mean angle in a row from `rudder`, over how far it moved on in that
    counts      what was refused in the whole file, by cause
    notes       what was lost or decided on the user's behalf, one sentence each
    alarms      s, on the axis of time: when the vehicle was found to move no longer as it did
    before      s and rad (2, L): the rows just before the first, where it was cut from a longer one, and the
                rudder there
    """

    name: str
    sha256: str
    time: Array
    depth: Array
    pitch: Array
    rudder: Array
    speed: Array
    pitch_rate: Array
    step: float
    has_angle: bool = True
    has_moving_plane: bool = False
    plane: PlaneReadings | None = None
    plane_doubt: Array | None = None
    plane_moved: Array | None = None
    plane_astray: float = 0.0
    counts: Counter[str] = field(default_factory=Counter)
    notes: tuple[str, ...] = ()
    alarms: tuple[float, ...] = ()
    before: Array = field(default_factory=lambda: np.zeros((2, 0)))

    @property
    def has_speed(self) -> bool:
        return bool(np.isfinite(self.speed).any())

    @property
    def duration(self) -> float:
        """Seconds from the first to the last row."""
        return float(self.time[-1] - self.time[0])

    @property
    def intervals(self) -> Array:
        """Time from each row to the next, s, shape (N,); the last one is the nominal step."""
        return np.diff(self.time, append=self.time[-1] + self.step)

    def between(self, start: float, end: float) -> "Recording":
        """Rows with start <= time < end."""
        rows = (self.time >= start) & (self.time < end)
        return replace(
            self,
            time=self.time[rows],
            depth=self.depth[rows],
            pitch=self.pitch[rows],
            rudder=self.rudder[rows],
            speed=self.speed[rows],
            pitch_rate=self.pitch_rate[rows],
            plane_doubt=None if self.plane_doubt is None else self.plane_doubt[:, :, rows],
            plane_moved=None if self.plane_moved is None else self.plane_moved[rows],
            alarms=tuple(alarm for alarm in self.alarms if start <= alarm < end),
            before=self._led_in(rows),
        )

    def _led_in(self, rows: NDArray[np.bool_]) -> Array:
        """Times and rudder (2, L) of the last rows before the first of these."""
        if not rows.any():
            return self.before
        first = int(np.argmax(rows))
        all_before = np.hstack([self.before, np.vstack([self.time, self.rudder])[:, :first]])
        return np.asarray(all_before[:, all_before[0] >= self.time[first] - LED_IN])


def split_at_gaps(
    recording: Recording, longest_hold: float, needs: tuple[str, ...] = NEEDED
) -> list[Recording]:
    """Cuts where rows are further apart than `longest_hold` s, or where the rudder is unknown for that long.

    A shorter loss of the rudder is bridged by holding its last value, as the actuator does; of one that is
    read seldom longer ones are no loss. Stretches that hold fewer than ten rows, or nothing at all of a
    needed channel, are dropped.
    """
    longest_unread = longest_hold
    if recording.plane is not None and not recording.plane.is_doubtful:
        longest_unread = max(longest_hold, USUAL_GAPS * float(np.median(np.diff(recording.plane.time))))
    known = np.isfinite(recording.rudder)
    rows = np.arange(recording.time.size)
    last_known = np.maximum.accumulate(np.where(known, rows, -1))
    reachable = last_known >= 0
    held = recording.time - recording.time[np.maximum(last_known, 0)]
    usable = reachable & (held <= longest_unread)
    rudder = np.where(usable, recording.rudder[np.maximum(last_known, 0)], np.nan)
    filled = replace(recording, rudder=rudder)
    starts_anew = np.diff(recording.time, prepend=recording.time[0]) > longest_hold
    starts_anew |= usable & ~np.concatenate([[False], usable[:-1]])
    group = np.cumsum(starts_anew)
    pieces = []
    for label in np.unique(group[usable]):
        of_piece = usable & (group == label)
        piece = replace(
            filled,
            **{
                name: getattr(filled, name)[of_piece]
                for name in ("time", "depth", "pitch", "rudder", "speed", "pitch_rate")
            },
        )
        if of_piece.sum() >= 10 and all(np.isfinite(getattr(piece, name)).any() for name in needs):
            pieces.append(_with_useful_speed(piece))
    return pieces


def _with_useful_speed(piece: Recording) -> Recording:
    """Speed varies slowly, so its sensor may be slow; one that is silent half of the time tells none.

    Nor does one that reads zero while the vehicle swims: without bottom lock, or a receiver under water.
    """
    known = np.flatnonzero(np.isfinite(piece.speed))
    steps = np.diff(piece.time[known])
    note = ""
    if known.size and steps[steps <= LONGEST_BETWEEN_SPEEDS].sum() < 0.5 * piece.duration:
        note = "the speed is known in less than half of the time, so none is taken as measured"
    elif known.size and np.abs(piece.speed[known]).max() < STANDING:
        note = "the speed is said to be zero all along, so none is taken as measured"
    if not note:
        return piece
    notes = tuple(dict.fromkeys((*piece.notes, note)))
    return replace(piece, speed=np.full_like(piece.speed, np.nan), notes=notes)


def mean_speed(recordings: list[Recording]) -> float:
    """m/s, of those recordings that have a speed, of which there must be one."""
    return float(np.mean([np.nanmean(each.speed) for each in recordings if each.has_speed]))


def notes_of(recordings: list[Recording]) -> list[str]:
    """Each file's notes once, with its name, whatever the number of its stretches."""
    return list(dict.fromkeys(f"{each.name}: {note}" for each in recordings for note in each.notes))


def file_sha256(path: Path) -> str:
    """Fingerprint of a recording for the provenance of what is learnt from it."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
