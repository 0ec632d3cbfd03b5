"""What the bench's maximum likelihood promises, kept or not: bias, deviation, and how often intervals hold.

Dives of the linear vehicle under everything that real ones bring: a steering autopilot, turbulence, waves,
coarse or coloured sensors, missing samples, short dives.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from multiprocessing import get_context
from time import process_time

import numpy as np
from scipy.signal import lfilter

from host.identification.uncertainty import covariance
from host.likelihood.maximum_likelihood import fit_maximum_likelihood
from tools.accuracy.bound import joint_bound
from tools.accuracy.dive import NAMES, Array, Case, Dive, fly, simulate, transition
from tools.accuracy.methods import recording_of
from tools.accuracy.score import Score, score

FIRST_SEED = 9000
LEGS = 30.0  # s between the autopilot's new depths
WAVE_FREQUENCY, WAVE_DAMPING = 1.2, 0.1  # rad/s, ratio: the band of the waves as the vehicle meets them


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """Dives that are identified jointly, and what is special about them; SI units.

    steers    whether an autopilot flies depth steps by what its sensors say
    waves     rms accelerations in heave m/s^2 and pitch rad/s^2 by the waves
    quantum   m, the depth sensor's resolution
    coloured  (standard deviation, correlation time s) of errors of pitch and depth that wander, AR(1)
    """

    case: Case = Case()
    dives: int = 1
    steers: bool = False
    waves: tuple[float, float] = (0.0, 0.0)
    quantum: float = 0.0
    coloured: tuple[tuple[float, float], tuple[float, float]] | None = None

    @property
    def has_bound(self) -> bool:
        """Whether the errors are Gaussian and the sensors' alone, so that the bound is known."""
        return self.waves == self.case.forces == (0.0, 0.0) and self.quantum == 0.0


CAMPAIGNS: dict[str, Campaign] = {
    "open loop, multistep": Campaign(),
    "closed loop, depth steps": Campaign(steers=True),
    "turbulence": Campaign(case=Case(forces=(0.02, 0.02))),
    "waves": Campaign(waves=(0.02, 0.02)),
    "depth in steps of 0.1 m": Campaign(quantum=0.1),
    "depth in steps of 0.1 m, closed loop": Campaign(quantum=0.1, steers=True),
    "errors that wander: pitch 0.1 deg, 1 s; depth 3 cm, 2 s": Campaign(
        coloured=((float(np.deg2rad(0.1)), 1.0), (0.03, 2.0))
    ),
    "5 Hz": Campaign(case=Case(step=0.2)),
    "50 Hz": Campaign(case=Case(step=0.02)),
    "30 % missing": Campaign(case=Case(missing=0.3)),
    "measured speed": Campaign(case=Case(tells_speed=True)),
    "8 dives of 20 s": Campaign(case=Case(duration=20.0), dives=8),
}


def dives_of(campaign: Campaign, seed: int) -> list[Dive]:
    """The dives of one campaign; the same seed gives the same dives."""
    return [_one_dive(campaign, 1000 * seed + k) for k in range(campaign.dives)]


def _one_dive(campaign: Campaign, seed: int) -> Dive:
    case = campaign.case
    dive = fly(case, seed)
    rng = np.random.default_rng([seed, 1])
    if campaign.steers:
        dive = _steered(dive, rng)
    if campaign.waves != (0.0, 0.0):
        pushes = np.array([_wave(rng, case, dive.rudder.size) * rms for rms in campaign.waves])
        moved = simulate(case, np.array(case.vehicle), 0.0 * dive.rudder, np.zeros(4), pushes)
        dive = replace(dive, pitch=dive.pitch + moved[2], depth=dive.depth + moved[3])
    if campaign.coloured is not None:
        errors = [_wander(rng, *which, case.step, dive.rudder.size) for which in campaign.coloured]
        dive = replace(dive, pitch=dive.pitch + errors[0], depth=dive.depth + errors[1])
    if campaign.quantum > 0.0:
        dive = replace(dive, depth=campaign.quantum * np.round(dive.depth / campaign.quantum))
    return dive


