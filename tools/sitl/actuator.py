"""The stern plane's drive: what becomes of a commanded angle."""

from collections import deque
from math import exp

from tools.sitl.effects import Effects

STALL_SLOPE = -0.5  # lift lost per radian beyond the stall angle, in units of the lift slope below it
STALL_FLOOR = 0.5  # the share of the greatest lift that a fully stalled plane keeps


class Actuator:
    """Command -> delay -> stops -> servo (lag, rate limit) -> play in the linkage -> offset -> plane.

    Each `move` covers one integration step and gives the plane at its beginning, middle and end.
    """

    def __init__(self, effects: Effects, step_s: float) -> None:
        self.effects = effects
        self.half_step = step_s / 2
        self.pending = deque([0.0] * round(effects.actuator_delay / step_s))
        self.servo = 0.0
        self.linkage = 0.0
        self.follow = 1.0 - exp(-self.half_step / effects.actuator_lag) if effects.actuator_lag > 0.0 else 1.0
        self.is_direct = effects.actuator_lag == 0.0 and effects.actuator_rate_limit == 0.0

    def move(self, command: float) -> tuple[float, float, float]:
        """Plane angles, rad, while `command` is in force over one step."""
        self.pending.append(command)
        target = self.pending.popleft()
        stop = self.effects.actuator_saturation
        if stop > 0.0:
            target = min(max(target, -stop), stop)
        if self.is_direct:
            self.servo = target
            plane = self._plane()
            return plane, plane, plane
        return self._plane(), self._half(target), self._half(target)

    def lift_angle(self, plane: float, t_s: float) -> float:
        """The angle of a whole, unstalled plane that would make the same force."""
        stall = self.effects.rudder_stall
        if stall > 0.0 and abs(plane) > stall:
            lift = max(stall + STALL_SLOPE * (abs(plane) - stall), STALL_FLOOR * stall)
            plane = lift if plane > 0.0 else -lift
        loss = self.effects.rudder_effectiveness_change
        return plane * (1.0 - loss.size) if t_s >= loss.at_s else plane

    def _half(self, target: float) -> float:
        change = (target - self.servo) * self.follow
        limit = self.effects.actuator_rate_limit * self.half_step
        if limit > 0.0:
            change = min(max(change, -limit), limit)
        self.servo += change
        return self._plane()

    def _plane(self) -> float:
        play = self.effects.actuator_backlash / 2
        self.linkage = min(max(self.linkage, self.servo - play), self.servo + play)
        return self.linkage + self.effects.rudder_offset
