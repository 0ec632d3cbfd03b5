"""Published hulls: their physics against exact solutions, the trials drawn of them against their answers."""

from dataclasses import replace

import numpy as np
import pytest

from host.catalogue import BY_NAME
from tools.sitl.effects import Effects
from tools.sitl.excitation import Excitation
from tools.sitl.recording import sail as run
from tools.sitl.scenario import Scenario, Start
from tools.trial.deck import Card, deal
from tools.trial.draw import FOREIGN_MISFIT, MISFIT, draw
from tools.trial.fleet import hideable
from tools.trial.hidden import STRANGERS, Setting, draw_hidden
from tools.trial.outing import Outing, draw_outing, with_amplitude
from tools.trial.outside import ForcedBody, RotatingMass
from tools.trial.published import NATIVE, SLOW_STEP, VEHICLES, draw_published, draw_servo
from tools.trial.vehicle import Vehicle
from tools.trial.visibility import misfit_beside, yardstick
from tools.trial.voyage import sail
from tools.trial.whole_body import WholeBody, WholeHull, is_steady, straight_run

STILL = Excitation(program="none")


def outing_of(vehicle: Vehicle, duration_s: float = 40.0) -> tuple[Outing, Setting]:
    outing = with_amplitude(
        draw_outing(np.random.default_rng(3), vehicle, near_surface=True, longest_step=SLOW_STEP), 0.15
    )
    excitation = replace(outing.scenario.excitation, program="multistep")
    scenario = replace(outing.scenario, duration_s=duration_s, excitation=excitation)
    setting = Setting(vehicle=vehicle, command=0.15, pitch=0.2, duration_s=duration_s, step_s=scenario.step_s)
    return replace(outing, scenario=scenario), setting


def like(name: str) -> Vehicle:
    drawn = (draw_published(np.random.default_rng(seed)) for seed in range(100))
    vehicle = next(vehicle for found, vehicle in drawn if found == name)
    return replace(vehicle, hull=VEHICLES[name].hull, speed=VEHICLES[name].fastest)


def test_ideal_fluid_without_thrust_conserves_energy() -> None:
    """With the weight below the centre and added mass that couples heave and pitch."""
    hull = WholeHull(
        mass=30.0, Iy=4.0, zb=0.03, Xudot=-1.0, Zwdot=-35.0, Zqdot=-2.0, Mwdot=-2.0, Mqdot=-5.0,
        Xuu=0.0, Xdd=0.0, Zw=0.0, Zq=1.0, Mw=34.0, Mq=2.0,
    )  # fmt: skip
    start = Start(pitch=0.5, heave=0.3, pitch_rate=0.4, speed=0.8, depth=50.0)
    truth = run(Scenario(hull=hull, start=start, excitation=STILL, duration_s=30.0), 1)
    u, w, q, theta = (truth[name] for name in ("speed_mps", "heave_mps", "pitch_rate_radps", "pitch_rad"))
    kinetic = 31.0 * u**2 + 65.0 * w**2 + 9.0 * q**2 + 2 * (30.0 * 0.03 * u * q + 2.0 * w * q)
    energy = kinetic / 2 + 0.03 * hull.weight * (1 - np.cos(theta))
    assert np.ptp(theta) > 1.0
    assert np.ptp(u) > 0.1
    assert np.ptp(energy) < 1e-6 * energy[0]


def test_the_dsrv_moves_as_its_source_says() -> None:
    """The printed figures are non-dimensional: speeds in U, times in L/U; of theta as (U/L)^2 at 4.11 m/s."""
    speed, length = 4.11, 5.0
    motion = straight_run(VEHICLES["DSRV"].hull, speed)[:2]
    inside = np.array([speed, speed / length, 1.0, 1.0])
    rates = np.array([speed**2 / length, (speed / length) ** 2])
    printed = [[-0.653, -0.251, 0.005, 0.415], [3.222, -3.223, -2.645, -3.676]]
    assert motion * inside / rates[:, None] == pytest.approx(np.array(printed), abs=6e-4)


def test_drag_across_the_hull_is_its_integral() -> None:
    body = WholeBody(WholeHull(cross_flow=100.0, length=4.0), Effects(), 2.0, 0.0)
    assert body.cross_flow(0.5, 0.0) == pytest.approx((-100.0 * 4.0 * 0.25, 0.0))
    force, moment = body.cross_flow(0.0, -0.3)
    assert force == pytest.approx(0.0, abs=1e-9)
    assert moment == pytest.approx(100.0 * 0.09 * 4.0**4 / 32, rel=0.02)
    # Where the whole hull heaves faster than it turns, w|w| over it is a polynomial.
    force, moment = body.cross_flow(-2.0, 0.3)
    assert force == pytest.approx(100.0 * (4.0 * 4.0 + 0.09 * 4.0**3 / 12), rel=1e-3)
    assert moment == pytest.approx(-100.0 * 2 * 2.0 * 0.3 * 4.0**3 / 12, rel=0.01)


@pytest.mark.parametrize("name", VEHICLES)
def test_a_published_vehicle_flies_level_and_keeps_its_speed(name: str) -> None:
    one = VEHICLES[name]
    assert is_steady(one.hull, one.slowest)
    assert is_steady(one.hull, one.fastest)
    truth = run(
        Scenario(
            hull=one.hull, start=Start(speed=one.fastest), excitation=STILL, duration_s=60.0, step_s=0.05
        ),
        1,
    )
    assert np.ptp(truth["depth_m"]) < 1e-9
    assert np.ptp(truth["speed_mps"]) < 1e-9
    pushed = straight_run(one.hull, one.fastest)[1, 3]
    assert pushed < 0.0  # a positive plane pitches the nose down


