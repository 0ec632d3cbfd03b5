"""Asynchronous measurements to samples on the fixed grid of the estimator. Gaps stay gaps."""

from collections import Counter
from dataclasses import dataclass
from math import nan

from bridge.measurement import Measurement, Quantity
from firmware_model.sample import Sample
from host.live.channel import Channel

_HELD = Quantity.RUDDER
_NEEDED = frozenset({Quantity.DEPTH, Quantity.PITCH, Quantity.RUDDER})

# A measurement this close to a grid instant, in steps, is taken as it is.
_ON_GRID = 0.01

# So many measurements refused in a row as older than their channel mean that the clock was set back.
_CLOCK_SET_BACK = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignConfig:
    """The grid, and how far a measurement reaches. A duration left out follows from the step.

    max_gap at 2.5 steps bridges one lost message of a channel that comes once a step, jitter included, and
    not two: a straight line over two steps still follows a vehicle that the step was chosen for.
    """

    step: float = 0.1  # s, > 0: the grid, and the estimator's interval h
    max_gap: float | None = None  # s, >= step: longest bracket that is interpolated; default 2.5 steps
    rudder_hold: float | None = None  # s, > 0: how long a rudder command is held; default 1 s or 2.5 steps
    rudder_on_change: bool = False  # it is sent only when it changes: silence means that it is as it was
    latency: float | None = None  # s, >= max_gap: wait for a late channel; default 0.5 s or max_gap
    split_gap: float | None = None  # s, > latency: a silence that starts anew; default 5 s or 10 steps

    def __post_init__(self) -> None:
        if not 1e-3 <= self.step <= 3600:
            raise ValueError(f"step must be 0.001 to 3600 s (got {self.step})")
        if not self.step <= self.max_gap_s <= 1e6:
            raise ValueError(f"max_gap must be at least step = {self.step} s (got {self.max_gap})")
        if not 0 < self.rudder_hold_s <= 1e6:
            raise ValueError(f"rudder_hold must be positive (got {self.rudder_hold})")
        if not self.max_gap_s <= self.latency_s <= 1e6:
            raise ValueError(f"latency must be at least max_gap = {self.max_gap_s} s (got {self.latency})")
        if not self.latency_s < self.split_gap_s <= 1e6:
            raise ValueError(
                f"split_gap must be more than latency = {self.latency_s} s (got {self.split_gap})"
            )

    @property
    def max_gap_s(self) -> float:
        return 2.5 * self.step if self.max_gap is None else self.max_gap

    @property
    def rudder_hold_s(self) -> float:
        return max(1.0, 2.5 * self.step) if self.rudder_hold is None else self.rudder_hold

    @property
    def latency_s(self) -> float:
        return max(0.5, self.max_gap_s) if self.latency is None else self.latency

    @property
    def split_gap_s(self) -> float:
        return max(5.0, 10 * self.step, 2 * self.latency_s) if self.split_gap is None else self.split_gap


