"""Draws one recording of the trial and its answer."""

from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np

from tools.sitl.errors import ScenarioError
from tools.sitl.plant import Plant
from tools.sitl.recording import Table, measure
from tools.trial.answers import Answer, Floor
from tools.trial.coefficients import free_of_mass, true_coefficients
from tools.trial.deck import Card
from tools.trial.fleet import Fleet, hideable
from tools.trial.flight import Flight
from tools.trial.hidden import STRANGERS, Hidden, Setting, draw_hidden, switched, with_strength
from tools.trial.logger import Logger
from tools.trial.outing import LONGEST_STEP, Outing, draw_outing, with_amplitude
from tools.trial.published import NATIVE, SLOW_STEP, draw_published, draw_servo, draw_steady
from tools.trial.usual import draw_usual
from tools.trial.vehicle import draw_vehicle, log_uniform
from tools.trial.visibility import Yardstick, is_ordinary, linear_misfit, misfit_beside, yardstick
from tools.trial.voyage import Voyage, sail

STRENGTHS = (0.01, 1.0)
"""Of the strongest ordinary size, logarithm uniform: weaker, nobody would call it missing physics."""
MISFIT = 50.0
"""What a hidden effect leaves of chi2 at least, once the linear equations are fitted to it."""
FOREIGN_MISFIT = 500.0
"""The same outside the catalogue, beyond all linear equations, as part of it is explained by those inside."""
MOST_COMMAND = 0.45  # rad, where planes have their stops
MOST_ATTEMPTS = 200
PATIENCE = 20  # attempts before other effects are drawn: some pairs are one effect to any eye


class CannotDraw(Exception):
    """No vehicle and outing was found on which the effects can be seen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """A recording, as a table to be written, what it hides, and how it was flown."""

    table: Table
    answer: Answer
    flight: Flight


def draw(seed: int, number: int, card: Card, fleet: Fleet = "linear", is_logged: bool = False) -> Drawn:
    """Recording `number` of a trial: vehicles and outings are drawn until all on the card can be seen.

    It is seen beside what the vehicles of the fleet have by themselves.

    is_logged  a logger comes between the instruments and the file
    """
    for attempt in range(MOST_ATTEMPTS):
        rng = np.random.default_rng([seed, 4, number, attempt])
        if card.names and attempt > 0 and attempt % PATIENCE == 0:
            family = tuple(STRANGERS) if card.case == "outside" else hideable(fleet)
            names = rng.choice(family, len(card.names), replace=False).tolist()
            card = Card(card.case, tuple(names))
        loggers = np.random.default_rng([seed, 5, number, attempt]) if is_logged else None
        drawn = _attempt(rng, number, card, fleet, loggers)
        if drawn is not None:
            return drawn
    raise CannotDraw(
        f"recording {number}: {', '.join(card.names)} cannot be seen in {MOST_ATTEMPTS} attempts"
    )


def _attempt(
    rng: np.random.Generator, number: int, card: Card, fleet: Fleet, loggers: np.random.Generator | None
) -> Drawn | None:
    name, vehicle = draw_published(rng) if fleet == "published" else ("", draw_vehicle(rng))
    longest = SLOW_STEP if fleet == "published" else LONGEST_STEP
    outing = draw_outing(rng, vehicle, "surface_waves" in card.names, longest)
    if loggers is not None:
        outing = replace(outing, logger=Logger.drawn(loggers, outing.rate_hz))
    seed = int(rng.integers(2**31))
    scenario = outing.scenario
    setting = Setting(
        vehicle=vehicle, command=0.1, pitch=0.1, duration_s=scenario.duration_s, step_s=scenario.step_s
    )
    native = (draw_servo(rng, setting),) if fleet == "published" else ()
    try:
        outing, plain = sized_to_pitch(rng, outing, seed, setting, native)
    except ScenarioError:
        return None
    setting = replace(
        setting, command=float(np.abs(plain.command).max()), pitch=float(np.abs(plain.pitch).max())
    )
    noise = yardstick(outing.scenario, seed, plain, outing.logger)
    if not is_ordinary(plain) or setting.command < 0.01:
        return None
    hidden: tuple[Hidden, ...] = ()
    for kind in card.names:
        effect = _strong_enough(rng, draw_hidden(rng, kind, setting), outing, seed, setting, noise, native)
        if effect is None:
            return None
        hidden = (*hidden, effect)
    usual = draw_usual(rng, setting, card.names) if fleet == "usual" else native
    acting = (*hidden, *usual)
    try:
        voyage = sail(outing.scenario, seed, acting, setting)
    except ScenarioError:
        return None
    if not is_ordinary(voyage):
        return None
    if len(hidden) == 1 and not usual:
        beyond = hidden[0].is_foreign
        misfits = {hidden[0].name: linear_misfit(voyage, outing, setting, noise, beyond)}
    else:
        steady = draw_steady(rng, setting) if fleet == "published" else ()
        misfits = _misfits_beside(voyage, outing, seed, hidden, usual, steady, setting, noise)
    if len(misfits) < len(hidden):
        return None
    drawn = _written(number, card, outing, seed, setting, noise, hidden, usual, voyage, misfits)
    return _of_published(drawn, name) if fleet == "published" else drawn


def sized_to_pitch(
    rng: np.random.Generator, outing: Outing, seed: int, setting: Setting, native: tuple[Hidden, ...]
) -> tuple[Outing, Voyage]:
    """The plane's amplitude set for a drawn largest pitch, and the run with nothing hidden."""
    if outing.scenario.excitation.program == "depth_steps":
        outing = with_amplitude(outing, rng.uniform(0.2, 0.4))
        return outing, sail(outing.scenario, seed, native, setting)
    largest = log_uniform(rng, 0.08, 0.5)
    first = sail(outing.scenario, seed, native, setting)
    factor = min(
        largest / float(np.abs(first.pitch).max()), MOST_COMMAND / float(np.abs(first.command).max())
    )
    outing = with_amplitude(outing, max(0.1 * factor, 0.02))
    voyage = sail(outing.scenario, seed, native, setting)
    shallowest = float(voyage.table["depth_m"].min())
    if shallowest < 5.0:
        start = replace(outing.scenario.start, depth=outing.scenario.start.depth + 10.0 - shallowest)
        outing = replace(outing, scenario=replace(outing.scenario, start=start))
        voyage = sail(outing.scenario, seed, native, setting)
    return outing, voyage


