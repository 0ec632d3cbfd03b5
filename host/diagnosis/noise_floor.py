"""The sensors' own noise, from the recording alone: below it there is nothing left to explain."""

import numpy as np
from numpy.typing import NDArray

from host.recording import Array, Recording
from host.rounding import quantum

ORDER = 4  # differences; a smooth motion vanishes in them, white noise grows by a known factor


def noise_floor(recordings: list[Recording]) -> Array:
    """Variances (2,) of the white noise in pitch (rad^2) and depth (m^2).

    The median magnitude of fourth differences, over that of unit white noise: plane steps are rare enough
    not to move a median. A quantised channel at rest gives zero: its rounding is the least.
    """
    return np.array([_channel([r.pitch for r in recordings]), _channel([r.depth for r in recordings])])


def is_quantised(recordings: list[Recording]) -> NDArray[np.bool_]:
    """Whether rounding rules the noise of pitch, of depth."""
    channels = [r.pitch for r in recordings], [r.depth for r in recordings]
    return np.array([quantum(pieces) ** 2 / 12.0 > 0.5 * _channel(pieces) for pieces in channels])


def _channel(pieces: list[Array]) -> float:
    gain = np.sqrt(sum(_binomial(ORDER, k) ** 2 for k in range(ORDER + 1)))
    # A channel slower than the grid has gaps at every other row: its own samples are the series.
    differences = np.concatenate([np.diff(piece[np.isfinite(piece)], ORDER) for piece in pieces])
    spread = np.median(np.abs(differences)) / 0.6745 / gain if differences.size >= 20 else 0.0
    return float(max(spread**2, quantum(pieces) ** 2 / 12.0, 1e-12))


def _binomial(n: int, k: int) -> int:
    result = 1
    for i in range(k):
        result = result * (n - i) // (i + 1)
    return result
