"""What is drawn is drawn again, can be seen, and hides nothing else."""

from dataclasses import fields, replace

import numpy as np
import pytest

from host.catalogue import BY_NAME
from tools.sitl.effects import Effects
from tools.trial.deck import PACK, Card, deal
from tools.trial.draw import FOREIGN_MISFIT, MISFIT, draw
from tools.trial.hidden import KINDS, STRANGERS, Setting, draw_hidden
from tools.trial.linear import free_run
from tools.trial.outing import draw_outing, with_amplitude
from tools.trial.usual import SHARES, draw_usual
from tools.trial.vehicle import draw_vehicle
from tools.trial.voyage import sail


def test_kinds_are_the_plants_switches_and_the_catalogues_names() -> None:
    assert set(KINDS) == {field.name for field in fields(Effects)} <= set(BY_NAME)
    assert all(KINDS[name].slot == BY_NAME[name].slot for name in KINDS)
    assert not set(STRANGERS) & set(BY_NAME)


def test_more_cards_begin_with_the_same_and_every_effect_gets_its_turn() -> None:
    cards = deal(3, 200)
    assert deal(3, 50) == cards[:50]
    assert deal(4, 50) != cards[:50]
    assert sorted(card.case for card in cards[:20]) == sorted(PACK)
    assert {card.names[0] for card in cards if card.case == "one"} == set(KINDS)
    assert {card.names[0] for card in cards if card.case == "outside"} == set(STRANGERS)
    assert all(len(set(card.names)) == 2 for card in cards if card.case == "two")


@pytest.mark.parametrize(
    ("number", "card"),
    [
        (2, Card("one", ("actuator_saturation",))),
        pytest.param(24, Card("two", ("ballast_change", "pitch_sensor_lag")), marks=pytest.mark.long),
        (8, Card("outside", ("rotating_mass",))),
    ],
)
def test_drawing_is_repeatable_and_its_effects_can_be_seen(number: int, card: Card) -> None:
    drawn, again = draw(5, number, card), draw(5, number, card)
    assert drawn.answer == again.answer
    assert all(np.array_equal(drawn.table[c], again.table[c], equal_nan=True) for c in drawn.table)
    least = FOREIGN_MISFIT if card.case == "outside" else MISFIT
    assert all(misfit >= least for misfit in drawn.answer.misfits.values())
    assert set(drawn.answer.misfits) == set(card.names)
    assert tuple(drawn.answer.hidden) == card.names
    floor = drawn.answer.floor
    rows = np.round(drawn.table["time_s"] / floor.step_s).astype(int)
    noise = drawn.table["pitch_rad"] - np.array(floor.pitch_rad)[rows]
    assert np.nanstd(noise) == pytest.approx(floor.pitch_noise_rad, rel=0.15)


@pytest.mark.parametrize("seed", range(6))
def test_with_nothing_hidden_the_linear_equations_hold_exactly(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vehicle = draw_vehicle(rng)
    outing = with_amplitude(draw_outing(rng, vehicle, near_surface=False), 0.05)
    outing = replace(outing, scenario=replace(outing.scenario, duration_s=40.0))
    setting = Setting(vehicle=vehicle, command=0.1, pitch=0.1, duration_s=40.0, step_s=0.02)
    truth = sail(outing.scenario, 1, (), setting)
    start = outing.scenario.start
    known = [*vehicle.coefficients.values(), start.heave, start.pitch_rate, start.pitch, start.depth]
    pitch, depth = free_run(np.array([[*known, *np.zeros(5)]]), truth.command, 1 / outing.rate_hz, None)
    assert np.abs(pitch[0] - truth.pitch).max() < 1e-5
    assert np.abs(depth[0] - truth.depth).max() < 1e-5


@pytest.mark.parametrize("name", [*KINDS, *STRANGERS])
def test_each_effect_changes_the_run_and_vanishes_with_its_strength(name: str) -> None:
    rng = np.random.default_rng(7)
    vehicle = draw_vehicle(rng)
    outing = draw_outing(rng, vehicle, near_surface=True)
    excitation = replace(outing.scenario.excitation, program="multistep")
    scenario = replace(outing.scenario, duration_s=60.0, excitation=excitation)
    setting = Setting(vehicle=vehicle, command=0.1, pitch=0.2, duration_s=60.0, step_s=scenario.step_s)
    effect = draw_hidden(rng, name, setting)
    plain = sail(scenario, 1, (), setting)
    changes = []
    for strength in (0.6, 1e-5):
        changed = sail(scenario, 1, (replace(effect, strength=strength),), setting)
        changes.append(np.abs(changed.depth - plain.depth).max() + np.abs(changed.pitch - plain.pitch).max())
    assert changes[0] > 1e-4
    assert changes[1] < 0.01 * changes[0]


def test_a_replayed_run_is_the_same_run() -> None:
    rng = np.random.default_rng(11)
    vehicle = draw_vehicle(rng)
    outing = draw_outing(rng, vehicle, near_surface=False)
    excitation = replace(outing.scenario.excitation, program="depth_steps", dither=0.05)
    scenario = replace(outing.scenario, duration_s=60.0, excitation=excitation)
    setting = Setting(vehicle=vehicle, command=0.1, pitch=0.2, duration_s=60.0, step_s=scenario.step_s)
    flown = sail(scenario, 1, (), setting)
    assert np.array_equal(sail(scenario, 1, (), setting, flown.command).depth, flown.depth)


@pytest.mark.long
def test_what_is_hidden_can_be_seen_beside_all_that_real_vehicles_have() -> None:
    drawn = draw(31, 8, Card("one", ("net_buoyancy",)), "usual").answer
    assert drawn.usual == [*SHARES]
    assert drawn.misfits["net_buoyancy"] >= MISFIT
    assert drawn.coefficients["large_angle_restoring"] == {"restoring_share": pytest.approx(1.0)}
    plain = draw(31, 8, Card("one", ("net_buoyancy",))).answer
    assert plain.usual == []
    assert plain.floor.pitch_rad != drawn.floor.pitch_rad


def test_a_usual_effect_that_is_hidden_is_not_drawn_twice() -> None:
    rng = np.random.default_rng(1)
    setting = Setting(vehicle=draw_vehicle(rng), command=0.1, pitch=0.2, duration_s=60.0, step_s=0.02)
    names = [effect.name for effect in draw_usual(rng, setting, ("actuator_lag", "net_buoyancy"))]
    assert names == [name for name in SHARES if name != "actuator_lag"]
