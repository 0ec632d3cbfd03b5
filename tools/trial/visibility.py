"""Whether a hidden effect can be seen at all, and beside another."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from tools.sitl.errors import ScenarioError
from tools.sitl.recording import measure
from tools.sitl.scenario import Scenario
from tools.trial.hidden import Hidden, Setting, with_strength
from tools.trial.linear import MORE, NAMES, STATE, free_run
from tools.trial.logger import Logger
from tools.trial.outing import Outing
from tools.trial.refit import foretold, remaining
from tools.trial.voyage import Voyage, sail

Array = npt.NDArray[np.float64]

MOST_PITCH = 1.0  # rad; no vehicle of this kind goes further
LEAST_DEPTH = 1.0  # m, or the hull would leave the water
WAVE_BAND_HZ = 0.02  # over which a sea's spectrum is taken for smooth


@dataclass(frozen=True, slots=True, kw_only=True)
class Yardstick:
    """Noise deviations (rad, m) and which samples arrive: what misfits of one recording are measured in."""

    pitch_noise: float
    depth_noise: float
    has_pitch: npt.NDArray[np.bool_]
    has_depth: npt.NDArray[np.bool_]
    pitch_hearing: Array | None = None
    depth_hearing: Array | None = None
    """Noise over noise and waves, at each frequency: waves hide misfits, as nobody knows their course."""

    def residual(self, pitch: Array, depth: Array, truth: Voyage) -> Array:
        """Differences to the truth over the noise, 0 where none arrived; the last axis runs over samples."""
        pitch_off = np.where(self.has_pitch, (pitch - truth.pitch) / self.pitch_noise, 0.0)
        depth_off = np.where(self.has_depth, (depth - truth.depth) / self.depth_noise, 0.0)
        heard = [_heard(self.pitch_hearing, pitch_off), _heard(self.depth_hearing, depth_off)]
        return np.concatenate(heard, axis=-1)

    def among_waves(self, sea: Voyage, calm: Voyage, rate_hz: float) -> "Yardstick":
        """The same instruments in waves, which are all that the two runs differ in."""
        return replace(
            self,
            pitch_hearing=_hearing((sea.pitch - calm.pitch) / self.pitch_noise, rate_hz),
            depth_hearing=_hearing((sea.depth - calm.depth) / self.depth_noise, rate_hz),
        )


def _hearing(waves: Array, rate_hz: float) -> Array:
    """1 / sqrt(1 + S), S the spectrum of waves over that of white noise of unit deviation, smoothed."""
    rows = len(waves)
    window = np.hanning(rows)  # or the ends of strong waves would be taken for waves of every frequency
    spectrum = np.abs(np.fft.rfft(window * (waves - waves.mean()), 2 * rows)) ** 2 / float(window @ window)
    width = 2 * round(WAVE_BAND_HZ * rows / rate_hz) + 1
    return np.asarray(1.0 / np.sqrt(1.0 + np.convolve(spectrum, np.full(width, 1.0 / width), "same")))


def _heard(hearing: Array | None, misfit: Array) -> Array:
    """Filtered without delay, into twice as many rows; the sum of squares is the chi2 in noise and waves."""
    if hearing is None:
        return misfit
    rows = 2 * misfit.shape[-1]
    return np.asarray(np.fft.irfft(np.fft.rfft(misfit, rows) * hearing, rows))


def yardstick(scenario: Scenario, seed: int, voyage: Voyage, logger: Logger | None = None) -> Yardstick:
    """For the instruments of a scenario, and what their logger keeps."""
    table = measure(scenario, seed, voyage.table)
    if logger is not None:
        table = logger.readings(table)
    rows = np.round(table["time_s"] * scenario.sensors.depth.rate_hz).astype(int)
    arrived = np.zeros((2, len(voyage.pitch)), dtype=bool)
    arrived[0, rows] = np.isfinite(table["pitch_rad"])
    arrived[1, rows] = np.isfinite(table["depth_m"])
    deviations = [
        float(np.hypot(channel.noise, channel.quantum / 12**0.5))
        for channel in (scenario.sensors.pitch, scenario.sensors.depth)
    ]
    return Yardstick(
        pitch_noise=deviations[0], depth_noise=deviations[1], has_pitch=arrived[0], has_depth=arrived[1]
    )


def is_ordinary(voyage: Voyage) -> bool:
    """Whether such a run could have been recorded."""
    deep = voyage.table["depth_m"].min() > LEAST_DEPTH
    return bool(deep and np.abs(voyage.table["pitch_rad"]).max() < MOST_PITCH)


def linear_misfit(
    voyage: Voyage, outing: Outing, setting: Setting, noise: Yardstick, with_more: bool = False
) -> float:
    """What the paper's linear equations cannot follow, with their best coefficients.

    with_more    all linear equations with constant forces: what is foreign must not be mistaken for those
    """
    start = outing.scenario.start
    state = [getattr(start, name) for name in STATE]
    known = list(setting.vehicle.coefficients.values())
    first = np.array([*known, *state, *(0.0 for _ in MORE)])
    steps = np.array([*(1e-4 * abs(value) for value in known), 1e-4, 1e-4, 1e-4, 1e-3, *(1e-4 for _ in MORE)])
    free = np.array(
        [name != "u0" or not outing.has_speed for name in NAMES]
        + [True] * len(STATE)
        + [with_more] * len(MORE)
    )
    speed = voyage.speed if outing.has_speed else None

    def model(sets: Array) -> Array:
        whole = np.repeat(first[None, :], len(sets), axis=0)
        whole[:, free] = sets
        with np.errstate(over="ignore", invalid="ignore"):
            pitch, depth = free_run(whole, voyage.command, 1.0 / outing.rate_hz, speed)
            return noise.residual(pitch, depth, voyage)

    return remaining(model, first[free], steps[free])


def misfit_beside(
    voyage: Voyage,
    outing: Outing,
    seed: int,
    others: tuple[Hidden, ...],
    setting: Setting,
    noise: Yardstick,
    least: float,
    unneeded: tuple[Hidden, ...] = (),
) -> float:
    """What a vehicle of the same kind with only `others` hidden cannot follow, with its best coefficients.

    Gives up below `least`, as such an effect will not be used.

    The coefficients are shares of the hull's derivatives, the speed where it is not measured, the start, and
    the strength of the others.

    unneeded    effects that do not act, but might explain those that do
    """
    hull, start = outing.scenario.hull, outing.scenario.start
    derivatives = setting.vehicle.derivatives
    speeds = () if outing.has_speed else ("speed",)
    first = np.array(
        [1.0] * (len(derivatives) + len(speeds) + len(others))
        + [0.0] * len(unneeded)
        + [getattr(start, name) for name in STATE]
    )
    steps = np.full(len(first), 1e-3)

    def run(values: Array) -> Array:
        shares = iter(values.tolist())
        changed_hull = replace(hull, **{name: getattr(hull, name) * next(shares) for name in derivatives})
        changed = {name: getattr(start, name) * next(shares) for name in speeds}
        scaled = tuple(with_strength(other, other.strength * next(shares)) for other in (*others, *unneeded))
        changed |= {name: next(shares) for name in STATE}
        scenario = replace(outing.scenario, hull=changed_hull, start=replace(start, **changed))
        other_run = sail(scenario, seed, scaled, setting, voyage.command)
        return noise.residual(other_run.pitch, other_run.depth, voyage)

    lost = len(noise.residual(voyage.pitch, voyage.depth, voyage))

    def model(sets: Array) -> Array:
        rows = []
        for values in sets:
            try:
                rows.append(run(values))
            except (ScenarioError, OverflowError):
                rows.append(np.full(lost, np.inf))
        return np.array(rows)

    if setting.vehicle.is_whole:
        return foretold(model, first, steps, least)
    return remaining(model, first, steps, least=least, is_dear=True)
