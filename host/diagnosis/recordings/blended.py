"""Channels drawn onto a table's clock about once a row: each row blends two readings.

On a straight line between two readings the noise is that of both, in shares that pass from one to the other.
If a reading comes once a row, the noise of rows is correlated as a cubic B-spline,

    r(0) = 2/3, r(1) = 1/6, r(k) = 0 beyond,   of the sensor's variance,   S(omega) ~ 2 + cos omega.

Taken for white, it is that of a far better sensor, by which physics seems to be missing. Every other row
shares no reading with the next, and keeps three quarters of what all of them tell.
"""

from dataclasses import replace
from math import pi
from typing import Any

import numpy as np

from host.diagnosis.recordings.sensed import SMOOTH
from host.noise.noise_floor import is_quantised, noise_floor
from host.recordings.plane_readings import PlaneReadings
from host.recordings.recording import Array, Recording

CHANNELS = ("pitch", "depth")
ORDER = 4  # differences: a smooth motion vanishes in them
BEFORE, AFTER = 3, 24  # rows around a movement of the plane, in which it shows in them
ROUNDS = 3
OUTLIER, FAR_OUTLIER = 4.0, 8.0  # deviations
BAND = 0.3  # of the highest frequency, above which noise rules
FALLS = (2, 4, 6, 8)  # powers of the frequency, with which what is left of the motion may fall
SIZES = np.concatenate([[0.0], np.geomspace(1e-4, 1e2, 25)])  # of that beside white noise
FEWEST = 1500  # rows: fewer hardly tell
AS_LIKELY = 0.003  # of the log-likelihood a row, by which white noise with such a rest may be likelier


def with_readings_apart(recordings: list[Recording]) -> list[Recording]:
    """The recordings, with every other row of a channel "not measured" where each blends two readings."""
    pieces: dict[str, list[Recording]] = {}
    for one in recordings:
        pieces.setdefault(one.sha256, []).append(one)
    blended = {name: blended_in(file) for name, file in pieces.items()}
    return [_apart(one, blended[one.sha256]) for one in recordings]


def blended_in(pieces: list[Recording]) -> list[str]:
    """The channels of one table, in stretches, in which each row blends two readings."""
    judged = (noise_floor(pieces) > SMOOTH**2) & ~is_quantised(pieces)
    return [
        name for name, is_judged in zip(CHANNELS, judged, strict=True) if is_judged and _blends(pieces, name)
    ]


def _apart(recording: Recording, names: list[str]) -> Recording:
    if not names:
        return recording
    values: dict[str, Any] = {name: _every_other(getattr(recording, name)) for name in names}
    if recording.plane is None and len(names) == len(CHANNELS):
        plane = _plane_between_rows(recording)
        values |= {"plane": plane} if plane.is_stepping else {}
    told = " and ".join(names)
    note = f"each row of {told} lies between two readings: every other one is taken for a measurement"
    return replace(recording, **values, notes=(*recording.notes, note))


def _plane_between_rows(recording: Recording) -> PlaneReadings:
    """What this table tells of a plane that may have stepped at any time between two of its rows."""
    rows = np.flatnonzero(np.isfinite(recording.rudder))
    time, angle = recording.time[rows], recording.rudder[rows]
    # Of rows half as long every second one is without a reading, so that every step is one that nobody saw.
    return PlaneReadings(time, angle, 0.5 * recording.step, is_doubtful=True)


def _every_other(values: Array) -> Array:
    apart = values.copy()
    apart[np.flatnonzero(np.isfinite(values))[1::2]] = np.nan
    return apart


def _blends(pieces: list[Recording], name: str) -> bool:
    """Whether the noise falls with frequency as that of blended readings, by Whittle's likelihood."""
    known = [np.isfinite(getattr(one, name)) for one in pieces]
    told = [(getattr(one, name)[at], one.rudder[at]) for one, at in zip(pieces, known, strict=True)]
    told = [(values, plane) for values, plane in told if values.size > AFTER + ORDER]
    if sum(values.size for values, _ in told) < FEWEST:
        return False
    noise = _less_the_plane(told)
    taper = np.hanning(noise.size)
    power = np.abs(np.fft.rfft(noise * taper)) ** 2 / np.sum(taper**2)
    omega = np.linspace(0.0, pi, power.size)
    high = omega > BAND * pi
    omega, power = omega[high], power[high] / (2.0 * np.sin(omega[high] / 2.0)) ** (2 * ORDER)
    white = max(_likelihood(power, 1.0 + size * (omega / pi) ** -fall) for fall in FALLS for size in SIZES)
    return _likelihood(power, (2.0 + np.cos(omega)) / 3.0) > white - AS_LIKELY * noise.size


def _likelihood(power: Array, shape: Array) -> float:
    """The log-likelihood of a periodogram under a spectrum of this shape, its size the likeliest."""
    return float(-power.size * np.log(np.mean(power / shape)) - np.sum(np.log(shape)))


def _less_the_plane(told: list[tuple[Array, Array]]) -> Array:
    """Differences of a channel, less their regression on those of the plane around each row, outliers cut."""
    differences = np.concatenate([np.diff(values, ORDER) for values, _ in told])
    moved = np.concatenate([_around(np.diff(np.nan_to_num(plane), ORDER)) for _, plane in told])
    noise = differences
    for _ in range(ROUNDS if moved.any() else 0):
        reach = FAR_OUTLIER * _deviation(noise)
        response = np.linalg.lstsq(moved, np.clip(differences, -reach, reach), rcond=1e-6)[0]
        noise = differences - moved @ response
    reach = OUTLIER * _deviation(noise)
    return np.asarray(np.clip(noise, -reach, reach))


def _around(moved: Array) -> Array:
    """(N, lags) of (N,): the values of the rows around each."""
    padded = np.concatenate([np.zeros(AFTER - 1), moved, np.zeros(BEFORE)])
    return np.lib.stride_tricks.sliding_window_view(padded, AFTER + BEFORE)


def _deviation(values: Array) -> float:
    return float(np.median(np.abs(values))) / 0.6745
