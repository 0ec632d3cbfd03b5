"""The measured speed without its noise: what plane and pitch explain of it, and a smooth rest.

The equations take the speed as it is; its noise would drive depth and all forces as if it were water:

    u = sum_j c_j L_T[f_j] + s(t),   f = 1, delta, delta^2, theta, theta^2, q^2,   L_T: T x' + x = f

The first-order lag T and c by least squares, the rest s a cubic smoothing spline whose stiffness is chosen
by generalised cross-validation (Craven and Wahba, Numer. Math. 31, 1979). A spline alone would round off what
the speed does when the plane moves.
"""

from dataclasses import replace

import numpy as np
from scipy.interpolate import make_smoothing_spline
from scipy.signal import lfilter

from host.recording import Array, Recording

LEAST_ROWS = 50
LAGS = 24  # tried, from two rows to a third of the recording


def with_smooth_speed(recording: Recording) -> Recording:
    """The recording with its speed, if measured, less the noise."""
    if not recording.has_speed or recording.time.size < LEAST_ROWS:
        return recording
    explained = _explained(recording)
    rest = make_smoothing_spline(recording.time, recording.speed - explained)(recording.time)
    return replace(recording, speed=explained + rest)


def _explained(recording: Recording) -> Array:
    """(N,) the best fit by lagged functions of plane and pitch."""
    time, speed, step = recording.time, recording.speed, recording.step
    seen = np.isfinite(recording.pitch)
    pitch = np.interp(time, time[seen], recording.pitch[seen])
    rate, rudder = np.gradient(pitch, step), recording.rudder
    drivers = (rudder, rudder**2, pitch, pitch**2, rate**2)
    fits = []
    for lag in np.geomspace(2.0 * step, recording.duration / 3.0, LAGS):
        settling = np.exp(-(time - time[0]) / lag)
        table = np.column_stack([np.ones_like(time), settling, *(_lagged(f, lag, step) for f in drivers)])
        fits.append(table @ np.linalg.lstsq(table, speed, rcond=None)[0])
    return min(fits, key=lambda fit: float(np.sum((speed - fit) ** 2)))


def _lagged(values: Array, lag: float, step: float) -> Array:
    keep = np.exp(-step / lag)
    first = values[0]
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values - first) + first)
