"""The simulated vehicle's physics, against exact solutions and conservation laws."""

from dataclasses import fields, replace
from math import pi, sqrt

import numpy as np
import pytest
from scipy.linalg import expm

from tools.sitl.effects import Effects, InternalWave, SurfaceWaves, Timed
from tools.sitl.errors import ScenarioError
from tools.sitl.excitation import Excitation
from tools.sitl.hull import GRAVITY, Hull
from tools.sitl.plant import Plant
from tools.sitl.recording import sail
from tools.sitl.scenario import Scenario, Start, load

STILL = Excitation(program="none")
SIZES = {
    "heave_quadratic_drag": 60.0,
    "pitch_quadratic_damping": 5.0,
    "speed_loss": 1.0,
    "ballast_change": Timed(size=1.0, at_s=5.0),
    "rudder_effectiveness_change": Timed(size=0.4, at_s=5.0),
    "internal_wave": InternalWave(size=0.05),
    "surface_waves": SurfaceWaves(size=2.0),
}


def held(tmp_path, *levels: tuple[float, float]) -> Scenario:
    """The linear vehicle with the plane held at the given angles from the given times on."""
    rows = "".join(f"{t_s},{level}\n" for t_s, level in levels)
    (tmp_path / "rudder.csv").write_text("time_s,rudder_rad\n" + rows)
    excitation = Excitation(program="csv", file="rudder.csv", quantum=0.0)
    return Scenario(excitation=excitation, folder=str(tmp_path), duration_s=20.0)


def test_default_hull_has_the_coefficients_of_the_paper():
    hull, u = Hull(), 2.5
    heave, pitch = hull.mass - hull.Zwdot, hull.Iy - hull.Mqdot
    assert [hull.Zw * u / heave, hull.Mq * u / pitch, -hull.zb * hull.weight / pitch] == pytest.approx(
        [-0.63084, -3.38699, -8.19858], rel=1e-6
    )
    assert [hull.Zdelta * u**2 / heave, hull.Mdelta * u**2 / pitch] == pytest.approx(
        [0.41385, -3.94120], rel=1e-6
    )


@pytest.mark.parametrize("cross", [0.0, 3.0])
def test_linear_flavour_equals_the_matrix_exponential(cross):
    """Also with added-mass coupling between heave and pitch. An algebra check, no statement of accuracy."""
    scenario = load("linear_noise_free")
    hull = Hull(Zqdot=cross, Mwdot=cross, Mw=cross)
    scenario = replace(scenario, hull=hull, start=Start(pitch=0.05, heave=-0.1, pitch_rate=0.02))
    truth = sail(scenario, seed=3)
    u = scenario.start.speed
    inertia = np.array([[hull.mass - hull.Zwdot, -hull.Zqdot], [-hull.Mwdot, hull.Iy - hull.Mqdot]])
    forces = np.array([[hull.Zw * u, 0, 0], [hull.Mw * u, hull.Mq * u, -hull.zb * hull.weight]])
    system = np.zeros((5, 5))
    system[:2, :3] = np.linalg.solve(inertia, forces)
    system[:2, 4] = np.linalg.solve(inertia, [hull.Zdelta * u**2, hull.Mdelta * u**2])
    system[2, 1] = 1.0
    system[3, :3] = 1.0, 0.0, -u
    step = expm(system * scenario.step_s)
    names = ("heave_mps", "pitch_rate_radps", "pitch_rad", "depth_m", "rudder_rad")
    got = np.column_stack([truth[name] for name in names])
    state = got[0, :4]
    worst = 0.0
    for row, rudder in zip(got, truth["rudder_rad"], strict=True):
        worst = max(worst, float(np.max(np.abs(row[:4] - state))))
        state = step[:4, :4] @ state + step[:4, 4] * rudder
    assert worst < 1e-6


def test_ideal_fluid_without_thrust_conserves_energy():
    """The products of velocities (Coriolis, Munk) and the restoring moment do no net work."""
    hull = Hull(Xuu=0.0, Xdd=0.0, Zw=0.0, Zq=0.0, Mq=0.0)
    effects = Effects(
        heave_pitch_rate_coupling=1.0,
        munk_moment=1.0,
        large_angle_restoring=1.0,
        large_angle_kinematics=1.0,
        speed_loss=1.0,
    )
    start = Start(pitch=0.6, heave=0.4, pitch_rate=0.5, speed=1.0)
    truth = sail(Scenario(hull=hull, effects=effects, start=start, excitation=STILL, duration_s=30.0), 1)
    u, w, q, theta = (truth[name] for name in ("speed_mps", "heave_mps", "pitch_rate_radps", "pitch_rad"))
    kinetic = (
        (hull.mass - hull.Xudot) * u**2 + (hull.mass - hull.Zwdot) * w**2 + (hull.Iy - hull.Mqdot) * q**2
    )
    energy = kinetic / 2 + hull.zb * hull.weight * (1 - np.cos(theta))
    assert np.ptp(theta) > 1.0
    assert np.ptp(energy) < 1e-5 * energy[0]