def _strong_enough(
    rng: np.random.Generator,
    effect: Hidden,
    outing: Outing,
    seed: int,
    setting: Setting,
    noise: Yardstick,
    native: tuple[Hidden, ...],
) -> Hidden | None:
    """At a drawn strength; None where it cannot be seen, or tears the vehicle out of the water."""
    effect = with_strength(effect, log_uniform(rng, *STRENGTHS))
    if not effect.deserves_its_name(setting):
        return None
    try:
        voyage = sail(outing.scenario, seed, (effect, *native), setting)
        without = sail(outing.scenario, seed, native, setting, voyage.command) if native else None
    except ScenarioError:
        return None
    if not is_ordinary(voyage):
        return None
    if without is None:
        misfit = linear_misfit(voyage, outing, setting, noise, effect.is_foreign)
    else:  # linear equations do not follow such a vehicle anyway; what its own can follow is asked later
        misfit = float(np.sum(noise.residual(without.pitch, without.depth, voyage) ** 2))
    return effect if misfit >= (FOREIGN_MISFIT if effect.is_foreign else MISFIT) else None


def _misfits_beside(
    voyage: Voyage,
    outing: Outing,
    seed: int,
    hidden: tuple[Hidden, ...],
    usual: tuple[Hidden, ...],
    steady: tuple[Hidden, ...],
    setting: Setting,
    noise: Yardstick,
) -> dict[str, float]:
    """What each hidden effect leaves beside all else that acts, up to the first that cannot be seen.

    steady    forces that must not explain what is foreign
    """
    acting = (*hidden, *usual)
    calm = tuple(effect for effect in acting if effect.name != "surface_waves")
    among_waves = noise
    if 0 < len(calm) < len(acting):
        still = sail(outing.scenario, seed, calm, setting, voyage.command)
        among_waves = noise.among_waves(voyage, still, outing.rate_hz)
    misfits: dict[str, float] = {}
    for effect in hidden:
        others = tuple(other for other in acting if other is not effect)
        told_from = among_waves if effect in calm else noise
        unneeded = steady if effect.is_foreign else ()
        least = FOREIGN_MISFIT if unneeded else MISFIT
        misfit = misfit_beside(voyage, outing, seed, others, setting, told_from, least, unneeded)
        if misfit < least:
            break
        misfits[effect.name] = misfit
    return misfits


