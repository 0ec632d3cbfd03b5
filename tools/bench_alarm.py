"""`python -m tools.bench_alarm`: how soon `mils run` tells of a change, what it names, and its false alarms.

Simulated dives in rough sea (and in calm water) go sample by sample through the live estimator and the alarm.
At a set time the dive is copied, and each copy suffers one fault, of the size that doubles the prediction
error: over the 30 s after it, that of pitch or depth is twice what it would have been and twice its usual.
With `--diagnose` each dive with an alarm goes on for five minutes and is diagnosed as its journal would be.
"""

import argparse
import copy
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from firmware_model.config import EstimatorConfig
from firmware_model.estimator import make_estimator
from firmware_model.sample import Sample
from host.diagnosis.recordings.around import LONGEST_SIDE, around_alarm
from host.live.mismatch import Mismatch, MismatchConfig, MismatchWatch
from host.live.prediction_window import PredictionWindow
from host.live.reference import Array, Reference
from host.recordings.recording import Recording
from tools.sitl.effects import Timed
from tools.sitl.excitation import Excitation
from tools.sitl.plant import Plant, stream
from tools.sitl.scenario import Scenario, load
from tools.sitl.sensors import Instrument

STEP = 0.1  # s, of the samples
PLANT_STEP = 0.05  # s, of the integrator
VOYAGE = 3.0  # h, after which another dive begins in the null run
ONSET = 2400.0  # s, of a fault
ALLOWED = 30.0  # s, from the fault to the alarm
HORIZON = 10.0  # s, of the free runs by which a fault is sized
LEVELS = np.array([0.00175, 0.01])  # rad, m