def test_positive_rudder_pitches_the_nose_down_and_dives(tmp_path):
    truth = sail(held(tmp_path, (0.0, 0.1)), 1)
    assert truth["pitch_rad"][-1] == pytest.approx(-0.1 * 3.94120 / 8.19858, rel=1e-4)
    assert truth["depth_m"][-1] > truth["depth_m"][0] + 2.0


@pytest.mark.parametrize(
    ("effects", "column", "expected"),
    [
        # At rest in pitch: 2 N up against Zw u w.
        (Effects(net_buoyancy=2.0), "heave_mps", 2.0 / (-36.58872 * 2.5)),
        (Effects(ballast_change=Timed(size=1.0, at_s=2.0)), "heave_mps", GRAVITY / (36.58872 * 2.5)),
        (Effects(trim_moment=8.0), "pitch_rad", 8.0 / 81.9858),
        (Effects(rudder_offset=0.02), "pitch_rad", -0.02 * 3.94120 / 8.19858),
        (Effects(pitch_bias=0.02), "sensed_pitch_rad", 0.02),
        (Effects(vertical_current=0.1), "depth_m", 22.0),
        (Effects(depth_sensor_lever_arm=0.5, trim_moment=-8.1986), "sensed_pitch_rad", -0.1),
    ],
)
def test_constant_effect_reaches_its_steady_state(effects, column, expected):
    truth = sail(Scenario(effects=effects, excitation=STILL, duration_s=20.0), 1)
    assert truth[column][-1] == pytest.approx(expected, rel=2e-3)


def test_depth_gauge_ahead_of_the_centre_dips_with_the_nose():
    effects = Effects(depth_sensor_lever_arm=0.5, trim_moment=-8.1986)
    truth = sail(Scenario(effects=effects, excitation=STILL, duration_s=20.0), 1)
    assert truth["sensed_depth_m"][-1] - truth["depth_m"][-1] == pytest.approx(0.5 * np.sin(0.1), rel=1e-3)


def test_lost_buoyancy_grows_with_depth(tmp_path):
    scenario = replace(held(tmp_path, (0.0, 0.1)), effects=Effects(depth_dependent_buoyancy=0.5))
    still = sail(replace(scenario, effects=Effects()), 1)
    assert sail(scenario, 1)["depth_m"][-1] > still["depth_m"][-1] + 0.05


def test_speed_falls_in_manoeuvres_and_returns(tmp_path):
    scenario = held(tmp_path, (0.0, 0.0), (2.0, 0.25), (8.0, 0.0))
    effects = Effects(speed_loss=1.0, heave_pitch_rate_coupling=1.0, large_angle_kinematics=1.0)
    speed = sail(replace(scenario, effects=effects, duration_s=40.0), 1)["speed_mps"]
    assert speed[:200] == pytest.approx(2.5, abs=1e-9)
    assert speed[200:800].min() < 2.42
    assert speed[-1] > speed[200:800].min() + 0.03


@pytest.mark.parametrize("name", [field.name for field in fields(Effects)])
def test_effect_changes_the_run_and_vanishes_at_size_zero(name):
    excitation = Excitation(program="doublets", pulse_s=1.0, rest_s=2.0)
    base = Scenario(excitation=excitation, start=Start(depth=3.0), duration_s=12.0)
    plain = sail(base, 1)
    size = SIZES.get(name, 0.1)
    seen = ("depth_m", "pitch_rad", "speed_mps", "plane_rad", "sensed_depth_m", "sensed_pitch_rad")

    def difference(value: object) -> float:
        run = sail(replace(base, effects=replace(Effects(), **{name: value})), 1)
        return max(float(np.max(np.abs(run[column] - plain[column]))) for column in seen)

    assert difference(size) > 1e-5
    off = 0.0 if isinstance(size, float) else replace(size, size=0.0)
    assert difference(off) == 0.0


def test_timed_effect_begins_on_time():
    base = Scenario(excitation=Excitation(amplitude=0.2), duration_s=12.0)
    plain = sail(base, 1)
    for name in ("ballast_change", "rudder_effectiveness_change"):
        run = sail(replace(base, effects=Effects(**{name: SIZES[name]})), 1)
        changed = np.flatnonzero(run["heave_mps"] != plain["heave_mps"])
        assert run["time_s"][changed[0]] == pytest.approx(5.0, abs=0.011)


