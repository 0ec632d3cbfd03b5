"""Every entry of the catalogue: complete, differentiable, and acting."""

from dataclasses import replace
from itertools import combinations

import casadi as ca
import numpy as np
import pytest
from hidden_dive import BASE, hidden_dive
from scipy.integrate import solve_ivp, trapezoid

from host.catalogue import BY_NAME, CATALOGUE, UNKNOWN, structure_of
from host.dynamics.propagate import free_run, inputs_of
from host.dynamics.sensitivities import innovations
from host.recordings.recording import Recording

NAMES_OF_THE_FORMAT = {
    "heave_pitch_rate_coupling", "heave_quadratic_drag", "net_buoyancy", "depth_dependent_buoyancy",
    "ballast_change", "pitch_quadratic_damping", "trim_moment", "munk_moment", "large_angle_restoring",
    "large_angle_kinematics", "speed_loss", "actuator_lag", "actuator_delay", "actuator_rate_limit",
    "actuator_saturation", "actuator_backlash", "rudder_offset", "rudder_stall",
    "rudder_effectiveness_change", "depth_sensor_lever_arm", "depth_sensor_lag", "pitch_bias",
    "pitch_sensor_lag", "vertical_current", "internal_wave", "surface_waves",
}  # fmt: skip
SCALES = {"": 1.0, "speed": 2.5, "rudder": 0.25, "duration": 30.0, "depth": 20.0}
START = np.array([0.05, 0.02, 0.03, 20.0, 0.0])
SLOW = np.array([*START[:4], -0.2])  # not yet at the speed of steady flight


def probe_of(name: str) -> np.ndarray:  # type: ignore[type-arg]
    effect = BY_NAME[name]
    scales = effect.scales or ("",) * len(effect.parameters)
    values = [v * SCALES[s] for v, s in zip(effect.probes[-1], scales, strict=True)]
    # Amplitudes that start at nothing are given a size here, or there would be nothing to see.
    return np.array([value if value else 0.03 for value in values])


def test_catalogue_holds_every_name_that_users_rely_on() -> None:
    assert {effect.name for effect in CATALOGUE} >= NAMES_OF_THE_FORMAT


PAIRS = [
    ("actuator_lag", "actuator_rate_limit"),
    ("actuator_lag", "rudder_stall"),
    ("depth_sensor_lag", "depth_sensor_lever_arm"),
]
WITH_WHAT_THEY_CHANGE = [(*effect.changes, name) for name, effect in sorted(BY_NAME.items())]


@pytest.mark.parametrize("names", [*WITH_WHAT_THEY_CHANGE, *PAIRS], ids="+".join)
def test_effects_act_and_their_sensitivities_are_exact(names: tuple[str, ...]) -> None:
    dive = hidden_dive(duration=30.0)
    recording = replace(dive, time=1.0 + dive.time)  # a stretch, as only within a recording the speed is free
    structure = structure_of(names)
    inputs = inputs_of(recording, structure)
    probes = [probe_of(effect.name) for effect in structure.effects]
    values = np.concatenate([[*BASE.values(), 0.0, 0.0], *probes])
    run = free_run(values, SLOW, inputs).outputs
    plain = free_run(values[:8], SLOW, inputs_of(recording)).outputs
    assert np.abs(run - plain).max() > 1e-5
    _, sensitivity = innovations(values, SLOW, inputs)
    point = np.concatenate([values, SLOW])
    for index in range(point.size):
        change = np.zeros(point.size)
        change[index] = 1e-6 * max(1.0, abs(point[index]))
        ends = [
            free_run(*np.split(point + sign * change, [values.size]), inputs).outputs for sign in (1.0, -1.0)
        ]
        slope = (ends[0] - ends[1]) / (2.0 * change[index])
        assert np.allclose(sensitivity[:, index], slope, atol=2e-4 * max(np.abs(slope).max(), 1e-6))


EACH = 10


