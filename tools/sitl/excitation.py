"""Programs that command the stern plane."""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import cycle, pairwise
from math import inf, isfinite, pi, sin, sqrt
from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from tools.sitl.errors import ScenarioError
from tools.sitl.strict import require

Program = Literal["none", "multistep", "3211", "multisine", "sine", "doublets", "depth_steps", "csv"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Excitation:
    """What the autopilot does with the plane.

    none         holds the plane at zero
    multistep    random levels within the amplitude, each held for a random time
    3211         steps of 3, 2, 1 and 1 pulses with alternating sign, then a rest
    doublets     one pulse to each side, then a rest
    sine         one frequency
    multisine    `tones` frequencies spread evenly in the logarithm over the band, random phases
    depth_steps  a depth autopilot that is given a new depth now and then (closed loop)
    csv          the columns time_s and rudder_rad of a file, each value held until the next
    """

    program: Program = "multistep"
    amplitude: float = 0.25  # rad; depth_steps: the limit of the command
    start_s: float = 0.0  # zero command before
    update_s: float = 0.1  # the command changes only at multiples of this
    quantum: float = 0.001  # rad, resolution of the command (1 us of servo pulse); 0 for none
    hold_min_s: float = 1.0  # multistep
    hold_max_s: float = 8.0
    drift_limit: float = (
        2.0  # rad s; multistep steers the integral of the command back beyond this; 0 for never
    )
    pulse_s: float = 2.0  # 3211, doublets: the unit of time
    rest_s: float = 10.0  # between two manoeuvres
    frequency_hz: float = 0.05  # sine
    band_low_hz: float = 0.02  # multisine
    band_high_hz: float = 1.0
    tones: int = 12
    depth_step: float = 2.0  # m, depth_steps: the set point goes up and down by random shares of this
    depth_hold_s: float = 20.0
    depth_gain: float = 0.15  # rad of pitch per m of depth error
    pitch_gain: float = 1.2  # rad of plane per rad of pitch error
    rate_gain: float = 0.3  # s, rad of plane per rad/s
    dither: float = 0.0  # rad, random binary signal added to depth_steps
    file: str = ""  # csv

    def __post_init__(self) -> None:
        for name in ("update_s", "pulse_s", "frequency_hz", "band_low_hz", "depth_hold_s"):
            require(getattr(self, name) > 0.0, name, "be > 0", getattr(self, name))
        for name in ("amplitude", "start_s", "quantum", "drift_limit", "rest_s", "dither"):
            require(getattr(self, name) >= 0.0, name, "be >= 0", getattr(self, name))
        require(self.hold_min_s >= self.update_s, "hold_min_s", "be >= update_s", self.hold_min_s)
        require(self.hold_max_s >= self.hold_min_s, "hold_max_s", "be >= hold_min_s", self.hold_max_s)
        require(self.band_high_hz > self.band_low_hz, "band_high_hz", "be > band_low_hz", self.band_high_hz)
        require(self.tones >= 1, "tones", "be >= 1", self.tones)
        require(
            (self.program == "csv") == bool(self.file), "file", 'be given with program "csv" only', self.file
        )


class Law(Protocol):
    """One program at work."""

    def __call__(self, t_s: float, depth: float, pitch: float, pitch_rate: float) -> float:
        """Command, rad, at a time after the start; called with rising times."""


class _Levels:
    """Levels held one after the other; the time runs from 0."""

    def __init__(self, levels: Iterator[tuple[float, float]]) -> None:
        self.levels = levels  # (seconds, rad)
        self.until = 0.0
        self.level = 0.0

    def __call__(self, t_s: float, depth: float, pitch: float, pitch_rate: float) -> float:  # noqa: ARG002
        while t_s > self.until - 1e-9:
            held, self.level = next(self.levels, (inf, self.level))
            self.until += held
        return self.level


class _Tones:
    """A sum of sines."""

    def __init__(self, amplitude: float, tones: list[tuple[float, float]]) -> None:
        self.amplitude = amplitude / sqrt(len(tones))
        self.tones = tones  # (Hz, rad)

    def __call__(self, t_s: float, depth: float, pitch: float, pitch_rate: float) -> float:  # noqa: ARG002
        return self.amplitude * sum(sin(2 * pi * hertz * t_s + phase) for hertz, phase in self.tones)


class _DepthAutopilot:
    """Depth error to wanted pitch to plane; each depth is a random share of the step away from the first."""

    def __init__(self, excitation: Excitation, start_depth: float, rng: np.random.Generator) -> None:
        self.settings = excitation
        self.start = self.wanted = start_depth
        self.rng = rng
        self.next_change = excitation.depth_hold_s / 2
        self.dither = 0.0

    def __call__(self, t_s: float, depth: float, pitch: float, pitch_rate: float) -> float:
        settings = self.settings
        if t_s > self.next_change - 1e-9:
            self.next_change += settings.depth_hold_s
            self.wanted = self.start + settings.depth_step * self.rng.uniform(-1.0, 1.0)
        if settings.dither > 0.0 and self.rng.random() < settings.update_s:  # flips once a second on average
            self.dither = settings.dither if self.rng.random() < 0.5 else -settings.dither
        wanted_pitch = min(max(settings.depth_gain * (depth - self.wanted), -0.4), 0.4)
        return settings.pitch_gain * (pitch - wanted_pitch) + settings.rate_gain * pitch_rate + self.dither


def _multistep(excitation: Excitation, rng: np.random.Generator) -> Iterator[tuple[float, float]]:
    drift = 0.0
    while True:
        held = rng.uniform(excitation.hold_min_s, excitation.hold_max_s)
        held = round(held / excitation.update_s) * excitation.update_s
        level = rng.uniform(-excitation.amplitude, excitation.amplitude)
        if 0.0 < excitation.drift_limit < abs(drift) and drift * level > 0.0:
            level = -level
        drift += held * level
        yield held, level


def _read_csv(path: Path) -> list[tuple[float, float]]:
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = [(float(row["time_s"]), float(row["rudder_rad"])) for row in csv.DictReader(file)]
    except (OSError, UnicodeError, csv.Error) as error:
        raise ScenarioError(f"excitation.file cannot be read: {path}: {error}") from error
    except (KeyError, TypeError, ValueError) as error:
        raise ScenarioError(
            f"excitation.file {path} must have numbers in time_s and rudder_rad ({error})"
        ) from error
    require(bool(rows), "excitation.file", "hold at least one row", str(path))
    finite = all(isfinite(t_s) and isfinite(level) for t_s, level in rows)
    require(finite, "excitation.file", "hold finite numbers", str(path))
    in_order = all(later[0] > earlier[0] for earlier, later in pairwise(rows))
    require(in_order, "excitation.file", "have rising time_s", str(path))
    return [(later[0] - earlier[0], earlier[1]) for earlier, later in pairwise([*rows, (inf, 0.0)])]


def make_law(excitation: Excitation, start_depth: float, folder: Path, rng: np.random.Generator) -> Law:
    """The program that `excitation` names; `folder` is where a relative file is looked for.

    Raises ScenarioError when the file cannot be used.
    """
    amplitude, pulse, rest = excitation.amplitude, excitation.pulse_s, excitation.rest_s
    match excitation.program:
        case "none":
            return _Levels(iter(()))
        case "multistep":
            return _Levels(_multistep(excitation, rng))
        case "3211":
            signs = ((3 * pulse, amplitude), (2 * pulse, -amplitude), (pulse, amplitude), (pulse, -amplitude))
            mirrored = tuple((held, -level) for held, level in signs)
            return _Levels(cycle((*signs, (rest, 0.0), *mirrored, (rest, 0.0))))
        case "doublets":
            return _Levels(cycle(((pulse, amplitude), (pulse, -amplitude), (rest, 0.0))))
        case "sine":
            return _Tones(amplitude, [(excitation.frequency_hz, 0.0)])
        case "multisine":
            hertz = np.geomspace(excitation.band_low_hz, excitation.band_high_hz, excitation.tones)
            return _Tones(amplitude, [(float(tone), float(rng.uniform(0.0, 2 * pi))) for tone in hertz])
        case "depth_steps":
            return _DepthAutopilot(excitation, start_depth, rng)
        case "csv":
            return _Levels(iter(_read_csv(folder / excitation.file)))


class Commander:
    """The law with its start, its limit and its resolution."""

    def __init__(self, excitation: Excitation, law: Law) -> None:
        self.excitation = excitation
        self.law = law

    def command(self, t_s: float, depth: float, pitch: float, pitch_rate: float) -> float:
        """Plane command, rad, in force from `t_s` until the next update."""
        settings = self.excitation
        since = t_s - settings.start_s
        if since < -1e-9:
            return 0.0
        wanted = self.law(since, depth, pitch, pitch_rate)
        if settings.program == "depth_steps":
            wanted = min(max(wanted, -settings.amplitude), settings.amplitude)
        return round(wanted / settings.quantum) * settings.quantum if settings.quantum > 0.0 else wanted
