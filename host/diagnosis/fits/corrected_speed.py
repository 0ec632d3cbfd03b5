"""What a speed is charged that leaves the readings which it is said to correct.

The likelihood is that of pitch and depth alone: where much is missing, the surge equation would turn a speed
that was well measured into whatever makes up for it. With the smoothed readings s (host.noise.speed), of
noise r, and the corrected speed u over N rows

    charge = N max(0, mean (u - s)^2 - r - var s) / r,

the deviance of the readings beyond what noise hides and a slow sensor may miss: all that changed.
"""

from dataclasses import dataclass

import numpy as np

from host.catalogue.nuisance import SPEED_CORRECTION
from host.dynamics.propagate import Inputs, free_run
from host.likelihood.fit import Fit
from host.noise.noise_floor import white_noise
from host.noise.speed import smoothed_speed
from host.recordings.recording import Array, Recording

NOISE_FREE = 1e-12  # m^2/s^2: below any sensor, so that readings without noise divide by no zero
LOST = 1e12  # of a charge: as good as infinite, and of two the larger can be told


@dataclass(frozen=True, slots=True)
class SpeedReadings:
    """The smoothed readings (N,), m/s; their noise, and how far a correction may go, m^2/s^2."""

    smoothed: Array
    noise: float
    allowed: float


def speed_readings(recording: Recording) -> SpeedReadings | None:
    """None where the speed was not measured."""
    if not recording.has_speed:
        return None
    known = recording.speed[np.isfinite(recording.speed)]
    smoothed, noise = smoothed_speed(recording.speed).speed, max(float(white_noise([known])), NOISE_FREE)
    return SpeedReadings(smoothed, noise, noise + float(np.var(smoothed)))


def strayed(fit: Fit, inputs: list[Inputs], readings: list[SpeedReadings | None]) -> float:
    """The charge of a fit, in units of BIC; 0 where nothing corrects the speed, or where forces act."""
    structure = fit.structure
    if fit.has_process_noise or not structure.effect_names >= {"speed_loss", SPEED_CORRECTION.name}:
        return 0.0
    speed = fit.parameters[structure.names.index("u0")]
    lost, charge = structure.states.index("speed_loss"), 0.0
    for x0, run, read in zip(fit.initial, inputs, readings, strict=True):
        if read is None:
            continue
        with np.errstate(over="ignore", invalid="ignore"):
            corrected = speed + free_run(fit.parameters, x0, run).states[lost]
            beyond = float(np.mean((corrected - read.smoothed) ** 2)) - read.allowed
            charge += corrected.size * max(0.0, beyond) / read.noise
    return charge if charge < LOST else LOST