def finer(rows: Recording) -> Recording:
    """The same commands on ten rows each."""
    count = rows.time.size * EACH
    blank, step = np.full(count, np.nan), rows.step / EACH
    return replace(
        rows, step=step, time=step * np.arange(count), rudder=np.repeat(rows.rudder, EACH), depth=blank,
        pitch=blank, speed=blank, pitch_rate=blank,
    )  # fmt: skip


@pytest.mark.parametrize("lag", [0.03, 0.15, 1.0])
@pytest.mark.parametrize("name", ["pitch_sensor_lag", "depth_sensor_lag"])
def test_a_sensor_lag_is_exact_however_short_beside_the_rows(name: str, lag: float) -> None:
    rows = hidden_dive(duration=30.0)
    structure, values = structure_of((name,)), np.array([*BASE.values(), 0.0, 0.0, lag])
    run = free_run(values, START, inputs_of(rows, structure, longest_substep=0.1)).outputs
    true = free_run(values, START, inputs_of(finer(rows), structure)).outputs[:, ::EACH]
    channel = 0 if name.startswith("pitch") else 1
    # As if the lag were another by less than 1 ms.
    rate = np.abs(np.gradient(true[channel], rows.step)).max()
    assert np.abs(run - true)[channel].max() < 1e-3 * rate


@pytest.mark.parametrize("delay", [0.04, 0.13, 0.25])
def test_a_delay_is_that_of_the_command_however_coarse_the_rows(delay: float) -> None:
    rows = hidden_dive(duration=30.0)
    values = np.array([*BASE.values(), 0.0, 0.0])
    run = free_run(np.append(values, delay), START, inputs_of(rows, structure_of(("actuator_delay",))))
    late = np.concatenate([np.full(round(delay * 100.0), rows.rudder[0]), np.repeat(rows.rudder, EACH)])
    fine = finer(rows)
    moved = replace(fine, rudder=late[: fine.time.size])
    true = free_run(values, START, inputs_of(moved)).outputs[:, ::EACH]
    assert np.abs(run.outputs - true).max() < 1e-3 * np.ptp(true, axis=1).min()


def test_the_zero_error_of_a_plane_is_delayed_with_its_command() -> None:
    rows = hidden_dive(duration=30.0)
    both = inputs_of(rows, structure_of(("rudder_offset", "actuator_delay")))
    values = dict.fromkeys(both.structure.names, 0.0) | BASE | {"rudder_zero": 0.02, "delay": 0.25}
    run = free_run(np.array([values[name] for name in both.structure.names]), START, both)
    shifted = inputs_of(replace(rows, rudder=rows.rudder + 0.02), structure_of(("actuator_delay",)))
    true = free_run(np.array([*BASE.values(), 0.0, 0.0, 0.25]), START, shifted)
    np.testing.assert_allclose(run.outputs, true.outputs, atol=1e-9)


def test_the_zero_error_of_a_plane_lies_behind_its_stops() -> None:
    rows = hidden_dive(duration=30.0)
    both = inputs_of(rows, structure_of(("rudder_offset", "actuator_saturation")))
    values = dict.fromkeys(both.structure.names, 0.0) | BASE | {"rudder_zero": 0.02, "plane_limit": 0.1}
    run = free_run(np.array([values[name] for name in both.structure.names]), START, both)
    moved = inputs_of(replace(rows, rudder=np.clip(rows.rudder, -0.1, 0.1) + 0.02))
    true = free_run(np.array([*BASE.values(), 0.0, 0.0]), START, moved)
    np.testing.assert_allclose(run.outputs, true.outputs, atol=1e-9)


def test_a_plane_that_is_damaged_as_it_moves_loses_its_force_within_a_row() -> None:
    rows = hidden_dive(duration=30.0)
    moves = rows.time[1:][np.diff(rows.rudder) != 0.0]
    moment = float(moves[moves > 10.0][0])
    damaged = inputs_of(rows, structure_of(("rudder_effectiveness_change",)))
    run = free_run(np.array([*BASE.values(), 0.0, 0.0, -0.3, moment]), START, damaged).outputs
    whole = np.array([*BASE.values(), 0.0, 0.0])
    lost = np.where(rows.time > moment - 0.01, 0.7, 1.0) * rows.rudder
    true = free_run(whole, START, inputs_of(replace(rows, rudder=lost))).outputs
    without = free_run(whole, START, inputs_of(rows)).outputs
    assert np.abs(run - true).max() < 0.02 * np.abs(without - true).max()