def test_effects_at_work_are_named_while_they_act():
    effects = Effects(net_buoyancy=2.0, ballast_change=Timed(size=0.5, at_s=10.0))
    assert effects.at_work(9.9) == {"net_buoyancy": (2.0, "N")}
    assert effects.at_work(10.0) == {"net_buoyancy": (2.0, "N"), "ballast_change": (0.5, "kg")}


def test_surface_waves_have_their_height_and_decay_with_depth():
    def head(depth: float) -> np.ndarray:
        waves = SurfaceWaves(size=2.0, period_s=6.0, components=60)
        scenario = Scenario(effects=Effects(surface_waves=waves), start=Start(depth=depth))
        sea = Plant(scenario, 4).sea
        return np.array([sea.water(0.1 * k, depth).head for k in range(20000)])

    # Four standard deviations of the surface; a few per cent lie outside the band of the components.
    assert 4 * np.std(head(0.0)) == pytest.approx(2.0, rel=0.05)
    number = (2 * pi / 6.0) ** 2 / GRAVITY
    assert np.std(head(10.0)) / np.std(head(0.0)) == pytest.approx(np.exp(-10 * number), rel=0.25)


def test_internal_wave_carries_the_vehicle_by_its_amplitude():
    wave = InternalWave(size=0.05, period_s=40.0)
    truth = sail(Scenario(effects=Effects(internal_wave=wave), excitation=STILL, duration_s=80.0), 1)
    assert np.ptp(truth["depth_m"]) == pytest.approx(2 * 0.05 * 40.0 / (2 * pi), rel=1e-3)


def test_quadratic_drag_limits_the_heave_of_a_buoyant_hull():
    effects = Effects(net_buoyancy=20.0, heave_quadratic_drag=100.0)
    truth = sail(Scenario(effects=effects, excitation=STILL, duration_s=30.0), 1)
    linear = 36.58872 * 2.5
    expected = (-linear + sqrt(linear**2 + 4 * 100.0 * 20.0)) / (2 * 100.0)
    assert truth["heave_mps"][-1] == pytest.approx(-expected, rel=1e-3)


def test_large_angle_restoring_lengthens_the_swing():
    """The period of a free pendulum grows by 1 + amplitude^2/16."""
    hull = Hull(Mq=0.0)

    def period(share: float) -> float:
        scenario = Scenario(
            hull=hull,
            effects=Effects(large_angle_restoring=share),
            excitation=STILL,
            start=Start(pitch=0.8),
            duration_s=10.0,
        )
        truth = sail(scenario, 1)
        pitch, t_s = truth["pitch_rad"], truth["time_s"]
        down = np.flatnonzero((pitch[:-1] > 0) & (pitch[1:] <= 0))
        crossing = t_s[down] + 0.01 * pitch[down] / (pitch[down] - pitch[down + 1])
        return float(np.diff(crossing).mean())

    assert period(1.0) / period(0.0) == pytest.approx(1 + 0.8**2 / 16 + 11 * 0.8**4 / 3072, rel=1e-3)


def test_large_angle_kinematics_climb_with_the_sine():
    effects = Effects(large_angle_kinematics=1.0)
    hull = Hull(zb=1e-9, Mq=-100.0)  # holds its pitch
    truth = sail(
        Scenario(
            hull=hull, effects=effects, excitation=STILL, start=Start(pitch=0.5, depth=50.0), duration_s=10.0
        ),
        1,
    )
    assert truth["depth_m"][0] - truth["depth_m"][-1] == pytest.approx(25.0 * np.sin(0.5), rel=1e-5)


def test_vehicle_does_not_fly():
    """A hull 30 N light rises until enough of it is out of the water, and stays there."""
    effects = Effects(net_buoyancy=30.0)
    start = Start(depth=1.0, speed=0.5)
    depth = sail(Scenario(effects=effects, excitation=STILL, start=start, duration_s=150.0), 1)["depth_m"]
    assert depth[-1] == pytest.approx(-0.3 * 30.0 / (70.0 * GRAVITY + 30.0), rel=0.05)


def test_unstable_vehicle_is_refused_in_one_line():
    scenario = Scenario(hull=Hull(Mq=50.0), start=Start(pitch=0.1))
    with pytest.raises(ScenarioError, match=r"stay finite \(got .* after \d+\.\d+ s\)"):
        sail(scenario, 1)


def test_result_does_not_depend_on_the_step():
    scenario = replace(load("rough_sea"), duration_s=60.0)
    scenario = replace(
        scenario, effects=replace(scenario.effects, actuator_backlash=0.0, actuator_rate_limit=0.0)
    )
    coarse, fine = sail(replace(scenario, step_s=0.02), 1), sail(replace(scenario, step_s=0.005), 1)
    assert np.max(np.abs(coarse["depth_m"] - fine["depth_m"][::4])) < 0.02
    assert np.max(np.abs(coarse["pitch_rad"] - fine["pitch_rad"][::4])) < 0.002
