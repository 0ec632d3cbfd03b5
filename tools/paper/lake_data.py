"""Data for Section 6: a simulated free run, spoilt like a log and cleaned like the paper's.

The vehicle is the SITL plant with the rudder of Table 7: |Zdelta| = rho/2 A V^2 Clr, |Mdelta| = |Zdelta| xR,
largest angle 13 deg. Both are negative here: a positive rudder lifts the stern and pitches the nose down.
"""

from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import median_filter
from scipy.signal import butter, filtfilt, savgol_filter

from host.recordings.recording import Array
from tools.paper.printed import printed
from tools.sitl.effects import Effects
from tools.sitl.excitation import Excitation
from tools.sitl.hull import Hull
from tools.sitl.recording import sail
from tools.sitl.scenario import Scenario, Start

DENSITY = 1000.0  # kg/m^3, lake
SPEED = 2.5  # m/s
STEP = 0.05  # s
CHANNELS = ("w", "q", "theta")
NOISE = {"w": 0.02, "q": radians(0.3), "theta": radians(0.1)}  # m/s, rad/s, rad
OUTLIER = {"w": 0.6, "q": radians(12.0), "theta": radians(8.0)}  # deviation of a wild value
CUTOFF = 1.0  # Hz, of the low-pass
MEDIAN_ROWS, SMOOTH_ROWS, HAMPEL_LIMIT = 5, 11, 3.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One free run. All arrays (N,), by channel w (m/s), q (rad/s), theta (rad).

    rudder   rad, held from each row to the next
    true     what the vehicle did
    logged   with noise, wild values, frozen stretches and gaps (NaN)
    cleaned  wild values and frozen stretches out, gaps bridged, low-passed without phase
    removed  share of rows taken out
    """

    time: Array
    rudder: Array
    true: dict[str, Array]
    logged: dict[str, Array]
    cleaned: dict[str, Array]
    removed: dict[str, float]


def rudder_force() -> tuple[float, float]:
    """Zdelta (N/rad) and Mdelta (N m/rad) from Table 7."""
    t = printed()["table7"]
    force = 0.5 * DENSITY * t["area"] * SPEED**2 * t["lift_coefficient"]
    return -force, -force * t["lever"]


def lake_hull(righting_arm: float = 0.0) -> Hull:
    """The plant's vehicle with this rudder, coupled added masses, and no righting moment unless one is "
    "given (m)."""
    force, moment = rudder_force()
    return Hull(
        zb=righting_arm,
        Zqdot=-3.0,
        Mwdot=-3.0,
        Mw=5.0,
        Zdelta=force / SPEED**2,
        Mdelta=moment / SPEED**2,
    )


def solved_form(hull: Hull) -> Array:
    """(2, 3): d[w, q]/dt = this @ [w, q, delta] without righting moment; what the free run needs."""
    mass = np.array([[hull.mass - hull.Zwdot, -hull.Zqdot], [-hull.Mwdot, hull.Iy - hull.Mqdot]])
    coupling = hull.mass - hull.Xudot + hull.Zq
    force = SPEED * np.array(
        [
            [hull.Zw, coupling, hull.Zdelta * SPEED],
            [hull.Mw, hull.Mq, hull.Mdelta * SPEED],
        ]
    )
    return np.asarray(np.linalg.solve(mass, force))


def trial(seed: int, duration: float = 200.0, *, righting_arm: float = 0.0, spoilt: bool = True) -> Trial:
    """Flies, spoils (unless not wanted) and cleans one run."""
    limit = radians(printed()["table7"]["largest_angle_deg"])
    scenario = Scenario(
        name="lake",
        duration_s=duration,
        step_s=STEP / 5.0,
        start=Start(speed=SPEED),
        hull=lake_hull(righting_arm),
        effects=Effects(heave_pitch_rate_coupling=1.0),
        excitation=Excitation(
            program="multistep",
            amplitude=limit,
            update_s=STEP,
            hold_min_s=0.5,
            hold_max_s=3.0,
            drift_limit=0.2,
        ),
    )
    truth = sail(scenario, seed)
    rows = slice(None, None, 5)
    true = {
        name: truth[column][rows]
        for name, column in (("w", "heave_mps"), ("q", "pitch_rate_radps"), ("theta", "pitch_rad"))
    }
    rng = np.random.default_rng([seed, 6])
    logged = {name: _spoil(name, values, rng) if spoilt else values for name, values in true.items()}
    cleaned, removed = {}, {}
    for name, values in logged.items():
        kept = without_outliers(values) if spoilt else values
        removed[name] = float(np.mean(np.isnan(kept)))
        cleaned[name] = low_pass(bridged(kept))
    return Trial(
        time=truth["time_s"][rows],
        rudder=truth["rudder_rad"][rows],
        true=true,
        logged=logged,
        cleaned=cleaned,
        removed=removed,
    )


def _spoil(name: str, values: Array, rng: np.random.Generator) -> Array:
    """Noise, 1.5 % wild values, four frozen stretches and four gaps of 0.2 to 1 s."""
    spoilt = values + NOISE[name] * rng.standard_normal(values.size)
    wild = rng.random(values.size) < 0.015
    spoilt[wild] += OUTLIER[name] * rng.standard_normal(int(wild.sum()))
    for kind in ("frozen", "gap") * 4:
        at, length = int(rng.integers(50, values.size - 50)), int(rng.integers(4, 20))
        spoilt[at : at + length] = spoilt[at] if kind == "frozen" else np.nan
    return spoilt


def without_outliers(values: Array) -> Array:
    """NaN where a value is frozen (three or more alike) or wild.

    Wild is what lies more than 3.5 robust deviations (Hampel's identifier) off a smooth curve through the
    running median; the median of a few rows takes isolated values out, the cubic smoother follows manoeuvres.
    """
    kept = values.copy()
    alike = np.diff(values, prepend=np.nan) == 0.0
    within = alike & np.append(alike[1:], False)
    frozen: NDArray[np.bool_] = within | np.append(within[1:], False) | np.append(False, within[:-1])
    kept[frozen] = np.nan
    filled = bridged(kept)
    smooth = savgol_filter(median_filter(filled, MEDIAN_ROWS, mode="nearest"), SMOOTH_ROWS, 3)
    off = np.abs(filled - smooth)
    spread = 1.4826 * float(np.median(off[np.isfinite(kept)]))
    kept[off > HAMPEL_LIMIT * spread] = np.nan
    return kept


def bridged(values: Array) -> Array:
    """Gaps filled by monotone cubic interpolation, ends held."""
    known = np.flatnonzero(np.isfinite(values))
    rows = np.arange(values.size)
    filled = PchipInterpolator(known, values[known], extrapolate=False)(np.clip(rows, known[0], known[-1]))
    return np.asarray(filled)


def low_pass(values: Array) -> Array:
    """Butterworth of fourth order, forward and backward: no phase."""
    b, a = butter(4, CUTOFF, fs=1.0 / STEP)
    return np.asarray(filtfilt(b, a, values))


def derivative(values: Array) -> Array:
    """Centred, of fourth order: the error at the cut-off is below 0.1 %."""
    return np.asarray(savgol_filter(values, 5, 4, deriv=1, delta=STEP))
