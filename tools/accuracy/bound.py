"""The Cramér-Rao bound: no unbiased estimator has smaller deviations on such a dive."""

from dataclasses import replace

import numpy as np

from tools.accuracy.dive import Array, Dive, simulate

RELATIVE_STEP = 1e-5


def cramer_rao(dive: Dive, speed_is_known: bool = False) -> Array:
    """Smallest standard deviations of a1, a2, a3, b1, b2, u0 (6,), initial state and trims unknown too.

    Where the speed is known, its bound is NaN, and the coupling c_wq is unknown in its place. All are NaN
    where the vehicle changes on the way.
    """
    case = dive.case
    if case.is_drifting:
        return np.full(6, np.nan)
    truth = np.concatenate([case.vehicle, dive.trim, dive.start])
    if speed_is_known:
        truth[5] = case.coupling

    def outputs(unknowns: Array) -> Array:
        vehicle, flown = unknowns[:6].copy(), case
        if speed_is_known:
            vehicle[5], flown = case.vehicle[5], replace(case, coupling=float(unknowns[5]))
        states = simulate(flown, vehicle, dive.rudder, unknowns[8:], unknowns[6:8, None])
        return states[2:]

    scale = np.array([case.pitch_noise, case.depth_noise])[:, None]
    present = np.isfinite([dive.pitch, dive.depth])
    # Outputs are smooth in the unknowns and of order one: central differences are exact to ten digits.
    rows = []
    for i in range(truth.size):
        change = np.zeros_like(truth)
        change[i] = RELATIVE_STEP * max(abs(truth[i]), 0.1)
        slope = (outputs(truth + change) - outputs(truth - change)) / (2.0 * change[i])
        rows.append((slope / scale)[present])
    J = np.array(rows)
    size = np.sqrt(np.sum(J**2, axis=1))
    covariance = np.linalg.inv((J / size[:, None]) @ (J / size[:, None]).T) / np.outer(size, size)
    std = np.sqrt(np.diag(covariance))
    if speed_is_known:
        std[5] = np.nan
    return np.asarray(std[:6])