def test_the_remus_as_printed_is_not_steady() -> None:
    printed = replace(VEHICLES["REMUS 100"].hull, Zw=-28.6, Zq=-5.22, Mw=24.0, Mq=-2.0)
    assert not is_steady(printed, 1.54)


@pytest.mark.parametrize("name", VEHICLES)
def test_result_does_not_depend_on_the_step(name: str) -> None:
    outing, setting = outing_of(like(name))
    effects = Effects(actuator_lag=0.1, net_buoyancy=0.005 * setting.vehicle.hull.weight)
    scenario = replace(with_amplitude(outing, 0.05).scenario, effects=effects)
    coarse, fine = run(scenario, 1), run(replace(scenario, step_s=scenario.step_s / 2), 1)
    assert np.ptp(fine["pitch_rad"]) > 0.05
    assert np.max(np.abs(coarse["depth_m"] - fine["depth_m"][::2])) < 1e-3
    assert np.max(np.abs(coarse["pitch_rad"] - fine["pitch_rad"][::2])) < 1e-4


def test_no_two_vehicles_are_the_same_and_all_are_steady() -> None:
    drawn = [draw_published(np.random.default_rng(seed)) for seed in range(40)]
    assert {name for name, _ in drawn} == set(VEHICLES)
    assert len({vehicle.hull.Zw for _, vehicle in drawn}) == 40
    assert all(is_steady(vehicle.hull, vehicle.speed) for _, vehicle in drawn)
    assert all(abs(v.hull.Mq / VEHICLES[n].hull.Mq - 1.0) <= 0.1 for n, v in drawn)


def test_what_is_hidden_is_none_of_what_the_vehicles_have() -> None:
    assert set(NATIVE) <= set(BY_NAME)
    assert not set(NATIVE) & set(hideable("published"))
    assert {"actuator_delay", "trim_moment", "surface_waves"} <= set(hideable("published"))
    assert set(NATIVE) & set(hideable("usual"))
    cards = deal(3, 200, "published")
    assert {name for card in cards if card.case == "one" for name in card.names} == set(hideable("published"))
    assert [card.case for card in cards] == [card.case for card in deal(3, 200)]


@pytest.mark.parametrize("name", [*hideable("published"), *STRANGERS])
def test_each_effect_changes_the_run_and_vanishes_with_its_strength(name: str) -> None:
    outing, setting = outing_of(like("REMUS 100"))
    effect = draw_hidden(np.random.default_rng(7), name, setting)
    plain = sail(outing.scenario, 1, (), setting)
    changes = []
    for strength in (0.6, 1e-5):
        changed = sail(outing.scenario, 1, (replace(effect, strength=strength),), setting)
        changes.append(np.abs(changed.depth - plain.depth).max() + np.abs(changed.pitch - plain.pitch).max())
    assert changes[0] > 1e-4
    assert changes[1] < 0.01 * changes[0]


def test_foreign_physics_comes_on_top_of_any_body() -> None:
    motion = (1.5, 0.1, 0.05, 0.1, 20.0)
    for hull in (VEHICLES["LAUV"].hull, like("NPS AUV II").hull):
        body = hull.body(Effects(), 1.5, 20.0)
        forced = ForcedBody(body, RotatingMass(0.2, 10.0, 0.0))
        change = np.subtract(forced.rates(motion, 0.1, 2.5, 0.0, 0.0), body.rates(motion, 0.1, 2.5, 0.0, 0.0))
        assert change == pytest.approx([0.0, 0.0, 0.2, 0.0, 0.0], abs=1e-12)


def test_a_vehicle_with_other_derivatives_is_no_hidden_effect() -> None:
    vehicle = like("DSRV")
    outing, setting = outing_of(vehicle, 20.0)
    servo = (draw_servo(np.random.default_rng(1), setting),)
    other = replace(vehicle.hull, Zq=1.1 * vehicle.hull.Zq, Mw=1.1 * vehicle.hull.Mw)
    flown = sail(replace(outing.scenario, hull=other), 1, servo, setting)
    noise = yardstick(outing.scenario, 1, flown)
    assert misfit_beside(flown, outing, 1, servo, setting, noise, 1.0) < 1.5
    fewer = replace(vehicle, derivatives=("Zw", "Mq", "zb", "Zdelta", "Mdelta"), is_whole=False)
    assert misfit_beside(flown, outing, 1, servo, replace(setting, vehicle=fewer), noise, 1.0) > 5.0


@pytest.mark.parametrize(
    ("number", "card"),
    [
        (1, Card("none", ())),
        (5, Card("one", ("net_buoyancy",))),
        (2, Card("two", ("net_buoyancy", "rudder_stall"))),
        (5, Card("outside", ("rotating_mass",))),
    ],
)
def test_a_drawn_recording_is_one_of_a_published_vehicle(number: int, card: Card) -> None:
    drawn = draw(12, number, card, "published")
    answer = drawn.answer
    assert answer.case == card.case
    assert len(answer.hidden) == len(card.names)
    assert answer.usual == list(NATIVE)
    assert answer.outing["vehicle"] in VEHICLES
    assert answer.base == {}
    assert answer.coefficients["actuator_lag"]["lag_time"] == pytest.approx(0.09, abs=0.06)
    assert not any(name.startswith("c_") for found in answer.coefficients.values() for name in found)
    least = FOREIGN_MISFIT if card.case == "outside" else MISFIT
    assert all(answer.misfits[name] >= least for name in answer.hidden)
    assert np.all(np.diff(drawn.table["time_s"]) > 0.0)
    assert 0.02 < np.nanmax(np.abs(drawn.table["pitch_rad"])) < 1.0
    assert np.nanmin(drawn.table["depth_m"]) > 0.5
