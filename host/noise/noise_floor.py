"""The sensors' own noise, from the recording alone: below it there is nothing left to explain."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from host.recordings.recording import Array, Recording
from host.recordings.rounding import lattice, quantum

FINEST = np.array([1e-5, 1e-4])  # rad, m; finer steps matter to no model
RULES = 0.25  # of a channel's noise variance; where rounding is less, it is as good as normal
ORDER = 4  # differences; a smooth motion vanishes in them, white noise grows by a known factor
USUAL = 2.5  # deviations, within which differences count: those across a step of the plane are larger
CUT = 1.0 - 2.0 * USUAL * norm.pdf(USUAL) / (2.0 * norm.cdf(USUAL) - 1.0)  # of the variance, within these
MOST_ROUNDS = 10


def noise_floor(recordings: list[Recording]) -> Array:
    """Variances (2,) of the white noise in pitch (rad^2) and depth (m^2)."""
    return np.array([white_noise([r.pitch for r in recordings]), white_noise([r.depth for r in recordings])])


def resolution(recordings: list[Recording]) -> Array:
    """The steps (2,) to which pitch (rad) and depth (m) are rounded, 0 where noise rules."""
    steps = np.array([lattice([r.pitch for r in recordings]), lattice([r.depth for r in recordings])])
    return np.where((steps**2 / 12.0 > RULES * noise_floor(recordings)) & (steps > FINEST), steps, 0.0)


def is_quantised(recordings: list[Recording]) -> NDArray[np.bool_]:
    """Whether pitch, depth (2,) are told in steps that rule their noise, held and resampled ones as well."""
    steps = np.array([quantum([r.pitch for r in recordings]), quantum([r.depth for r in recordings])])
    return np.asarray(steps**2 / 12.0 > RULES * noise_floor(recordings))


def white_noise(pieces: list[Array]) -> float:
    """Variance of the white noise in a channel's pieces (N,), NaN where it was not measured.

    That of fourth differences within 2.5 deviations, begun with their median, over that of unit white noise:
    plane steps are rare and move neither, and it errs a quarter less than the median does. Rounded readings
    have few differences, among which it says little: they are dithered first. Rounding is the least noise of
    a channel.
    """
    gain = np.sqrt(sum(_binomial(ORDER, k) ** 2 for k in range(ORDER + 1)))
    step, rng = quantum(pieces), np.random.default_rng(0)
    # A channel slower than the grid has gaps at every other row: its own samples are the series.
    known = [piece[np.isfinite(piece)] for piece in pieces]
    dithered = [values + rng.uniform(-0.5 * step, 0.5 * step, values.size) for values in known]
    differences = np.concatenate([np.diff(values, ORDER) for values in dithered])
    spread = _usual_deviation(differences) / gain if differences.size >= 20 else 0.0
    rounding = step**2 / 12.0
    return float(max(spread**2 - rounding, rounding, 1e-12))


def _usual_deviation(values: Array) -> float:
    """The deviation of normal values (N,), some of which are something else's."""
    size = np.abs(values)
    deviation = float(np.median(size)) / 0.6745
    for _ in range(MOST_ROUNDS):
        usual = size[size <= USUAL * deviation]
        deviation = float(np.sqrt(np.mean(usual**2) / CUT))
    return deviation


def _binomial(n: int, k: int) -> int:
    result = 1
    for i in range(k):
        result = result * (n - i) // (i + 1)
    return result
