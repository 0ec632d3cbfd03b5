"""From the true motion to what instruments say of it."""

from dataclasses import dataclass, field
from math import exp, nan

import numpy as np
import numpy.typing as npt

from tools.sitl.effects import Effects
from tools.sitl.strict import require

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """Faults of one measured channel, in the channel's own SI unit; the defaults are a perfect instrument."""

    rate_hz: float = 10.0
    noise: float = 0.0  # standard deviation, white
    quantum: float = 0.0  # resolution; 0 for none
    jitter_s: float = 0.0  # each sample's time is off the regular one by up to this
    latency_s: float = 0.0  # the value is this much older than its time stamp
    loss: float = 0.0  # share of samples that vanish one by one
    burst_every_s: float = 0.0  # mean time between bursts in which all samples vanish; 0 for none
    burst_s: float = 1.0  # mean length of a burst
    nan: float = 0.0  # share of samples that arrive as NaN
    outliers: float = 0.0  # share of samples that are wrong by a normal deviation of outlier_size
    outlier_size: float = 0.0

    def __post_init__(self) -> None:
        require(0.0 < self.rate_hz <= 1000.0, "rate_hz", "be in (0, 1000]", self.rate_hz)
        for name in ("noise", "quantum", "burst_every_s", "outlier_size"):
            require(getattr(self, name) >= 0.0, name, "be >= 0", getattr(self, name))
        for name in ("loss", "nan", "outliers"):
            require(0.0 <= getattr(self, name) <= 1.0, name, "be in [0, 1]", getattr(self, name))
        require(
            0.0 <= self.jitter_s < 0.5 / self.rate_hz, "jitter_s", "be in [0, half a sample)", self.jitter_s
        )
        require(0.0 <= self.latency_s <= 10.0, "latency_s", "be in [0, 10] s", self.latency_s)
        require(self.burst_s > 0.0, "burst_s", "be > 0 s", self.burst_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensors:
    """The channels of the vehicle; `rudder_is_measured` sends the true plane angle, not the command."""

    depth: Channel = field(default_factory=Channel)
    pitch: Channel = field(default_factory=Channel)
    rudder: Channel = field(default_factory=Channel)
    speed: Channel = field(default_factory=Channel)
    pitch_rate: Channel = field(default_factory=Channel)
    rudder_is_measured: bool = False


class Instrument:
    """One channel at work: call with rising times, one by one or many at once."""

    def __init__(self, channel: Channel, rng: np.random.Generator) -> None:
        self.channel = channel
        self.rng = rng
        self.bursts: list[float] = [0.0]  # ends of quiet and lost spans, alternately

    def times(self, duration_s: float) -> Array:
        """Time stamps of the samples within a run."""
        count = int(duration_s * self.channel.rate_hz + 1e-9) + 1
        regular: Array = np.arange(count) / self.channel.rate_hz
        if self.channel.jitter_s == 0.0:
            return regular
        off = self.rng.uniform(-self.channel.jitter_s, self.channel.jitter_s, count)
        return np.maximum(regular + off, 0.0)

    def arrives(self, t_s: Array) -> npt.NDArray[np.bool_]:
        """Which samples are not lost."""
        arrived: npt.NDArray[np.bool_] = np.ones(len(t_s), dtype=bool)
        if self.channel.loss > 0.0:
            arrived &= self.rng.random(len(t_s)) >= self.channel.loss
        if self.channel.burst_every_s > 0.0 and len(t_s):
            while self.bursts[-1] <= t_s[-1]:
                quiet = len(self.bursts) % 2 == 1
                mean = self.channel.burst_every_s if quiet else self.channel.burst_s
                self.bursts.append(self.bursts[-1] + self.rng.exponential(mean))
            arrived &= np.searchsorted(self.bursts, t_s, side="right") % 2 == 1
        return arrived

    def says(self, true_values: Array) -> Array:
        """What the instrument reports for the given truth."""
        channel, count = self.channel, len(true_values)
        values = true_values
        if channel.noise > 0.0:
            values = values + channel.noise * self.rng.standard_normal(count)
        if channel.outliers > 0.0:
            wrong = self.rng.random(count) < channel.outliers
            values = values + wrong * channel.outlier_size * self.rng.standard_normal(count)
        if channel.quantum > 0.0:
            values = np.round(values / channel.quantum) * channel.quantum
        if channel.nan > 0.0:
            values = np.where(self.rng.random(count) < channel.nan, nan, values)
        return values

    def read(self, true_value: float) -> float:
        """`says` for one value."""
        return float(self.says(np.array([true_value]))[0])

    def loses(self, t_s: float) -> bool:
        """Whether the sample of this time is lost."""
        return not self.arrives(np.array([t_s]))[0]


class Lag:
    """A first-order lag, exact for a value that changes linearly within a step; 0 s is none."""

    def __init__(self, time_s: float, step_s: float) -> None:
        self.keeps = exp(-step_s / time_s) if time_s > 0.0 else 0.0
        self.behind = (1.0 - self.keeps) * time_s / step_s  # of one step's change
        self.felt = self.shown = nan

    def follow(self, felt: float) -> float:
        """What is shown one step later; the first call starts settled."""
        if self.shown != self.shown:
            self.felt = self.shown = felt
        change = felt - self.felt
        self.shown = felt - self.behind * change + self.keeps * (self.shown - self.felt)
        self.felt = felt
        return self.shown


class DepthAndPitchSensing:
    """The physical side of the instruments: where they sit and how slowly they answer."""

    def __init__(self, effects: Effects, step_s: float) -> None:
        self.lever_arm = effects.depth_sensor_lever_arm
        self.bias = effects.pitch_bias
        self.depth = Lag(effects.depth_sensor_lag, step_s)
        self.pitch = Lag(effects.pitch_sensor_lag, step_s)

    def follow(self, depth: float, sine_of_pitch: float, pitch: float, head: float) -> tuple[float, float]:
        """Sensed depth and pitch one step later; `head` is the pressure head of the waves, m."""
        felt_depth = depth - self.lever_arm * sine_of_pitch + head
        return self.depth.follow(felt_depth), self.pitch.follow(pitch) + self.bias
