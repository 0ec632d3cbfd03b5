"""A simulator's output on the recording's own rudder: the physics it holds against what the recording shows.

The simulation is diagnosed like a recording, through far better sensors than the recording's own: its rows,
its losses, and a tenth of its white noise (QUIETEST at least), from a fixed seed. With as much noise one set
of effects may do another's work; with none what its integrator leaves would be physics. What does not matter
at the recording's noise drops out when the two are compared.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from host.diagnosis.against.comparison import compare
from host.diagnosis.against.contained import contained
from host.diagnosis.against.other_side import side_of
from host.diagnosis.answer import Against, Answer
from host.diagnosis.diagnose import Diagnosis, diagnose
from host.diagnosis.fits.explanation import Explanation, Names
from host.diagnosis.fits.fitter import Fitter
from host.diagnosis.fits.leftover import leftover
from host.errors import RecordingError
from host.noise.speed import smoothed_speed
from host.recordings.recording import Array, Recording

SEED = 0
QUIET = 0.1  # of the sensors' noise, through which a simulation is seen
QUIETEST = np.array([np.radians(0.005), 0.0005])  # rad, m: what integrators leave is still less
RUDDER_DOUBT = 0.05  # of the recorded rudder's spread, rms: beyond it the simulation flew something else


def against_simulation(
    found: Diagnosis,
    simulated: list[Recording],
    on_progress: Callable[[str], None] = lambda _: None,
    jobs: int = 1,
) -> Answer:
    """Sets what a simulation contains against what the recording does; the diagnosis itself stays.

    simulated  as it was read

    Raises RecordingError with one line where it does not cover the recording; see `check_same_flight`.
    """
    noise = np.minimum(np.maximum(QUIET**2 * found.floor, QUIETEST**2), found.floor)
    quiet = _through_sensors_of(found.recordings, simulated, noise)
    theirs = diagnose(
        quiet,
        lambda stage: on_progress(f"simulation: {stage}"),
        jobs,
        found.extended,
        may_be_quiet=True,
        may_leave_out=False,
    )
    on_progress("simulation against recording")
    inside = contained(Fitter(theirs.recordings, known=theirs.extended), theirs.extended, found.extended)
    fitter = Fitter(found.recordings, known=found.extended)
    comparison = compare(fitter, found.extended, side_of(inside), found.std, untold_in(quiet, inside))
    # A simulator may do more than the catalogue knows; it matters where the sensors would show it.
    seen = _as_steered(theirs, _through_sensors_of(found.recordings, simulated, found.floor))
    own = Fitter(seen, known=inside)
    errors = [
        np.vstack([r.pitch - s.pitch, r.depth - s.depth])
        for r, s in zip(found.recordings, quiet, strict=True)
    ]
    both = np.sqrt(np.nanmean(np.hstack(errors) ** 2, axis=1))
    details = {
        "sha256": simulated[0].sha256,
        "contains": sorted(inside.names),
        "added_noise": {
            "pitch_rad": float(np.sqrt(noise[0])),
            "depth_m": float(np.sqrt(noise[1])),
            "seed": SEED,
        },
        "depth_rmse_m": float(both[1]),
        "pitch_rmse_rad": float(both[0]),
    }
    against = Against(
        kind="simulation",
        name=simulated[0].name,
        comparison=comparison,
        details=details,
        recorded=quiet,
        is_understood=leftover(own, own.polished(inside)).is_nothing,
    )
    return Answer(found=found, against=against)


def untold_in(simulated: list[Recording], inside: Explanation) -> Names:
    """What a simulation that tells its speed says nothing of: its speed is taken as it came about."""
    is_known = simulated[0].has_speed and "speed_loss" not in inside.names
    return frozenset({"speed_loss"} if is_known else ())


def check_same_flight(recordings: list[Recording], simulated: list[Recording]) -> None:
    """Raises RecordingError with one line when the two do not share recorded file, time span or rudder."""
    if len({recording.name for recording in recordings}) > 1:
        raise RecordingError("--simulation goes with one recording: that whose rudder it flew")
    for recording in recordings:
        one = _covering(recording, simulated)
        apart = float(np.sqrt(np.mean((_rudder(one, recording.time) - recording.rudder) ** 2)))
        if apart > RUDDER_DOUBT * max(float(np.std(recording.rudder)), 1e-6):
            raise RecordingError(
                f"{one.name}: its rudder must be that of {recording.name} (they are "
                f"{np.degrees(apart):.3g} deg rms apart); simulate on the recorded rudder"
            )


def _as_steered(diagnosed: Diagnosis, recordings: list[Recording]) -> list[Recording]:
    """With what the plane was found to do between their rows."""
    return [
        replace(one, rudder=each.rudder, has_moving_plane=each.has_moving_plane)
        for one, each in zip(recordings, diagnosed.recordings, strict=True)
    ]


def _through_sensors_of(
    recordings: list[Recording], simulated: list[Recording], floor: Array
) -> list[Recording]:
    """The simulation at the recording's rows, with its losses and white noise (2,), rad^2 and m^2.

    Its rudder is as it was given: what a simulator did with it between rows is asked of its own motion.
    """
    rng = np.random.default_rng(SEED)
    return [_seen(recording, _covering(recording, simulated), floor, rng) for recording in recordings]


def _covering(recording: Recording, simulated: list[Recording]) -> Recording:
    start, end = float(recording.time[0]), float(recording.time[-1])
    for one in simulated:
        slack = max(one.step, recording.step) * 1.5
        if one.time[0] <= start + slack and one.time[-1] >= end - slack:
            return one
    spans = ", ".join(f"{one.time[0]:.6g} to {one.time[-1]:.6g} s" for one in simulated)
    raise RecordingError(
        f"{simulated[0].name}: must cover {start:.6g} to {end:.6g} s of {recording.name} (it has {spans})"
    )


def _seen(recording: Recording, one: Recording, floor: Array, rng: np.random.Generator) -> Recording:
    noise = np.sqrt(floor)[:, None] * rng.standard_normal((2, recording.time.size))
    pitch, depth = (_at(one, values, recording.time) for values in (one.pitch, one.depth))
    speed = np.full(recording.time.size, np.nan)
    if recording.has_speed and one.has_speed:
        speed = np.interp(recording.time, one.time, smoothed_speed(one.speed).speed)
    return replace(
        recording,
        name=one.name,
        sha256=one.sha256,
        pitch=np.where(np.isfinite(recording.pitch), pitch + noise[0], np.nan),
        depth=np.where(np.isfinite(recording.depth), depth + noise[1], np.nan),
        rudder=_rudder(one, recording.time),
        has_moving_plane=False,
        plane=None,
        plane_doubt=None,
        plane_moved=None,
        notes=(),
        speed=speed,
        pitch_rate=np.full(recording.time.size, np.nan),
    )


def _rudder(one: Recording, time: Array) -> Array:
    """The simulated rudder that was last told at each time."""
    latest = np.searchsorted(one.time, time + 1e-6 * one.step, side="right") - 1
    return np.asarray(one.rudder[np.clip(latest, 0, one.time.size - 1)])


def _at(one: Recording, values: Array, time: Array) -> Array:
    """The simulated motion between its rows; it is smooth, so a cubic spline."""
    known = np.isfinite(values)
    first, last = one.time[known][[0, -1]]
    return np.asarray(CubicSpline(one.time[known], values[known])(np.clip(time, first, last)))
