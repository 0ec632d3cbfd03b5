"""Draws how a vehicle is taken out: manoeuvres, duration, start, instruments."""

from dataclasses import dataclass, replace
from math import radians, sqrt

import numpy as np

from tools.sitl.excitation import Excitation
from tools.sitl.scenario import Scenario, Start
from tools.sitl.sensors import Channel, Sensors
from tools.trial.logger import Logger
from tools.trial.vehicle import Vehicle, log_uniform

RATES_HZ = (5.0, 8.0, 10.0, 10.0, 12.5, 20.0)
PROGRAMS = ("multistep", "multistep", "3211", "multisine", "doublets", "depth_steps")
LONGEST_STEP = 0.02  # s, of the integrator
LEAST_STEPPED = 0.08  # s: a shorter interval between commands has as many steps as this


@dataclass(frozen=True, slots=True, kw_only=True)
class Outing:
    """One run to be recorded, which optional columns its recording has, and what the logger spoils of it."""

    scenario: Scenario
    has_speed: bool
    has_pitch_rate: bool
    logger: Logger | None = None

    @property
    def rate_hz(self) -> float:
        return self.scenario.sensors.depth.rate_hz


def draw_outing(
    rng: np.random.Generator, vehicle: Vehicle, near_surface: bool, longest_step: float = LONGEST_STEP
) -> Outing:
    """60-600 s, 5-20 Hz; the plane's amplitude is still that of a first try, see `with_amplitude`.

    The command changes only where it is recorded, so that a recording with nothing hidden obeys the paper's
    equations exactly.
    """
    rate = float(rng.choice(RATES_HZ))
    excitation = _draw_excitation(rng, vehicle, 1.0 / rate)
    depth = rng.uniform(4.0, 15.0) if near_surface else rng.uniform(10.0, 60.0)
    start = Start(
        depth=depth,
        pitch=rng.normal(0.0, 0.02),
        heave=rng.normal(0.0, 0.02) * vehicle.speed,
        pitch_rate=rng.normal(0.0, 0.01),
        speed=vehicle.speed,
    )
    substeps = round(max(1.0 / rate, LEAST_STEPPED) / longest_step)
    scenario = Scenario(
        name="blind trial",
        duration_s=round(log_uniform(rng, 60.0, 600.0) * rate) / rate,
        step_s=1.0 / rate / substeps,
        start=start,
        hull=vehicle.hull,
        excitation=excitation,
        sensors=_draw_sensors(rng, rate),
    )
    return Outing(
        scenario=scenario, has_speed=bool(rng.random() < 0.35), has_pitch_rate=bool(rng.random() < 0.15)
    )


def with_amplitude(outing: Outing, amplitude: float) -> Outing:
    """The same outing with another size of the plane's movement, rad."""
    excitation = replace(outing.scenario.excitation, amplitude=amplitude, drift_limit=8.0 * amplitude)
    return replace(outing, scenario=replace(outing.scenario, excitation=excitation))


def _draw_excitation(rng: np.random.Generator, vehicle: Vehicle, update_s: float) -> Excitation:
    program = str(rng.choice(PROGRAMS))
    pace = max(vehicle.length / vehicle.speed, 4.0 * update_s)  # s, of the quickest manoeuvre worth making
    pulse = round(pace * rng.uniform(1.0, 3.0) / update_s) * update_s
    hold_min = max(update_s, pace * rng.uniform(0.5, 1.5))
    common = Excitation(
        amplitude=0.1,
        start_s=round(2.0 / update_s) * update_s,  # planes and filters begin settled
        update_s=update_s,
        hold_min_s=hold_min,
        hold_max_s=hold_min * rng.uniform(4.0, 10.0),
        pulse_s=pulse,
        rest_s=pulse * rng.uniform(2.0, 6.0),
        band_low_hz=rng.uniform(0.01, 0.04),
        band_high_hz=min(1.0, 0.2 / update_s, 1.0 / pace),
    )
    if program != "depth_steps":
        return replace(common, program=program)  # type: ignore[arg-type]
    c = vehicle.coefficients
    pitch_gain = rng.uniform(0.3, 2.0) * c["a3"] / c["b2"] + rng.uniform(0.2, 1.0)
    pitch_frequency = sqrt(-c["a3"] - c["b2"] * pitch_gain)
    slowest = min(pitch_frequency, -c["a2"], -2.0 * c["a1"], 1.5)  # 1/s; the depth loop stays well below
    # The plane holds the pitch wanted only in part, as the restoring moment pulls against it.
    held = c["b2"] * pitch_gain / (c["a3"] + c["b2"] * pitch_gain)
    return replace(
        common,
        program="depth_steps",
        depth_step=rng.uniform(1.5, 5.0),
        depth_hold_s=rng.uniform(15.0, 40.0),
        depth_gain=rng.uniform(0.1, 0.25) * slowest / vehicle.speed / held,
        pitch_gain=pitch_gain,
        rate_gain=rng.uniform(0.0, 0.3) * c["a2"] / c["b2"],
        dither=rng.uniform(0.02, 0.06) if rng.random() < 0.6 else 0.0,
    )


def _draw_sensors(rng: np.random.Generator, rate_hz: float) -> Sensors:
    loss = rng.uniform(0.002, 0.05) if rng.random() < 0.3 else 0.0
    burst = log_uniform(rng, 60.0, 300.0) if rng.random() < 0.15 else 0.0
    depth_quantum = float(rng.choice((0.0, 0.0, 0.0, 0.01, 0.1)))
    pitch_quantum = radians(float(rng.choice((0.0, 0.0, 0.0, 0.0, 0.1))))
    faults = {"rate_hz": rate_hz, "loss": loss, "burst_every_s": burst, "burst_s": 0.7}
    return Sensors(
        depth=Channel(noise=log_uniform(rng, 0.003, 0.03), quantum=depth_quantum, **faults),
        pitch=Channel(noise=radians(log_uniform(rng, 0.03, 0.3)), quantum=pitch_quantum, **faults),
        rudder=Channel(rate_hz=rate_hz),
        speed=Channel(rate_hz=rate_hz, noise=log_uniform(rng, 0.002, 0.01)),
        pitch_rate=Channel(rate_hz=rate_hz, noise=radians(log_uniform(rng, 0.05, 0.5))),
    )