@pytest.mark.parametrize("share", [0.0, 0.4, 0.9])
def test_a_stalled_plane_keeps_a_share_of_its_greatest_lift(share: float) -> None:
    rows = hidden_dive(duration=30.0)
    stalled = inputs_of(rows, structure_of(("rudder_stall",)))
    stall = {"stall_angle": 0.05, "stall_loss": 1.5, "stall_share": share}
    values = dict.fromkeys(stalled.structure.names, 0.0) | BASE | stall
    run = free_run(np.array([values[name] for name in stalled.structure.names]), START, stalled)
    size = np.abs(rows.rudder)
    lift = np.where(size < 0.05, size, np.maximum(0.05 - 0.5 * (size - 0.05), share * 0.05))
    true = free_run(
        np.array([*BASE.values(), 0.0, 0.0]),
        START,
        inputs_of(replace(rows, rudder=np.sign(rows.rudder) * lift)),
    )
    np.testing.assert_allclose(run.outputs, true.outputs, atol=1e-9)
    assert size.max() > 0.1


@pytest.mark.parametrize(("lag", "most"), [(0.1, 5e-4), (0.15, 2e-4), (0.4, 1e-4)])
@pytest.mark.parametrize("loss", [0.7, 1.0, 1.6, 2.5])
def test_a_slow_plane_stalls_where_it_passes_the_angle_however_coarse_the_rows(
    lag: float, most: float, loss: float
) -> None:
    rows, structure = hidden_dive(duration=30.0), structure_of(("actuator_lag", "rudder_stall"))
    stall = {"lag_time": lag, "stall_angle": 0.08, "stall_loss": loss, "stall_share": 0.3}
    known = dict.fromkeys(structure.names, 0.0) | BASE | stall
    values = np.array([known[name] for name in structure.names])
    run = free_run(values, START, inputs_of(rows, structure, longest_substep=0.1)).outputs
    true = free_run(values, START, inputs_of(finer(finer(rows)), structure)).outputs[:, :: EACH**2]
    assert np.abs(run - true)[0].max() < most  # rad


@pytest.mark.parametrize("lag", [0.05, 0.6])
def test_a_slow_depth_sensor_feels_the_depth_where_it_sits(lag: float) -> None:
    rows, names = hidden_dive(duration=30.0), ("depth_sensor_lag", "depth_sensor_lever_arm")
    structure = structure_of(names)
    values = dict.fromkeys(structure.names, 0.0) | BASE | {"depth_lag_time": lag, "sensor_forward": 0.8}
    run = free_run(np.array([values[n] for n in structure.names]), START, inputs_of(rows, structure, 0.05))
    fine = finer(finer(rows))
    _, _, theta, zeta = free_run(np.array([*BASE.values(), 0.0, 0.0]), START, inputs_of(fine)).states
    felt = zeta - 0.8 * np.sin(theta)
    reading, read = felt[0], np.empty(felt.size)
    for k, depth in enumerate(felt):
        reading = depth + (reading - depth) * np.exp(-fine.step / lag)
        read[k] = reading
    rate = np.abs(np.gradient(felt, fine.step)).max()
    np.testing.assert_allclose(run.outputs[1], read[:: EACH**2], atol=1.5 * fine.step * rate)


def test_a_low_centre_of_gravity_feels_a_change_of_speed() -> None:
    # With the planes level and no heave only the surge acceleration turns the vehicle: theta = -u'/g.
    still = hidden_dive(duration=30.0)
    ramp = replace(still, rudder=np.zeros(still.time.size), speed=2.0 + 0.05 * still.time)
    inputs = inputs_of(ramp, structure_of(("surge_pitch_coupling",)))
    run = free_run(
        np.array([*BASE.values(), 0.0, 0.0, 1.0, 0.0]), np.array([0.0, 0.0, 0.0, 20.0, 0.0]), inputs
    )
    settled = run.outputs[0, 150:250]
    np.testing.assert_allclose(settled, -0.05 / 9.80665, rtol=0.02)