def _written(
    number: int,
    card: Card,
    outing: Outing,
    seed: int,
    setting: Setting,
    noise: Yardstick,
    hidden: tuple[Hidden, ...],
    usual: tuple[Hidden, ...],
    voyage: Voyage,
    misfits: dict[str, float],
) -> Drawn:
    table = measure(outing.scenario, seed, voyage.table)
    for column, is_there in (
        ("speed_mps", outing.has_speed),
        ("pitch_rate_radps", outing.has_pitch_rate),
    ):
        if not is_there:
            del table[column]
    rows = np.round(table["time_s"] * outing.rate_hz).astype(int)
    logger = outing.logger
    if logger is not None:
        rows, table = rows[logger.rows(len(rows))], logger.kept(table)
    sea = Plant(replace(outing.scenario, effects=switched((*hidden, *usual), setting)), seed).sea
    phase = (sin(sea.internal_phase), cos(sea.internal_phase))
    excitation = outing.scenario.excitation
    answer = Answer(
        number=number,
        case=card.case,
        hidden=[effect.name for effect in hidden],
        usual=[effect.name for effect in usual],
        slots=[effect.slot for effect in hidden],
        sizes={effect.name: effect.size(setting) for effect in hidden},
        misfits={name: round(misfit, 1) for name, misfit in misfits.items()},
        base=setting.vehicle.coefficients,
        coefficients={effect.name: true_coefficients(effect, setting, phase) for effect in (*hidden, *usual)},
        outing={
            "mass_kg": round(setting.vehicle.hull.mass, 2),
            "length_m": round(setting.vehicle.length, 2),
            "program": excitation.program,
            "amplitude_rad": round(setting.command, 4),
            "largest_pitch_rad": round(float(np.abs(voyage.pitch).max()), 3),
            "duration_s": outing.scenario.duration_s,
            "rate_hz": outing.rate_hz,
            "has_speed": outing.has_speed,
            "has_pitch_rate": outing.has_pitch_rate,
            "loss": outing.scenario.sensors.depth.loss,
            "depth_quantum_m": outing.scenario.sensors.depth.quantum,
            "pitch_quantum_rad": outing.scenario.sensors.pitch.quantum,
            **({} if logger is None else logger.told()),
        },
        floor=Floor(
            pitch_noise_rad=noise.pitch_noise,
            depth_noise_m=noise.depth_noise,
            step_s=1.0 / outing.rate_hz,
            pitch_rad=[round(value, 7) for value in voyage.pitch.tolist()],
            depth_m=[round(value, 6) for value in voyage.depth.tolist()],
            rows=None if logger is None else rows.tolist(),
        ),
    )
    flight = Flight(
        scenario=outing.scenario,
        seed=seed,
        acting=(*hidden, *usual),
        setting=setting,
        commands=voyage.command,
    )
    return Drawn(table=table, answer=answer, flight=flight)


def _of_published(drawn: Drawn, vehicle: str) -> Drawn:
    """With all that the vehicle has by itself; without coefficients that depend on how masses are shared."""
    answer = drawn.answer
    answer = replace(
        answer,
        usual=list(NATIVE),
        base={},
        coefficients={name: free_of_mass(name, found) for name, found in answer.coefficients.items()},
        outing={"vehicle": vehicle, **answer.outing},
    )
    return replace(drawn, answer=answer)
