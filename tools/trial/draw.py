"""Draws one recording of the trial and its answer."""

from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np

from tools.sitl.errors import ScenarioError
from tools.sitl.plant import Plant
from tools.sitl.recording import Table, measure
from tools.trial.answers import Answer, Floor
from tools.trial.coefficients import true_coefficients
from tools.trial.deck import Card
from tools.trial.hidden import KINDS, STRANGERS, Hidden, Setting, draw_hidden, switched, with_strength
from tools.trial.outing import Outing, draw_outing, with_amplitude
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
    """A recording, as a table to be written, and what it hides."""

    table: Table
    answer: Answer


def draw(seed: int, number: int, card: Card, has_usual: bool = False) -> Drawn:
    """Recording `number` of a trial: vehicles and outings are drawn until all on the card can be seen.

    has_usual    the vehicle also has all that real ones have, and what is on the card is seen beside it
    """
    for attempt in range(MOST_ATTEMPTS):
        rng = np.random.default_rng([seed, 4, number, attempt])
        if card.names and attempt > 0 and attempt % PATIENCE == 0:
            family = tuple(STRANGERS if card.case == "outside" else KINDS)
            names = rng.choice(family, len(card.names), replace=False).tolist()
            card = Card(card.case, tuple(names))
        drawn = _attempt(rng, number, card, has_usual)
        if drawn is not None:
            return drawn
    raise CannotDraw(
        f"recording {number}: {', '.join(card.names)} cannot be seen in {MOST_ATTEMPTS} attempts"
    )


def _attempt(rng: np.random.Generator, number: int, card: Card, has_usual: bool) -> Drawn | None:
    vehicle = draw_vehicle(rng)
    outing = draw_outing(rng, vehicle, near_surface="surface_waves" in card.names)
    seed = int(rng.integers(2**31))
    scenario = outing.scenario
    setting = Setting(
        vehicle=vehicle, command=0.1, pitch=0.1, duration_s=scenario.duration_s, step_s=scenario.step_s
    )
    try:
        outing, plain = _sized_to_pitch(rng, outing, seed, setting)
    except ScenarioError:
        return None
    setting = replace(
        setting, command=float(np.abs(plain.command).max()), pitch=float(np.abs(plain.pitch).max())
    )
    noise = yardstick(outing.scenario, seed, plain)
    if not is_ordinary(plain) or setting.command < 0.01:
        return None
    hidden: tuple[Hidden, ...] = ()
    for name in card.names:
        effect = _strong_enough(rng, draw_hidden(rng, name, setting), outing, seed, setting, noise)
        if effect is None:
            return None
        hidden = (*hidden, effect)
    usual = draw_usual(rng, setting, card.names) if has_usual else ()
    acting = (*hidden, *usual)
    try:
        voyage = sail(outing.scenario, seed, acting, setting)
    except ScenarioError:
        return None
    if not is_ordinary(voyage):
        return None
    if len(acting) == 1:
        beyond = hidden[0].is_foreign
        misfits = {hidden[0].name: linear_misfit(voyage, outing, setting, noise, beyond)}
    else:
        misfits = _misfits_beside(voyage, outing, seed, hidden, usual, setting, noise)
    if len(misfits) < len(hidden):
        return None
    return _written(number, card, outing, seed, setting, noise, hidden, usual, voyage, misfits)


def _sized_to_pitch(
    rng: np.random.Generator, outing: Outing, seed: int, setting: Setting
) -> tuple[Outing, Voyage]:
    """The plane's amplitude set for a drawn largest pitch, and the run with nothing hidden."""
    if outing.scenario.excitation.program == "depth_steps":
        outing = with_amplitude(outing, rng.uniform(0.2, 0.4))
        return outing, sail(outing.scenario, seed, (), setting)
    largest = log_uniform(rng, 0.08, 0.5)
    first = sail(outing.scenario, seed, (), setting)
    factor = min(
        largest / float(np.abs(first.pitch).max()), MOST_COMMAND / float(np.abs(first.command).max())
    )
    outing = with_amplitude(outing, max(0.1 * factor, 0.02))
    voyage = sail(outing.scenario, seed, (), setting)
    shallowest = float(voyage.table["depth_m"].min())
    if shallowest < 5.0:
        start = replace(outing.scenario.start, depth=outing.scenario.start.depth + 10.0 - shallowest)
        outing = replace(outing, scenario=replace(outing.scenario, start=start))
        voyage = sail(outing.scenario, seed, (), setting)
    return outing, voyage


def _strong_enough(
    rng: np.random.Generator, effect: Hidden, outing: Outing, seed: int, setting: Setting, noise: Yardstick
) -> Hidden | None:
    """At a drawn strength; None where it cannot be seen, or tears the vehicle out of the water."""
    effect = with_strength(effect, log_uniform(rng, *STRENGTHS))
    if not effect.deserves_its_name(setting):
        return None
    try:
        voyage = sail(outing.scenario, seed, (effect,), setting)
    except ScenarioError:
        return None
    if not is_ordinary(voyage):
        return None
    misfit = linear_misfit(voyage, outing, setting, noise, effect.is_foreign)
    return effect if misfit >= (FOREIGN_MISFIT if effect.is_foreign else MISFIT) else None


def _misfits_beside(
    voyage: Voyage,
    outing: Outing,
    seed: int,
    hidden: tuple[Hidden, ...],
    usual: tuple[Hidden, ...],
    setting: Setting,
    noise: Yardstick,
) -> dict[str, float]:
    """What each hidden effect leaves beside all else that acts, up to the first that cannot be seen."""
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
        misfit = misfit_beside(voyage, outing, seed, others, setting, told_from, MISFIT)
        if misfit < MISFIT:
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
        },
        floor=Floor(
            pitch_noise_rad=noise.pitch_noise,
            depth_noise_m=noise.depth_noise,
            step_s=1.0 / outing.rate_hz,
            pitch_rad=[round(value, 7) for value in voyage.pitch.tolist()],
            depth_m=[round(value, 6) for value in voyage.depth.tolist()],
        ),
    )
    return Drawn(table=table, answer=answer)