@pytest.mark.parametrize(
    ("w", "q"), [(0.3, 0.1), (0.1, 0.3), (-0.2, 0.5), (0.4, -0.5), (0.0, 0.3), (0.3, 0.0), (0.4, 0.5)]
)
def test_drag_along_the_hull_is_the_integral_over_its_length(w: float, q: float) -> None:
    half, drag, damping = 0.8, -1.5, -4.0
    structure = structure_of(("heave_quadratic_drag", "pitch_quadratic_damping", "drag_along_the_hull"))
    own = {"c_ww": drag, "c_qq": damping, "drag_half_length": half}
    values = dict.fromkeys(structure.names, 0.0) | own
    chain = structure.chain(
        *map(ca.DM, ([w, q, 0.0, 0.0], [values[n] for n in structure.names], [0.0] * 6, 0.0))
    )
    force, moment = np.array(ca.evalf(structure.derivative(chain))).ravel()[:2]
    y = np.linspace(-half, half, 20001)
    local = (w - y * q) * np.abs(w - y * q)
    assert force == pytest.approx(drag * trapezoid(local, y) / (2.0 * half), abs=1e-6)
    assert moment == pytest.approx(damping * -2.0 / half**4 * trapezoid(y * local, y), abs=1e-6)


@pytest.mark.parametrize(("time", "share"), [(10.0, 0.0), (30.0, 1.0)])
def test_a_weight_that_came_off_the_centre_turns_the_hull(time: float, share: float) -> None:
    weight, forward, below, theta = 0.06, 0.3, 0.2, 0.5
    structure = structure_of(("ballast_change", "ballast_off_centre"))
    own = {"c_wb": weight, "ballast_time": 20.0, "ballast_forward": forward, "ballast_below": below}
    values = dict.fromkeys(structure.names, 0.0) | own
    drive = [0.0, 0.0, 0.0, 0.1, time, 0.0]
    state, parameters = [0.0, 0.0, theta, 0.0], [values[n] for n in structure.names]
    chain = structure.chain(*map(ca.DM, (state, parameters, drive, time)))
    force, moment = np.array(ca.evalf(structure.derivative(chain))).ravel()[:2]
    # Down the hull's own axes: a weight ahead of the centre and below it turns the bow down as it pitches up.
    assert force == pytest.approx(share * weight * np.cos(theta))
    assert moment == pytest.approx(-share * weight * (forward * np.cos(theta) + below * np.sin(theta)))


def test_what_a_compressed_hull_loses_of_its_buoyancy_does_not_right_it() -> None:
    mass, in_heave, below, theta, g = 30.0, 57.0, 0.02, 0.3, 9.80665
    lost, inertia = 4.0, 10.0  # N, kg m^2
    structure = structure_of(("depth_dependent_buoyancy",))
    own = {"a3": -mass * g * below / inertia, "c_wz": lost / in_heave / 12.0, "neutral_depth": 8.0}
    values = dict.fromkeys(structure.names, 0.0) | own
    drive = [0.0, 0.0, 0.0, 0.1, 0.0, 0.0]
    state, parameters = [0.0, 0.0, theta, 20.0], [values[n] for n in structure.names]
    chain = structure.chain(*map(ca.DM, (state, parameters, drive, 0.0)))
    force, moment = np.array(ca.evalf(structure.derivative(chain))).ravel()[:2]
    assert force == pytest.approx(lost * np.cos(theta) / in_heave)
    change = moment - own["a3"] * theta
    assert change == pytest.approx(lost * below * np.sin(theta) / inertia, rel=1e-6)


