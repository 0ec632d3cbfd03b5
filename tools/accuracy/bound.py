"""The Cramér-Rao bound: no unbiased estimator has smaller deviations on such a dive."""

from dataclasses import replace

import numpy as np
from scipy.linalg import solve_toeplitz

from tools.accuracy.dive import Array, Dive, simulate

RELATIVE_STEP = 1e-5
COMMON = 8  # the vehicle and its trim; each dive's start comes on top

Wander = tuple[tuple[float, float], tuple[float, float]]
"""(standard deviation, correlation time s) of errors of pitch and depth that wander."""


def cramer_rao(dive: Dive, speed_is_known: bool = False) -> Array:
    """Smallest standard deviations of a1, a2, a3, b1, b2, u0 (6,), initial state and trims unknown too.

    Where the speed is known, its bound is NaN, and the coupling c_wq is unknown in its place. All are NaN
    where the vehicle changes on the way.
    """
    if dive.case.is_drifting:
        return np.full(6, np.nan)
    std = _deviations(_information(dive, speed_is_known, None))[:6]
    if speed_is_known:
        std[5] = np.nan
    return std


def joint_bound(dives: list[Dive], wander: Wander | None = None) -> Array:
    """The same (6,) for dives of one vehicle and trim together; a known speed leaves nothing in its place."""
    total = np.zeros((COMMON + 4 * len(dives),) * 2)
    for k, dive in enumerate(dives):
        own = np.r_[0:COMMON, COMMON + 4 * k : COMMON + 4 * k + 4]
        total[np.ix_(own, own)] += _information(dive, False, wander)
    unknown = np.arange(total.shape[0])
    if dives[0].case.tells_speed:
        unknown = np.delete(unknown, 5)
    std = np.full(total.shape[0], np.nan)
    std[unknown] = _deviations(total[np.ix_(unknown, unknown)])
    return std[:6]


def _information(dive: Dive, speed_is_known: bool, wander: Wander | None) -> Array:
    """Fisher information (12, 12) of vehicle (or coupling for speed), trims and start."""
    case = dive.case
    truth = np.concatenate([case.vehicle, dive.trim, dive.start])
    if speed_is_known:
        truth[5] = case.coupling

    def outputs(unknowns: Array) -> Array:
        vehicle, flown = unknowns[:6].copy(), case
        if speed_is_known:
            vehicle[5], flown = case.vehicle[5], replace(case, coupling=float(unknowns[5]))
        return simulate(flown, vehicle, dive.rudder, unknowns[8:], unknowns[6:8, None])[2:]

    # Outputs are smooth in the unknowns and of order one: central differences are exact to ten digits.
    rows = []
    for i in range(truth.size):
        change = np.zeros_like(truth)
        change[i] = RELATIVE_STEP * max(abs(truth[i]), 0.1)
        rows.append((outputs(truth + change) - outputs(truth - change)) / (2.0 * change[i]))
    J, present = np.array(rows), np.isfinite([dive.pitch, dive.depth])
    total = np.zeros((truth.size, truth.size))
    for channel, noise in enumerate((case.pitch_noise, case.depth_noise)):
        of_channel = J[:, channel, present[channel]]
        if wander is None:
            total += of_channel @ of_channel.T / noise**2
            continue
        deviation, time = wander[channel]
        correlation = deviation**2 * np.exp(-case.step / time * np.arange(dive.time.size))
        correlation[0] += noise**2
        total += of_channel @ solve_toeplitz(correlation, of_channel.T)
    return total


def _deviations(information: Array) -> Array:
    size = np.sqrt(np.diag(information))
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(information / np.outer(size, size)))) / size)
