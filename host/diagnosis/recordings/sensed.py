"""Recordings that are truer than any sensor: a simulator's output, seen as through sensors.

What a simulator's integrator leaves, and every detail of a hull down to the micrometre, would count as
physics beside errors of no size, and no model of any vehicle would leave nothing.
"""

from dataclasses import replace
from math import degrees, radians

import numpy as np

from host.noise.noise_floor import noise_floor
from host.recordings.recording import Array, Recording

SMOOTH = np.array([radians(0.01), 0.001])  # rad, m: deviations of white noise; no vehicle's sensors have less
USUAL = np.array([radians(0.05), 0.005])  # of that of good ones
SEED = 1  # not that of a simulation set against the recording, or both would err alike


def as_sensed(recordings: list[Recording]) -> list[Recording]:
    """The recordings, with white noise such as good sensors have where pitch or depth has next to none.

    From a fixed seed, and told in the notes. Readings that are held keep one error.
    """
    lacking = np.where(noise_floor(recordings) < SMOOTH**2, USUAL, 0.0)
    if not lacking.any():
        return recordings
    pitch, depth = lacking.tolist()
    rng = np.random.default_rng(SEED)
    told = [f"{degrees(pitch):.2g} deg in pitch"] if pitch else []
    told += [f"{1e3 * depth:.2g} mm in depth"] if depth else []
    note = f"smoother than sensors are: seen with white noise of {' and '.join(told)}"
    return [
        replace(
            recording,
            pitch=_with_noise(recording.pitch, pitch, rng),
            depth=_with_noise(recording.depth, depth, rng),
            notes=(*recording.notes, note),
        )
        for recording in recordings
    ]


def _with_noise(values: Array, size: float, rng: np.random.Generator) -> Array:
    """Values (N,) with white noise of this deviation, the same in those that follow a measured equal."""
    known = np.flatnonzero(np.isfinite(values))
    changes = np.append(False, np.diff(values[known]) != 0.0)
    noisy = values.copy()
    noisy[known] += size * rng.standard_normal(values.size)[np.cumsum(changes)]
    return noisy