@pytest.mark.parametrize("is_speed_known", [0.0, 1.0])
def test_a_speed_over_the_ground_lacks_what_the_water_moves_along_the_hull(is_speed_known: float) -> None:
    current, speed, theta = 0.3, 1.5, 0.5
    structure = structure_of(("vertical_current", "large_angle_kinematics", "speed_over_ground"))
    own = {"current": current, "kinematics_share": 1.0, "ground_share": 1.0, "u0": speed}
    values = dict.fromkeys(structure.names, 0.0) | own
    # Water that goes down meets a hull pitched nose up from ahead: along its axis (cos, -sin) theta.
    over_ground = speed - current * np.sin(theta)
    drive = [0.0, over_ground if is_speed_known else 0.0, is_speed_known, 0.1, 0.0, 0.0]
    state, parameters = [0.0, 0.0, theta, 0.0], [values[n] for n in structure.names]
    chain = structure.chain(*map(ca.DM, (state, parameters, drive, 0.0)))
    climb = float(np.array(ca.evalf(structure.derivative(chain))).ravel()[3])
    assert climb == pytest.approx(current - speed * np.sin(theta))


def test_turning_throws_the_hull_sideways_whatever_turns_it() -> None:
    structure = structure_of(("heave_pitch_acceleration_coupling", "munk_moment", "pitch_quadratic_damping"))
    own = {"a2": -0.5, "b2": -1.7, "c_qw": 4.0, "c_qq": -20.0, "c_wa": -0.03}
    values = dict.fromkeys(structure.names, 0.0) | own
    state, drive = [0.3, 0.2, 0.1, 0.0], [0.2, 0.0, 0.0, 0.1, 0.0, 0.0]
    chain = structure.chain(*map(ca.DM, (state, [values[n] for n in structure.names], drive, 0.0)))
    force, moment = np.array(ca.evalf(structure.derivative(chain))).ravel()[:2]
    assert moment == pytest.approx(-0.5 * 0.2 - 1.7 * 0.2 + 4.0 * 0.3 - 20.0 * 0.2**2)
    assert force == pytest.approx(-0.03 * moment)


def test_a_low_centre_of_gravity_pulls_at_the_hull_as_it_swings() -> None:
    # m (w' - u q - zG q^2) = Z and m (u' + w q + zG q') = X, beside the moment of the weight.
    recording = hidden_dive(duration=20.0)
    recovery, mass_ratio, lever, g = 20.0, 1.8, 0.05, 9.80665
    structure = structure_of(("speed_loss", "surge_pitch_coupling"))
    own = {
        "speed_time": recovery,
        "c_ud": 0.0,
        "c_uq": mass_ratio,
        "pendulum_share": 1.0,
        "pendulum_lever": lever,
    }
    values = dict.fromkeys(structure.names, 0.0) | BASE | own
    run = free_run(
        np.array([values[name] for name in structure.names]), START, inputs_of(recording, structure, 0.025)
    )
    x, outputs = np.array([*START[:4], 0.0]), []
    for rudder in recording.rudder:
        outputs.append(x[2:4])

        def rate(_: float, x: np.ndarray, plane: float = rudder) -> list[float]:  # type: ignore[type-arg]
            w, q, theta, _, change = x
            ratio = 1.0 + change / BASE["u0"]
            turning = BASE["a2"] * ratio * q + BASE["a3"] * theta + BASE["b2"] * ratio**2 * plane
            loss = -change * (1.0 + ratio) / 2.0 / recovery - mass_ratio * w * q
            # The weight is turned by u' as far as its own swing does not make it.
            turning += BASE["a3"] / g * (loss + q * w)
            return [
                BASE["a1"] * ratio * w + BASE["b1"] * ratio**2 * plane + lever * q**2,
                turning,
                q,
                w - (BASE["u0"] + change) * theta,
                loss - mass_ratio * lever * turning,
            ]

        x = solve_ivp(rate, (0.0, recording.step), x, rtol=1e-8, atol=1e-10).y[:, -1]
    np.testing.assert_allclose(run.outputs, np.array(outputs).T, atol=2e-3)


