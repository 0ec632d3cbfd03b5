"""`python -m tools.bench_alarm_fleet`: the live alarm on vehicles that it has never met, in calm water.

Every second dive is of a published vehicle, the others are of linear ones, drawn as in the blind trial with
their manoeuvres and sensors. Each suffers the faults of `tools.bench_alarm`, scaled to its hull. An alarm
before them is a false one.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from tools.bench_alarm import ALLOWED, FAULTS, STEP, Crew, Dive, Fault, strike
from tools.sitl.errors import ScenarioError
from tools.sitl.scenario import Scenario
from tools.trial.draw import sized_to_pitch
from tools.trial.hidden import Setting, switched
from tools.trial.outing import LONGEST_STEP, draw_outing
from tools.trial.published import SLOW_STEP, draw_published, draw_servo
from tools.trial.vehicle import Vehicle, draw_vehicle
from tools.trial.visibility import is_ordinary

KINDS = ("published", "linear")
ENDLESS = "multistep"  # a program whose dive cannot be copied while it goes on
MOST_BALLAST, MOST_CURRENT, MOST_TRIM = 0.1, 0.5, 0.6  # of the mass, of the speed, rad of plane


def draw_cruise(seed: int, number: int) -> tuple[str, Vehicle, Scenario]:
    """What the vehicle is, and how it goes on with one manoeuvre after the other, nothing being hidden."""
    is_published = KINDS[number % len(KINDS)] == "published"
    rng = np.random.default_rng([seed, 6, number])
    while True:
        kind, vehicle = draw_published(rng) if is_published else ("linear", draw_vehicle(rng))
        outing = draw_outing(rng, vehicle, False, SLOW_STEP if is_published else LONGEST_STEP)
        scenario = outing.scenario
        if outing.rate_hz * STEP != 1.0 or scenario.excitation.program == ENDLESS:
            continue
        setting = Setting(
            vehicle=vehicle, command=0.1, pitch=0.1, duration_s=scenario.duration_s, step_s=scenario.step_s
        )
        native = (draw_servo(rng, setting),) if is_published else ()
        try:
            outing, plain = sized_to_pitch(rng, outing, number, setting, native)
        except ScenarioError:
            continue
        if is_ordinary(plain):
            return kind, vehicle, replace(outing.scenario, effects=switched(native, setting))


def scaled(vehicle: Vehicle) -> Mapping[str, Fault]:
    """The faults, at most as large as such a vehicle can bear."""
    most = {
        "ballast drop": MOST_BALLAST * vehicle.hull.mass,
        "current": MOST_CURRENT * vehicle.speed,
        "trim shift": MOST_TRIM * abs(vehicle.coefficients["b2"]) * vehicle.pitch_inertia,
    }
    return {title: replace(fault, largest=most.get(title, fault.largest)) for title, fault in FAULTS.items()}


def struck_dive(seed: int, number: int, counts: Counter[str]) -> Iterator[str]:
    """A line for each fault of one dive; what is told is counted."""
    kind, vehicle, scenario = draw_cruise(seed, number)
    dive, crew, faults = Dive(scenario, number), Crew(vehicle.speed), scaled(vehicle)
    label = f"{number:3d}  {kind}, {scenario.excitation.program}"
    try:
        for told in strike(dive, crew, faults):
            if told.size is None:
                counts["invisible"] += 1
                continue
            fault, alarm = faults[told.title], told.alarm
            counts["faults"] += 1
            said = "no alarm in 60 s"
            if alarm is not None and told.delay is not None:
                counts["told"] += 1
                counts["in time"] += told.delay <= ALLOWED
                counts["slot"] += alarm.slot in fault.slots
                counts["slot or another"] += not {alarm.slot, *alarm.others}.isdisjoint(fault.slots)
                said = f"{told.delay:4.1f} s  {' or '.join((alarm.slot, *alarm.others))}, {alarm.change}"
            yield f"{label}  {told.title:18s} {told.size:8.3g} {fault.unit:15s} {said}"
    except (ScenarioError, SystemExit) as error:
        yield f"{label}  given up: {error}"
    watched = round(dive.plant.now.t_s)  # the faults strike copies
    counts["false"] += crew.alarms
    counts["seconds"] += watched
    yield f"{label}  {crew.alarms} false alarms in {watched} s"


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--dives", type=int, default=20, help="vehicles (default 20)")
    parser.add_argument("--seed", type=int, default=1, help="of the draws (default 1)")
    args = parser.parse_args()
    for first, kind in enumerate(KINDS):
        counts: Counter[str] = Counter()
        for number in range(first, args.dives, len(KINDS)):
            for line in struck_dive(args.seed, number, counts):
                print(line, flush=True)
        print(
            f"{kind}: {counts['in time']} of {counts['faults']} faults told within {ALLOWED:g} s, "
            f"{counts['told']} within {2 * ALLOWED:g} s; slot first {counts['slot']}, "
            f"among those named {counts['slot or another']}; "
            f"{counts['invisible']} left out as at no size they double the error; "
            f"{counts['false']} false alarms in {counts['seconds'] / 3600:.1f} h"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
