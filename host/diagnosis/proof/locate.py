"""Where the mismatch sits: when, at which frequencies, in which region of operation."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import periodogram
from scipy.stats import spearmanr

from host.diagnosis.fits.first_guess import smoothed_motion
from host.recordings.recording import Array, Recording

WINDOWS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Location:
    """Spans (start, end, share of the excess) in s, the region in words, the band in Hz."""

    intervals: list[tuple[float, float, float]]
    region: str
    band: tuple[float, float]


def locate(recording: Recording, errors: Array, floor: Array, speed: float) -> Location:
    """Reads off the base model's free-run errors (2, N) what lies above the noise floor (2,)."""
    excess = np.nansum(np.maximum(errors**2 / floor[:, None] - 1.0, 0.0), axis=0)
    return Location(
        intervals=_intervals(recording.time, excess),
        region=_region(recording, errors, floor, speed),
        band=_band(errors / np.sqrt(floor)[:, None], recording.step),
    )


def _intervals(time: Array, excess: Array) -> list[tuple[float, float, float]]:
    """Windows that hold more than their share, neighbours joined."""
    total = float(excess.sum())
    if total <= 0.0:
        return []
    edges = np.linspace(time[0], time[-1], WINDOWS + 1)
    shares = np.histogram(time, bins=edges, weights=excess)[0] / total
    spans: list[tuple[float, float, float]] = []
    for start, end, share in zip(edges[:-1], edges[1:], shares, strict=True):
        if share < 1.3 / WINDOWS:
            continue
        if spans and abs(spans[-1][1] - start) < 1e-9:
            first, _, before = spans.pop()
            spans.append((first, float(end), before + float(share)))
        else:
            spans.append((float(start), float(end), float(share)))
    return spans


def _region(recording: Recording, errors: Array, floor: Array, speed: float) -> str:
    """The quantity whose size goes best with the growth of the error, and from where on."""
    motion = smoothed_motion(recording, speed)
    width = max(1.0, 1.0 / recording.step)
    growth = np.zeros(recording.time.size)
    for error, variance in zip(errors, floor, strict=True):
        filled = np.where(np.isfinite(error), error, 0.0)
        growth += gaussian_filter1d(filled, width, order=1) ** 2 / variance
    quantities = {
        "pitch": (np.degrees(np.abs(motion["theta"])), "deg"),
        "heave velocity": (np.abs(motion["w"]), "m/s"),
        "pitch rate": (np.degrees(np.abs(motion["q"])), "deg/s"),
        "plane angle": (np.degrees(np.abs(motion["delta"])), "deg"),
        "plane rate": (
            np.degrees(np.abs(gaussian_filter1d(recording.rudder, width, order=1))) / recording.step,
            "deg/s",
        ),
        "depth": (motion["zeta"], "m"),
    }
    strongest, relation, text = "", 0.0, ""
    for name, (values, unit) in quantities.items():
        if np.ptp(values) <= 0.0 or np.ptp(growth) <= 0.0:
            continue
        rho = float(spearmanr(values, growth).statistic)
        if abs(rho) > abs(relation):
            strongest, relation = name, rho
            heavy = values[growth >= np.quantile(growth, 0.8)]
            text = f"{np.quantile(heavy, 0.25):.2g} to {np.quantile(heavy, 0.75):.2g} {unit}"
    if abs(relation) < 0.15:
        return "no region of operation stands out"
    side = "large" if relation > 0 else "small"
    return f"the error grows at {side} {strongest} (mostly {text}; rank correlation {relation:+.2f})"


def _band(normalised: Array, step: float) -> tuple[float, float]:
    """The frequencies between which the middle 80 % of the excess power lies."""
    power = 0.0
    frequencies = np.zeros(1)
    for error in normalised:
        frequencies, density = periodogram(np.where(np.isfinite(error), error, 0.0), 1.0 / step)
        power = power + np.maximum(density - 2.0 * step, 0.0)
    total = np.cumsum(power)
    if total[-1] <= 0.0:
        return (0.0, 0.0)
    low, high = np.searchsorted(total, np.array([0.1, 0.9]) * total[-1])
    return (float(frequencies[low]), float(frequencies[min(high, frequencies.size - 1)]))