@pytest.mark.parametrize("name", sorted((BY_NAME | UNKNOWN).keys()))
def test_an_effect_of_no_size_is_absent(name: str) -> None:
    effect = (BY_NAME | UNKNOWN)[name]
    if not effect.size_names:
        pytest.skip("none of its parameters makes it absent")
    recording = hidden_dive(duration=30.0)
    probe = np.array(effect.probes[-1]) + 0.01
    sizes = [parameter.name in effect.size_names for parameter in effect.parameters]
    least = [max(parameter.lower, 0.0) for parameter in effect.parameters]  # a lag can only come near
    values = np.concatenate([[*BASE.values(), 0.0, 0.0], np.where(sizes, least, probe)])
    run = free_run(values, START, inputs_of(recording, structure_of((name,)))).outputs
    plain = free_run(values[:8], START, inputs_of(recording)).outputs
    # A lag time comes no nearer to zero than its bound.
    near = max(least) * np.abs(np.diff(plain, axis=1)).max() / recording.step
    assert np.abs(run - plain).max() < 1e-9 + 2.0 * near


def test_an_unknown_effect_is_a_key_error() -> None:
    with pytest.raises(KeyError, match="warp"):
        structure_of(("warp",))


@pytest.mark.parametrize("substep", [0.05, 0.1])
def test_a_servo_with_a_lag_and_a_limited_rate_is_one_servo(substep: float) -> None:
    rows, lag, rate = hidden_dive(duration=20.0), 0.3, 0.4
    structure = structure_of(("actuator_lag", "actuator_rate_limit"))
    known = BASE | {"heave_offset": 0.0, "pitch_offset": 0.0, "lag_time": lag, "plane_rate": rate}
    run = free_run(
        np.array([known[name] for name in structure.names]), START, inputs_of(rows, structure, substep)
    )
    plane, fine, followed = rows.rudder[0], 1000, []
    for command in rows.rudder:
        followed.append(plane)
        for _ in range(fine):
            plane += rows.step / fine * np.clip((command - plane) / lag, -rate, rate)
    assert np.ptp(np.diff(followed)) > 1.9 * rate * rows.step  # it was at its limit either way
    np.testing.assert_allclose(run.states[structure.states.index("lagged")], followed, atol=1e-4)


@pytest.mark.parametrize("lag", [0.05, 0.1, 0.4])
@pytest.mark.parametrize("delay", [0.0, 0.13, 0.25])
def test_a_servo_lag_is_exact_behind_a_delay_however_coarse_the_rows(lag: float, delay: float) -> None:
    rows, late = hidden_dive(duration=30.0), structure_of(("actuator_delay", "actuator_lag"))
    values = np.array([*BASE.values(), 0.0, 0.0])
    run = free_run(np.append(values, [delay, lag]), START, inputs_of(rows, late, 0.1))
    fine = finer(rows)
    commands = np.concatenate([np.full(round(delay / fine.step), rows.rudder[0]), fine.rudder])
    moved = replace(fine, rudder=commands[: fine.time.size])
    true = free_run(np.append(values, lag), START, inputs_of(moved, structure_of(("actuator_lag",))))
    off = run.outputs - true.outputs[:, ::EACH]
    # As if the plane were late by less than 2 ms.
    rate = np.abs(np.gradient(true.outputs, fine.step, axis=1)).max(axis=1)
    assert (np.abs(off).max(axis=1) < 2e-3 * rate).all()


DRIVE = {
    "actuator_delay": {"delay": 0.23},
    "actuator_saturation": {"plane_limit": 0.15},
    "actuator_rate_limit": {"plane_rate": 0.15},
    "actuator_lag": {"lag_time": 0.4},
    "actuator_backlash": {"backlash": 0.06},
}


