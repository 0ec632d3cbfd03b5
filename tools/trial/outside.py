"""Physics that no catalogue entry describes, put around the plant's own body."""

from dataclasses import dataclass
from math import cos, pi, sin, tanh

from tools.sitl.hull import Body, Motion


class Foreign:
    """Additions to the plant; each kind overrides what it changes. `size` in the kind's own unit."""

    def bend(self, plane: float, motion: Motion, t_s: float) -> float:  # noqa: ARG002
        """The angle, rad, at which the plane acts."""
        return plane

    def push(self, motion: Motion, t_s: float) -> tuple[float, float]:  # noqa: ARG002
        """Added heave acceleration, m/s2, and pitch acceleration, rad/s2."""
        return 0.0, 0.0


@dataclass(slots=True)
class RestoringHysteresis(Foreign):
    """A cubic restoring moment that follows the pitch with play, as liquid in a baffled tank does.

    size is the acceleration per cubed angle (1/s2), play the half width of the play (rad).
    """

    size: float
    play: float
    follows: float = 0.0

    def push(self, motion: Motion, t_s: float) -> tuple[float, float]:  # noqa: ARG002
        pitch = motion[3]
        self.follows = min(max(self.follows, pitch - self.play), pitch + self.play)
        return 0.0, -self.size * self.follows**3


@dataclass(slots=True)
class OneWayPlane(Foreign):
    """A plane that bites better while the nose rises than while it falls: share `size` more and less."""

    size: float
    slow: float  # rad/s, below which there is no difference

    def bend(self, plane: float, motion: Motion, t_s: float) -> float:  # noqa: ARG002
        return plane * (1.0 + self.size * tanh(motion[2] / self.slow))


@dataclass(slots=True)
class RotatingMass(Foreign):
    """A mass that turns about a transverse axis: a periodic moment of `size` rad/s2."""

    size: float
    period_s: float
    phase: float

    def push(self, motion: Motion, t_s: float) -> tuple[float, float]:  # noqa: ARG002
        return 0.0, self.size * sin(2 * pi * t_s / self.period_s + self.phase)


@dataclass(slots=True)
class StickyPlane(Foreign):
    """A plane that catches at the angle `at` and lets go when driven further than `size` rad away."""

    size: float
    at: float
    is_caught: bool = False

    def bend(self, plane: float, motion: Motion, t_s: float) -> float:  # noqa: ARG002
        away = abs(plane - self.at)
        self.is_caught = away < (self.size if self.is_caught else self.size / 2)
        return self.at if self.is_caught else plane


@dataclass(slots=True)
class DriftingTrim(Foreign):
    """A moment that wanders to and fro by `size` rad/s2 once in the run, as a leaking trim tank's does."""

    size: float
    duration_s: float

    def push(self, motion: Motion, t_s: float) -> tuple[float, float]:  # noqa: ARG002
        return 0.0, self.size * sin(2 * pi * t_s / self.duration_s) * cos(0.7 * pi * t_s / self.duration_s)


@dataclass(slots=True)
class OneWayDrag(Foreign):
    """Drag on the keel alone: quadratic in heave, `size` 1/m, while the vehicle sinks through the water."""

    size: float

    def push(self, motion: Motion, t_s: float) -> tuple[float, float]:  # noqa: ARG002
        w = motion[1]
        return (-self.size * w * w if w > 0.0 else 0.0), 0.0


@dataclass(frozen=True, slots=True)
class ForcedBody:
    """A body with something foreign at work on it."""

    body: Body
    foreign: Foreign

    def rates(
        self, motion: Motion, plane: float, t_s: float, water: float, water_pitch_rate: float
    ) -> Motion:
        acting = self.foreign.bend(plane, motion, t_s)
        du, dw, dq, turn, climb = self.body.rates(motion, acting, t_s, water, water_pitch_rate)
        heave, pitch = self.foreign.push(motion, t_s)
        return du, dw + heave, dq + pitch, turn, climb