class Aligner:
    """Turns measurements, pushed in the order in which they came, into samples at whole steps.

    Depth, pitch, speed and pitch rate at an instant are the measurement itself or the straight line between
    its two neighbours; nothing is extrapolated. The rudder is a command that the actuator holds. That of a
    sample is its mean over the step that follows: a plane that turns between two instants does so neither
    early nor late. Where a message was lost and the next one differs, it is unknown from when the lost one
    was due.

    An instant is complete when every channel has passed it, and the rudder the next one, or when one is
    `latency` beyond it. The grid starts at the first pitch measurement, the signal that interpolation would
    harm most.

    The result does not depend on how channels interleave as long as they lag one another by less than
    latency - max_gap.

    segment  counts the pieces of time that nothing may be joined across: a restart of the vehicle, a silence
             longer than split_gap, a clock set back. Samples that a push returns while it starts a new
             segment are the end of the old one.
    counts   "samples", "segments", and by cause "refused.duplicate", "refused.backwards",
             "refused.old_boot", "clock_set_back", "late" (used, but an instant that wanted it was complete)
    """

    def __init__(self, config: AlignConfig) -> None:
        self.segment = 0
        self.counts: Counter[str] = Counter()
        self._step_us = round(config.step * 1e6)
        self._max_gap_us = round(config.max_gap_s * 1e6)
        self._hold_us = round(config.rudder_hold_s * 1e6)
        self._rudder_on_change = config.rudder_on_change
        self._latency_us = round(config.latency_s * 1e6)
        self._split_us = round(config.split_gap_s * 1e6)
        self._near_us = round(_ON_GRID * config.step * 1e6)
        self._boot = 0
        self._newest: int | None = None  # time of the newest measurement of the segment
        self._next: int | None = None  # the instant to complete next; None until the grid is placed
        self._channels = {quantity: Channel() for quantity in Quantity}
        self._refused_in_a_row = 0

    def push(self, measurement: Measurement) -> list[Sample]:
        """The samples that this measurement completes, oldest first."""
        t_us = measurement.t_us
        if self._newest is None:
            return self._start(measurement, [])
        if measurement.boot < self._boot:
            self.counts["refused.old_boot"] += 1
            return []
        if measurement.boot > self._boot or t_us - self._newest > self._split_us:
            return self._start(measurement, self.flush())
        channel = self._channels[measurement.quantity]
        if channel.times and t_us == channel.times[-1]:
            self.counts["refused.duplicate"] += 1
            return []
        if t_us < (channel.times[-1] if channel.times else self._newest - self._split_us):
            return self._refuse_backwards(measurement)
        self._refused_in_a_row = 0
        if self._next is not None and t_us < self._next:
            self.counts["late"] += 1
        channel.append(t_us, measurement.value)
        self._newest = max(self._newest, t_us)
        return self._complete()

    def flush(self) -> list[Sample]:
        """The samples up to the newest measurement; the next push starts a new segment."""
        samples: list[Sample] = []
        if self._newest is not None:
            self._place_grid()
            while self._next is not None and self._next <= self._newest:
                samples.append(self._emit(self._next))
        self._clear()
        return samples

    def _clear(self) -> None:
        self._newest = self._next = None
        self._channels = {quantity: Channel() for quantity in Quantity}
        self._refused_in_a_row = 0

    def _start(self, measurement: Measurement, ended: list[Sample]) -> list[Sample]:
        if self.counts["segments"]:
            self.segment += 1
        self.counts["segments"] += 1
        self._boot = measurement.boot
        self._newest = measurement.t_us
        self._channels[measurement.quantity].append(measurement.t_us, measurement.value)
        return ended

    def _refuse_backwards(self, measurement: Measurement) -> list[Sample]:
        self.counts["refused.backwards"] += 1
        self._refused_in_a_row += 1
        if self._refused_in_a_row < _CLOCK_SET_BACK:
            return []
        self.counts["clock_set_back"] += 1
        return self._start(measurement, self.flush())

    def _complete(self) -> list[Sample]:
        assert self._newest is not None
        if self._next is None:
            first = min(channel.times[0] for channel in self._channels.values() if channel.times)
            if self._newest < first + self._latency_us:
                return []
            self._place_grid()
        samples: list[Sample] = []
        while self._next is not None and self._is_complete(self._next):
            samples.append(self._emit(self._next))
        return samples

    def _place_grid(self) -> None:
        if self._next is None:
            firsts = {
                quantity: channel.times[0] for quantity, channel in self._channels.items() if channel.times
            }
            self._next = firsts.get(Quantity.PITCH, min(firsts.values()))

    def _is_complete(self, t_us: int) -> bool:
        assert self._newest is not None
        if self._newest >= t_us + self._latency_us:
            return True
        return all(
            channel.times and channel.times[-1] >= (t_us + self._step_us if quantity is _HELD else t_us)
            for quantity, channel in self._channels.items()
            if quantity in _NEEDED or channel.times
        )

    def _emit(self, t_us: int) -> Sample:
        at: dict[Quantity, float] = {}
        for quantity, channel in self._channels.items():
            if quantity is _HELD:
                at[quantity] = self._held(channel, t_us)
            else:
                at[quantity] = channel.interpolated(t_us, self._max_gap_us, self._near_us)
            channel.forget_before(t_us)
        self._next = t_us + self._step_us
        self.counts["samples"] += 1
        return Sample(
            t_us=t_us,
            depth=at[Quantity.DEPTH],
            pitch=at[Quantity.PITCH],
            rudder=at[Quantity.RUDDER],
            speed=at[Quantity.SPEED],
            pitch_rate=at[Quantity.PITCH_RATE],
        )

    def _held(self, channel: Channel, t_us: int) -> float:
        assert self._newest is not None
        until_us = t_us + self._step_us
        # Further on, how much has come depends on how the channels interleave.
        known_to_us = min(self._newest, t_us + self._max_gap_us)
        if not self._rudder_on_change and channel.has_lost_change(t_us, until_us, known_to_us, self._near_us):
            return nan
        return channel.held_mean(t_us, until_us, self._hold_us, self._near_us)