@pytest.mark.parametrize("names", [*((name,) for name in DRIVE), *combinations(DRIVE, 2), tuple(DRIVE)])
def test_the_drive_of_the_plane_is_exact_however_coarse_the_rows(names: tuple[str, ...]) -> None:
    rows, structure = hidden_dive(duration=30.0), structure_of(names)
    known = BASE | {"heave_offset": 0.0, "pitch_offset": 0.0}
    for name in names:
        known |= DRIVE[name]
    values = np.array([known[name] for name in structure.names])
    run = free_run(values, START, inputs_of(rows, structure, 0.1)).outputs
    true = free_run(values, START, inputs_of(finer(rows), structure)).outputs[:, ::EACH]
    assert np.abs(run - true).max() < 1e-3 * np.ptp(true, axis=1).min()


@pytest.mark.parametrize(("name", "size"), [("net_buoyancy", "c_w0"), ("free_trim", "trim_heave")])
def test_a_net_weight_drives_a_pitched_hull_along_its_axis(name: str, size: str) -> None:
    # Where the speed has settled: 0 = -(u^2 - u0^2)/(2 u0 speed_time) - c_uq c_w0 sin theta.
    still = hidden_dive(duration=60.0)
    climb = replace(still, rudder=np.full(still.time.size, -0.2), speed=np.full(still.time.size, np.nan))
    structure = structure_of(("speed_loss", name))
    known = dict.fromkeys(structure.names, 0.0) | BASE
    known |= {"speed_time": 3.0, "c_uq": 1.9, size: 0.05}
    run = free_run(np.array([known[name] for name in structure.names]), START, inputs_of(climb, structure))
    theta, lost = run.outputs[0, -1], run.states[structure.states.index("speed_loss"), -1]
    u0 = BASE["u0"]
    assert theta > 0.05
    assert lost == pytest.approx((u0**2 - 2 * u0 * 3.0 * 1.9 * 0.05 * np.sin(theta)) ** 0.5 - u0, rel=1e-3)


def test_a_lag_at_its_least_is_none() -> None:
    # All that every vehicle has includes one: where there is none it must cost nothing.
    rows, lagging = hidden_dive(duration=30.0), structure_of(("actuator_lag",))
    values = np.array([*(BASE[name] for name in ("a1", "a2", "a3", "b1", "b2", "u0")), 0.0, 0.0])
    least = lagging.parameters[-1].lower
    own = np.append(values, least)
    ideal = free_run(values, START, inputs_of(rows)).outputs
    left = free_run(own, START, inputs_of(rows, lagging)).outputs - ideal
    assert np.abs(left[0]).max() < np.deg2rad(0.02)
    assert np.abs(left[1]).max() < 1e-3


MEMORY = ("actuator_delay", "actuator_rate_limit", "actuator_lag", "actuator_backlash")


@pytest.mark.parametrize("names", [*((name,) for name in MEMORY), MEMORY])
def test_the_plane_before_the_recording_is_where_delay_servo_and_play_begin(names: tuple[str, ...]) -> None:
    rows, lead = hidden_dive(duration=30.0), 20
    known = BASE | {"delay": 0.25, "plane_rate": 0.5, "lag_time": 0.4, "backlash": 0.04, "plane_before": 0.0}
    known |= {"heave_offset": 0.0, "pitch_offset": 0.0}
    at_rest = np.array([0.0, 0.0, 0.0, 20.0, 0.0])

    def run(rows: Recording, *more: str) -> np.ndarray:  # type: ignore[type-arg]
        structure = structure_of((*names, *more))
        values = np.array([known[name] for name in structure.names])
        return free_run(values, at_rest, inputs_of(rows, structure)).outputs

    blank = np.full(rows.time.size + lead, np.nan)
    begun = replace(
        rows, time=rows.step * np.arange(blank.size), rudder=np.append(np.zeros(lead), rows.rudder),
        depth=blank, pitch=blank, speed=blank, pitch_rate=blank,
    )  # fmt: skip
    cut = run(rows, "plane_before")
    np.testing.assert_allclose(cut, run(begun)[:, lead:], atol=1e-9)
    assert np.abs(cut - run(rows)).max() > 1e-3
    # A later stretch of a recording begins as the plane was commanded, not as it was before the recording.
    later = replace(rows, time=rows.time + 100.0)
    np.testing.assert_allclose(run(later, "plane_before"), run(later), atol=1e-9)