class Dive:
    """The simulated vehicle as samples on the grid; a copy of it goes on by itself."""

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.plant = Plant(scenario, seed)
        sensors = scenario.sensors
        self._channels = {
            name: Instrument(replace(getattr(sensors, name), jitter_s=0.0), stream(seed, name))
            for name in ("depth", "pitch")
        }

    def sample(self) -> Sample:
        """The next instant."""
        for _ in range(round(STEP / self.plant.step_s)):
            now = self.plant.step()
        values = {
            name: float("nan")
            if instrument.loses(now.t_s)
            else instrument.read(getattr(now, f"sensed_{name}"))
            for name, instrument in self._channels.items()
        }
        return Sample(t_us=round(now.t_s / STEP) * round(1e6 * STEP), rudder=now.command, **values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """What happens to the plant, by its size; `slots` are the honest answers."""

    happens: Callable[[Plant, float], None]
    largest: float
    unit: str
    slots: tuple[str, ...]


def _lose_fin(plant: Plant, size: float) -> None:
    loss = Timed(size=size, at_s=plant.now.t_s)
    plant.actuator.effects = replace(plant.actuator.effects, rudder_effectiveness_change=loss)


def _catch_weed(plant: Plant, size: float) -> None:
    _lose_fin(plant, size)
    own = plant.hydrodynamics
    own.hull = replace(own.hull, Xuu=own.hull.Xuu * (1.0 + size))


def _drop_ballast(plant: Plant, size: float) -> None:
    plant.hydrodynamics.ballast = Timed(size=-size, at_s=plant.now.t_s)


def _enter_current(plant: Plant, size: float) -> None:
    plant.sea.current += size
    plant.sea.is_still = False


def _shift_trim(plant: Plant, size: float) -> None:
    plant.hydrodynamics.trim += size


FAULTS = {
    "fin damage": Fault(happens=_lose_fin, largest=0.95, unit="share of force", slots=("actuator",)),
    "weed on the plane": Fault(
        happens=_catch_weed, largest=0.95, unit="share of force", slots=("actuator", "surge")
    ),
    "ballast drop": Fault(happens=_drop_ballast, largest=8.0, unit="kg", slots=("heave",)),
    "current": Fault(happens=_enter_current, largest=0.8, unit="m/s", slots=("heave", "environment")),
    "trim shift": Fault(happens=_shift_trim, largest=8.0, unit="N m", slots=("pitch",)),
}


def scenario_of(name: str) -> Scenario:
    """The rough sea as shipped; or calm water with the same autopilot and the default vehicle."""
    base = load("rough_sea" if name == "rough" else "default")
    autopilot = load("rough_sea").excitation
    calm: Excitation = replace(autopilot, dither=0.1)
    return replace(base, step_s=PLANT_STEP, duration_s=0.0, excitation=autopilot if name == "rough" else calm)


class Crew:
    """The live estimator and the alarm, as `mils run` joins them; `alarms` is how many it raised."""

    def __init__(self, speed: float = 2.5) -> None:
        config = EstimatorConfig(step=STEP, speed=speed)
        self.estimator = make_estimator(config)
        self.watch = MismatchWatch(MismatchConfig(), config)
        self.alarms = 0

    def take(self, sample: Sample) -> Mismatch | None:
        self.estimator.update(sample)
        alarm = self.watch.push(sample, self.estimator.estimate() if self.watch.wants_estimate else None)
        self.alarms += alarm is not None
        return alarm


def errors(dive: Dive, window: PredictionWindow, reference: Reference, seconds: float) -> Array:
    """Rms prediction error of pitch and depth over the free runs that end within so many seconds."""
    found = []
    for k in range(round(seconds / STEP)):
        window.push(dive.sample())
        if k % 10 == 9 and k >= 50 and window.is_full:
            found.append(window.errors(reference, LEVELS))
    rms: Array = np.sqrt(np.mean(np.square(found), axis=0))
    return rms


def size_of(
    fault: Fault, dive: Dive, window: PredictionWindow, reference: Reference, usual: Array
) -> float | None:
    """The size that doubles the prediction error; None if even the largest does not."""

    def ratio(size: float) -> float:
        struck = copy.deepcopy(dive)
        if size:
            fault.happens(struck.plant, size)
        return float((errors(struck, copy.deepcopy(window), reference, ALLOWED) / usual).max())

    usual = np.maximum(usual, errors(copy.deepcopy(dive), copy.deepcopy(window), reference, ALLOWED))
    low, high = 0.0, fault.largest
    if ratio(high) < 2.0:
        return None
    for _ in range(7):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if ratio(middle) > 2.0 else (middle, high)
    return high


@dataclass(frozen=True, slots=True, kw_only=True)
class Strike:
    """One fault: its size, None where none doubles the error; the delay of the alarm, s; what it told.

    recording  the dive around the alarm, if that is wanted
    """

    title: str
    size: float | None = None
    delay: float | None = None
    alarm: Mismatch | None = None
    recording: Recording | None = None


def strike(
    dive: Dive, crew: Crew, faults: Mapping[str, Fault] = FAULTS, records: bool = False
) -> Iterator[Strike]:
    """Each fault in one dive."""
    past: deque[Sample] = deque(maxlen=round(LONGEST_SIDE / STEP))
    window = PredictionWindow(round(HORIZON / STEP), STEP)
    found = []
    for k in range(round(ONSET / STEP)):
        sample = dive.sample()
        past.append(sample)
        crew.take(sample)
        window.push(sample)
        reference = crew.watch.reference
        if reference is not None and k % 10 == 0 and k > 0.5 * ONSET / STEP and window.is_full:
            found.append(window.errors(reference, LEVELS))
    reference = crew.watch.reference
    if reference is None or not found:
        raise SystemExit(f"nothing was learnt in {ONSET:g} s before the fault")
    usual = np.sqrt(np.mean(np.square(found), axis=0))
    for title, fault in faults.items():
        size = size_of(fault, dive, window, reference, usual)
        if size is None:
            yield Strike(title=title)
            continue
        struck, watching = copy.deepcopy(dive), copy.deepcopy(crew)
        fault.happens(struck.plant, size)
        alarm, samples = None, list(past)
        begun = struck.plant.now.t_s
        while alarm is None and struck.plant.now.t_s < begun + 2.0 * ALLOWED:
            samples.append(struck.sample())
            alarm = watching.take(samples[-1])
        if alarm is None:
            yield Strike(title=title, size=size)
            continue
        delay, recording = struck.plant.now.t_s - begun, None
        if records:
            samples += [struck.sample() for _ in range(round(LONGEST_SIDE / STEP))]
            recording = recorded(samples, alarm.t_us)
        yield Strike(title=title, size=size, delay=delay, alarm=alarm, recording=recording)


def recorded(samples: Iterable[Sample], alarm_us: int) -> Recording:
    """The samples as a journal with an alarm is read, on the clock of the vehicle."""
    table = np.array([[s.t_us * 1e-6, s.depth, s.pitch, s.rudder] for s in samples]).T
    nan = np.full(table.shape[1], np.nan)
    return Recording(
        name="alarm", sha256="", time=table[0], depth=table[1], pitch=table[2], rudder=table[3], speed=nan,
        pitch_rate=nan, step=STEP, alarms=(alarm_us * 1e-6,),
    )  # fmt: skip


def diagnosed(recording: Recording) -> str:
    """What `mils diagnose` says of it: the verdict, the effects, and in brackets what could be instead."""
    from host.diagnosis.diagnose import diagnose

    found = diagnose(around_alarm([recording]), jobs=2)
    said = []
    for effect in found.effects:
        value, std, unit = next(iter(effect.coefficients.values()), (np.nan, np.nan, ""))
        twins = f" (or {', '.join(effect.twins)})" if effect.twins else ""
        said.append(f"{effect.name} {value:+.3g} +- {std:.2g} {unit}{twins}")
    return "; ".join([found.verdict, *said])


def false_alarms(hours: float, seed: int) -> Iterator[tuple[float, Mismatch]]:
    """Hour and alarm, in rough sea in which nothing happens."""
    begun = 0.0
    while begun < hours:
        dive, crew = Dive(scenario_of("rough"), seed), Crew()
        length = min(VOYAGE, hours - begun)
        for k in range(round(3600.0 * length / STEP)):
            alarm = crew.take(dive.sample())
            if alarm is not None:
                yield begun + k * STEP / 3600.0, alarm
        begun, seed = begun + length, seed + 1


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hours", type=float, default=24.0, help="of rough sea without a fault (default 24)")
    parser.add_argument("--seas", type=int, default=10, help="dives with faults, each water (default 10)")
    parser.add_argument("--seed", type=int, default=1, help="of the first dive (default 1)")
    parser.add_argument("--diagnose", action="store_true", help="what the bench makes of each alarm, as well")
    args = parser.parse_args()
    for name in ("calm", "rough"):
        print(f"{name}: fault, size that doubles the prediction error, delay, slot named", flush=True)
        told: dict[str, list[float]] = {title: [] for title in FAULTS}
        named: dict[str, int] = dict.fromkeys(FAULTS, 0)
        invisible = 0
        for seed in range(args.seed, args.seed + args.seas):
            for struck in strike(Dive(scenario_of(name), seed), Crew(), records=args.diagnose):
                title, size, delay, alarm = struck.title, struck.size, struck.delay, struck.alarm
                if size is None:
                    invisible += 1
                    continue
                fault = FAULTS[title]
                told[title].append(np.inf if delay is None else delay)
                named[title] += alarm is not None and alarm.slot in fault.slots
                said = (
                    "no alarm in 60 s"
                    if alarm is None
                    else f"{delay:4.1f} s  {' or '.join((alarm.slot, *alarm.others))}, {alarm.change}"
                )
                print(f"    {seed:3d}  {title:18s} {size:7.3f} {fault.unit:15s} {said}", flush=True)
                if struck.recording is not None:
                    print(f"         {diagnosed(struck.recording)}", flush=True)
        for title, delays in told.items():
            if delays:
                in_time = sum(delay <= ALLOWED for delay in delays)
                print(
                    f"  {title:18s} told within {ALLOWED:g} s {in_time}/{len(delays)}, "
                    f"median delay {np.median(delays):.1f} s, slot right {named[title]}/{len(delays)}"
                )
        if invisible:
            print(f"  {invisible} faults left out: at no size did they double the error within {ALLOWED:g} s")
    if args.hours > 0.0:
        alarms = 0
        for hour, alarm in false_alarms(args.hours, args.seed + 1000):
            alarms += 1
            print(f"  false alarm after {hour:.2f} h: {alarm.sentence}", flush=True)
        print(f"rough sea without a fault: {alarms} false alarms in {args.hours:g} h")
    return 0


if __name__ == "__main__":
    sys.exit(main())
