"""A small library of plane movements that any vehicle can fly, scaled to one vehicle and its recording.

Sizes come from the recorded plane angles, which are never exceeded; times from the vehicle's own modes.
3-2-1-1 and doublet are those of flight testing (Jategaonkar, Flight Vehicle System Identification, ch. 2).
"""

from dataclasses import dataclass

import numpy as np

from host.dynamics.equations import NAMES
from host.recordings.recording import Array, Recording

SHORTEST, LONGEST = 60.0, 120.0  # s
HARMONICS = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class Manoeuvre:
    """A plane movement: rad at every step s, and how to say it."""

    name: str
    words: str
    rudder: Array
    step: float

    @property
    def duration(self) -> float:
        return self.rudder.size * self.step


def library(recordings: list[Recording], parameters: Array) -> list[Manoeuvre]:
    """The manoeuvres for a vehicle with these coefficients (base first), as large as it has flown."""
    step = recordings[0].step
    rudder = np.concatenate([recording.rudder for recording in recordings])
    centre = float(np.median(rudder))
    size = float(np.max(np.abs(rudder - centre)))
    if size <= 0.0:
        return []
    a1, a2, a3 = (float(parameters[NAMES.index(name)]) for name in ("a1", "a2", "a3"))
    modes = [abs(pole.real) for pole in np.roots([1.0, -a2, -a3])]
    natural = abs(a3) ** 0.5
    unit = float(np.clip(1.6 / max(natural, 1e-3), 2.0 * step, 6.0))
    settling = float(np.clip(3.0 / max(min(abs(a1), *modes), 1e-3), 4.0, 20.0))
    duration = float(np.clip(6.0 * settling, SHORTEST, LONGEST))

    def steps(*pieces: tuple[float, float]) -> Array:
        """(share of the size, s) pieces, repeated with the sign turned until the time is full."""
        once = np.concatenate([np.full(max(1, round(time / step)), share) for share, time in pieces])
        rows = round(duration / step)
        twice = np.concatenate([once, -once])
        return np.asarray(centre + size * np.tile(twice, -(-rows // twice.size))[:rows])

    has_angle = recordings[0].has_angle

    def angle(value: float) -> str:
        return f"{np.degrees(value):.1f} deg" if has_angle else f"{value:.3g} as recorded"

    large, half, small = angle(size), angle(0.5 * size), angle(0.3 * size)
    about = f" about {angle(centre)}" if abs(centre) > 0.02 * size else ""
    side = 2.0 * unit
    rest = (0.0, max(unit, 0.5 * settling))
    growing = [piece for share in (0.25, 0.5, 0.75, 1.0) for piece in _doublet(share, side, rest)]
    reversals = ((1.0, 3.0 * unit), (-1.0, 2.0 * unit), (1.0, unit), (-1.0, unit), rest)
    multisine = np.asarray(centre + size * _multisine(settling, natural, duration, step))
    third = duration / 3.0
    flown = (
        ("3-2-1-1", f"of {large}, {unit:.1f} s a unit", steps(*reversals)),
        ("small doublets", f"of {small}, {side:.1f} s a side", steps(*_doublet(0.3, side, rest))),
        ("large doublets", f"of {large}, {side:.1f} s a side", steps(*_doublet(1.0, side, rest))),
        ("growing doublets", f"of up to {large}, {side:.1f} s a side", steps(*growing)),
        (
            "slow steps",
            f"of {half} and {large}, {settling:.0f} s each",
            steps((0.5, settling), (-1.0, settling), (0.0, settling)),
        ),
        ("multisine", f"of up to {large}", multisine),
        ("held plane angle", f"of {large}, {third:.0f} s", steps((1.0, third), (0.0, 0.5 * third))),
        ("level run", "with the planes still", steps((0.0, duration))),
    )
    return [
        Manoeuvre(name=name, words=f"{name} {how}{about}", rudder=rows, step=step)
        for name, how, rows in flown
    ]


def _doublet(share: float, side: float, rest: tuple[float, float]) -> list[tuple[float, float]]:
    return [(share, side), (-share, side), rest]


def _multisine(settling: float, natural: float, duration: float, step: float) -> Array:
    """Harmonics from the settling to twice the pitch mode, with Schroeder's phases; largest value 1."""
    time = np.arange(round(duration / step)) * step
    highest = min(natural / np.pi, 0.2 / step)
    frequencies = np.geomspace(0.5 / settling, max(highest, 1.0 / settling), HARMONICS)
    phases = -np.pi * np.arange(HARMONICS) * np.arange(1, HARMONICS + 1) / HARMONICS
    wave = np.sum(np.sin(2.0 * np.pi * frequencies[:, None] * time + phases[:, None]), axis=0)
    return np.asarray(wave / np.max(np.abs(wave)))
