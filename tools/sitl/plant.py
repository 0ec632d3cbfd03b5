"""The simulated vehicle in its water, one integration step at a time."""

import zlib
from math import sin
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tools.sitl.actuator import Actuator
from tools.sitl.errors import ScenarioError
from tools.sitl.excitation import Commander, make_law
from tools.sitl.hull import Body, Motion
from tools.sitl.scenario import Scenario
from tools.sitl.sea import Sea
from tools.sitl.sensors import DepthAndPitchSensing


def stream(seed: int, name: str) -> np.random.Generator:
    """Random numbers of one purpose: other purposes neither see nor shift them."""
    return np.random.default_rng([seed, zlib.crc32(name.encode())])


_MOST_TURN = 100.0  # rad/s; beyond these the numbers mean nothing
_MOST_SPEED = 100.0  # m/s


class Instant(NamedTuple):
    """The truth at one time; `command` and `plane` are those in force from then on."""

    t_s: float
    depth: float  # m
    pitch: float  # rad
    pitch_rate: float  # rad/s
    heave: float  # m/s, body axes, through the water
    speed: float  # m/s, body axes, through the water
    command: float  # rad
    plane: float  # rad
    water: float  # m/s, vertical velocity of the water, down
    sensed_depth: float  # m, what a perfect gauge reads where the gauge sits
    sensed_pitch: float  # rad


class Plant:
    """Integrates the vehicle with the classical Runge-Kutta method; the water is frozen over one step.

    The actuator is advanced exactly within the step, so that its lag costs no accuracy. Commands change at
    multiples of `excitation.update_s`, which are grid instants.
    """

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.step_s = scenario.step_s
        self.steps = 0
        start = scenario.start
        self.motion: Motion = (start.speed, start.heave, start.pitch_rate, start.pitch, start.depth)
        self.hydrodynamics = scenario.hull.body(scenario.effects, start.speed, start.depth)
        self.body: Body = self.hydrodynamics  # around which other physics may be put
        self.sea = Sea(scenario.effects, start.speed, stream(seed, "sea"))
        self.actuator = Actuator(scenario.effects, scenario.step_s)
        self.sensing = DepthAndPitchSensing(scenario.effects, scenario.step_s)
        law = make_law(scenario.excitation, start.depth, Path(scenario.folder), stream(seed, "excitation"))
        self.commander = Commander(scenario.excitation, law)
        self.steps_per_command = round(scenario.excitation.update_s / scenario.step_s)
        self.command = 0.0
        self.planes = (0.0, 0.0, 0.0)
        self.now = self._look()

    def step(self) -> Instant:
        """Advances by one step and returns the truth there; `now` keeps it."""
        t_s, half = self.now.t_s, self.step_s / 2
        depth = self.motion[4]
        water = self.sea.water(t_s + half, depth)
        velocity, turning = water.velocity, water.pitch_rate
        lift = self.actuator.lift_angle
        first, middle, last = self.planes
        begin = lift(first, t_s)
        mid = begin if middle == first else lift(middle, t_s)
        end = begin if last == first else lift(last, t_s)
        rates = self.body.rates
        x = self.motion
        k1 = rates(x, begin, t_s, velocity, turning)
        k2 = rates(_along(x, k1, half), mid, t_s, velocity, turning)
        k3 = rates(_along(x, k2, half), mid, t_s, velocity, turning)
        k4 = rates(_along(x, k3, self.step_s), end, t_s, velocity, turning)
        sixth = self.step_s / 6
        self.motion = (
            x[0] + sixth * (k1[0] + 2 * (k2[0] + k3[0]) + k4[0]),
            x[1] + sixth * (k1[1] + 2 * (k2[1] + k3[1]) + k4[1]),
            x[2] + sixth * (k1[2] + 2 * (k2[2] + k3[2]) + k4[2]),
            x[3] + sixth * (k1[3] + 2 * (k2[3] + k3[3]) + k4[3]),
            x[4] + sixth * (k1[4] + 2 * (k2[4] + k3[4]) + k4[4]),
        )
        self.steps += 1
        if not (abs(self.motion[2]) < _MOST_TURN and abs(self.motion[1]) < _MOST_SPEED):
            state = ", ".join(f"{value:.3g}" for value in self.motion)
            raise ScenarioError(
                f"hull and effects must let the motion stay finite (got u, w, q, pitch, depth = {state}"
                f" after {self.steps * self.step_s:.2f} s)"
            )
        self.now = self._look()
        return self.now

    def _look(self) -> Instant:
        """The truth now, after the autopilot has had its turn."""
        u, w, q, theta, depth = self.motion
        t_s = self.steps * self.step_s
        water = self.sea.water(t_s, depth)
        if self.steps % self.steps_per_command == 0:
            self.command = self.commander.command(t_s, depth, theta, q)
        self.planes = self.actuator.move(self.command)
        sensed_depth, sensed_pitch = self.sensing.follow(depth, sin(theta), theta, water.head)
        return Instant(
            t_s,
            depth,
            theta,
            q,
            w,
            u,
            self.command,
            self.planes[0],
            water.velocity,
            sensed_depth,
            sensed_pitch,
        )


def _along(x: Motion, rate: Motion, step_s: float) -> Motion:
    return (
        x[0] + step_s * rate[0],
        x[1] + step_s * rate[1],
        x[2] + step_s * rate[2],
        x[3] + step_s * rate[3],
        x[4] + step_s * rate[4],
    )