def _steered(dive: Dive, rng: np.random.Generator) -> Dive:
    """The same vehicle under a cascaded autopilot that flies depth steps by its noisy sensors."""
    case, rows = dive.case, dive.time.size
    Phi, Gamma = transition(np.array(case.vehicle), case)
    levels = dive.start[3] + rng.uniform(-4.0, 4.0, size=int(case.duration / LEGS) + 1)
    wanted = levels[(dive.time / LEGS).astype(int)]
    noise = rng.normal(size=(2, rows)) * np.array([[case.pitch_noise], [case.depth_noise]])
    rudder, outputs, x = np.empty(rows), np.empty((2, rows)), dive.start
    for k in range(rows):
        outputs[:, k] = x[2:] + noise[:, k]
        steep = np.clip(0.08 * (outputs[1, k] - wanted[k]), -0.25, 0.25)
        rudder[k] = np.clip(1.5 * (outputs[0, k] - steep), -0.35, 0.35)
        x = Phi @ x + Gamma @ np.array([rudder[k], *dive.trim])
    return replace(dive, rudder=rudder, pitch=outputs[0], depth=outputs[1])


def _wave(rng: np.random.Generator, case: Case, rows: int) -> Array:
    """A narrow-band disturbance of unit variance."""
    radius = np.exp(-WAVE_DAMPING * WAVE_FREQUENCY * case.step)
    denominator = [1.0, -2.0 * radius * np.cos(WAVE_FREQUENCY * case.step), radius**2]
    settling = round(60.0 / case.step)
    wave = np.asarray(lfilter([1.0], denominator, rng.normal(size=settling + rows)))[settling:]
    return wave / float(np.std(wave))


def _wander(rng: np.random.Generator, deviation: float, time: float, step: float, rows: int) -> Array:
    kept = np.exp(-step / time)
    kicks = deviation * np.sqrt(1.0 - kept**2) * rng.normal(size=rows)
    kicks[0] = deviation * rng.normal()
    return np.asarray(lfilter([1.0], [1.0, -kept], kicks))


def _identified(job: tuple[str, int]) -> tuple[Array, Array, Array, float]:
    name, seed = job
    campaign = CAMPAIGNS[name]
    dives = dives_of(campaign, seed)
    begun = process_time()
    with np.errstate(all="ignore"):
        fit = fit_maximum_likelihood([recording_of(dive) for dive in dives])
        values, std = fit.parameters[:6].copy(), np.sqrt(np.diag(covariance(fit)))[:6]
    seconds = process_time() - begun
    if campaign.case.tells_speed:
        values[5] = std[5] = np.nan
    bound = joint_bound(dives, campaign.coloured) if campaign.has_bound else np.full(6, np.nan)
    return values, std, bound, seconds


def measure(
    names: list[str], seeds: int, workers: int, on_progress: Callable[[str], None]
) -> Iterator[tuple[str, Score, float]]:
    """Each campaign flown `seeds` times, with the median seconds of one core that a fit took."""
    with get_context("spawn").Pool(workers) as pool:
        for name in names:
            on_progress(name)
            answers = pool.map(_identified, [(name, FIRST_SEED + seed) for seed in range(seeds)], chunksize=1)
            values, stds, bounds, seconds = (np.array(column) for column in zip(*answers, strict=True))
            with np.errstate(all="ignore"):
                scored = score(values, stds, bounds, np.array(CAMPAIGNS[name].case.vehicle))
            yield name, scored, float(np.median(seconds))


def show(name: str, scored: Score, seconds: float) -> str:
    """One campaign as text; the last column is the mean over the parameters."""
    diverged = f", diverged {scored.diverged}" if scored.diverged and CAMPAIGNS[name].has_bound else ""
    text = [
        f"{name} | {scored.dives} times, {seconds:.1f} s each{diverged}",
        f"{'':36s}" + "".join(f"{parameter:>9s}" for parameter in NAMES) + f"{'all':>9s}",
    ]
    for label, row, digits in (
        ("bias %", scored.bias, 2),
        ("deviation / Cramér-Rao bound", scored.efficiency, 2),
        ("stated / actual deviation", scored.honesty, 2),
        ("95 % intervals that hold, %", scored.coverage, 1),
    ):
        overall = np.nanmean(row) if label.startswith("95") else np.nan
        text.append(f"    {label:32s}" + "".join(_number(value, digits) for value in [*row, overall]))
    return "\n".join(text)


def _number(value: float, digits: int) -> str:
    return f"{value:9.{digits}f}" if np.isfinite(value) else f"{'-':>9s}"
