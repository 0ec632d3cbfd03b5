"""What a Kalman filter on the reference model did not foresee, and how each simple change would show in it.

A filter with the reference for its model follows the vehicle; waves and noise leave innovations that have a
spectrum but no level. They are averaged over short blocks. With each block stands how its mean would answer
to a change that came before it and to one that goes on in it, so that the mark which a change would have left
since any moment is a product over blocks:

    d+ = (I - K H) d,   d(k+1) = F d+ + change(k),   expected innovation = H d / sqrt(H P H' + R)

with d the error that the change makes of the filter's state (A. Willsky, H. Jones, IEEE Trans. Automatic
Control 21(1), 1976).
"""

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from firmware_model.sample import Sample
from host.live.reference import THETA, ZETA, Array, Reference

CHANGES = {
    "heave_force": "heave",
    "heave_damping": "heave",
    "pitch_moment": "pitch",
    "pitch_damping": "pitch",
    "pitch_restoring": "pitch",
    "plane_force": "actuator",
    "plane_delay": "actuator",
    "forward_speed": "surge",
    "pitch_datum": "sensor",
}
"""The simple changes, and the slot of the chain that each belongs to."""
NAMES = tuple(CHANGES)
LACKING = ("heave_drag", "heave_by_turning", "pitch_by_heave", "plane_at_large_angles")
"""What a linear reference may lack all along, besides: w|w| and q in heave, w in pitch, delta|delta|."""
SLOWING = ("speed_by_plane", "speed_by_pitch")
"""What it lacks of the forward speed, which drag of the plane and weight along the hull change late:
T s' = delta^2 - s and T s' = theta - s, m/s once times their sizes, in all terms that grow with u or u^2."""
MARKS = NAMES + LACKING + SLOWING
SPEED = 4 + len(NAMES + LACKING)
DATUM = 4 + NAMES.index("pitch_datum")

SPEED_LAG = 5.0  # s, T; with 1.5 to 12 s the alarm tells as much
AGITATION = 0.1  # m/s^2 and rad/s^2, per root of Hz: what pushes the vehicle beside its plane
PLANE_DOUBT = 0.1  # rad, by which a plane that is not heard may have moved
MOST_NOISE = 0.9  # quantile of the second differences that tells the noise: outliers are above it
SPIKE = 6.0  # spreads of the noise by which a value stands out from both its neighbours, and is none
OUTLIER = 10.0  # spreads of an innovation beyond which a value is not believed
MOST_REFUSED = 5  # values in a row; more of them are believed
LEAST_PRESENT = 0.4  # share of a block that must have been measured
START = np.diag([0.1, 0.1, 0.1, 1.0])  # covariance of the state at a beginning


class Block(NamedTuple):
    """The innovations of one block, in units of their spread.

    mean      of pitch and depth, (2,); 0 where too few were measured
    mark      what the state's error at its beginning (4) and each of `MARKS` in it add to that mean,
              (2, 4 + marks)
    passage   what they make of the state's error at its end, (4, 4 + marks)
    """

    mean: Array
    mark: Array
    passage: Array


class Innovations:
    """The blocks of the last `blocks` x `samples` samples of `step` s. `noise`: the least, rad and m."""

    def __init__(self, step: float, samples: int, blocks: int, noise: Array) -> None:
        self.blocks: deque[Block] = deque(maxlen=blocks)
        self._step, self._samples, self._least_noise = step, samples, noise
        self._noise = noise
        self._rows: deque[tuple[float, float, float, float]] = deque(maxlen=samples * blocks)
        self._reference: Reference | None = None
        self.clear()

    def clear(self) -> None:
        """Joins nothing across this moment."""
        self.blocks.clear()
        self._rows.clear()
        self._t_us: int | None = None
        self._waiting: Sample | None = None
        self._believed = [math.nan, math.nan]
        self._begin()

    def _begin(self) -> None:
        self._state = np.zeros(4)
        self._covariance = START.copy()
        self._refused = [0, 0]
        self._has_begun = False
        self._slowed = np.zeros(len(SLOWING))
        self._open_block()

    def _open_block(self) -> None:
        self._taken = 0
        self._sums, self._counts = np.zeros(2), np.zeros(2)
        self._marks = np.zeros((2, 4 + len(MARKS)))
        self._passage = np.eye(4, 4 + len(MARKS))

    def follow(self, reference: Reference) -> None:
        """Filters with this reference from now on, and once more what is remembered."""
        self._reference = reference
        self._noise = np.maximum(self._least_noise, _noise_of(np.array(self._rows).reshape(-1, 4)[:, :2]))
        self._move, push = reference.discrete(self._step)
        heave, pitch, sinking = push.T
        plane = reference.b1 * heave + reference.b2 * pitch
        changes = [heave, heave, pitch, pitch, pitch, plane, plane, -sinking, np.zeros(4)]
        self._changes = np.stack([*changes, heave, heave, pitch, plane], axis=1)
        self._by_plane = plane
        turning = reference.a2 * pitch + reference.c_wq * heave
        per_speed = np.stack([reference.a1 * heave, turning, 2.0 * plane], axis=1) / reference.u0
        self._by_speed = np.column_stack([per_speed, -sinking])
        self._steady = reference.heave_offset * heave + reference.pitch_offset * pitch
        agitation = AGITATION**2 * self._step
        self._unrest = np.diag([agitation, agitation, 1e-8, 1e-8])
        self.blocks.clear()
        self._begin()
        for row in self._rows:
            self._filter(*row)

    def push(self, sample: Sample) -> bool:
        """Takes the next sample; one that is not the next on the grid begins anew. True as a block ends."""
        if self._t_us is not None and abs(sample.t_us - self._t_us - 1e6 * self._step) > 1e5 * self._step:
            self.clear()
        self._t_us = sample.t_us
        before, self._waiting = self._waiting, sample
        if before is None:
            return False
        row = (
            self._without_spike(0, before.pitch, sample.pitch),
            self._without_spike(1, before.depth, sample.depth),
            before.rudder,
            before.speed,
        )
        self._rows.append(row)
        return self._reference is not None and self._filter(*row)

    def _without_spike(self, channel: int, value: float, after: float) -> float:
        """The value, or NaN where it stands out from the one before and the one after."""
        limit, last = SPIKE * self._noise[channel], self._believed[channel]
        if math.isnan(value):
            return value
        stands_out = (value - last > limit and value - after > limit) or (
            last - value > limit and after - value > limit
        )
        if stands_out:
            return math.nan
        self._believed[channel] = value
        return value

    def _filter(self, pitch: float, depth: float, rudder: float, speed: float) -> bool:
        """One step. True as a block ends."""
        x, P, d = self._state, self._covariance, self._passage
        if not self._has_begun:
            x[[THETA, ZETA]] = np.nan_to_num([pitch, depth])
            self._held = 0.0 if math.isnan(rudder) else rudder
            self._has_begun = True
        for channel, value in enumerate((pitch, depth)):
            if math.isnan(value):
                continue
            place = THETA + channel
            variance = P[place, place] + self._noise[channel] ** 2
            spread, error = math.sqrt(variance), value - x[place]
            if abs(error) > OUTLIER * spread and self._refused[channel] < MOST_REFUSED:
                self._refused[channel] += 1
                continue
            self._refused[channel] = 0
            gain, answer = P[:, place] / variance, d[place].copy()
            if place == THETA:
                answer[DATUM] += 1.0
            self._sums[channel] += error / spread
            self._marks[channel] += answer / spread
            self._counts[channel] += 1
            x, P, d = x + gain * error, P - np.outer(gain, P[place]), d - np.outer(gain, answer)
        is_heard = not math.isnan(rudder)
        turned = (rudder - self._held) / self._step if is_heard else 0.0
        self._held = plane = rudder if is_heard else self._held
        w, q, theta, _ = x.tolist()
        d = self._move @ d
        d[:, 4:SPEED] += self._changes * (
            *(1.0, w, 1.0, q, theta, plane, turned, theta, 0.0),
            *(w * abs(w), q, w, plane * abs(plane)),
        )
        d[:, SPEED:] += np.outer(self._by_speed @ (w, q, plane, theta), self._slowed)
        self._slowed += self._step / SPEED_LAG * (np.array([plane**2, theta]) - self._slowed)
        x = self._move @ x + self._steady + plane * self._by_plane
        if not math.isnan(speed) and self._reference is not None:
            x[ZETA] -= (speed - self._reference.u0) * theta * self._step
        P = self._move @ P @ self._move.T + self._unrest
        if not is_heard:
            P += PLANE_DOUBT**2 * np.outer(self._by_plane, self._by_plane)
        self._state, self._covariance, self._passage = x, P, d
        self._taken += 1
        if self._taken < self._samples:
            return False
        share = np.where(
            self._counts >= LEAST_PRESENT * self._samples, 1.0 / np.maximum(self._counts, 1), 0.0
        )
        self.blocks.append(Block(share * self._sums, share[:, None] * self._marks, d))
        self._open_block()
        return True

    @property
    def means(self) -> Array:
        """Of the blocks, (blocks, 2)."""
        return np.array([block.mean for block in self.blocks]).reshape(-1, 2)

    def marks(self, lengths: list[int]) -> Array:
        """What each of `MARKS` would have left in the last blocks, (longest, 2, lengths, marks).

        lengths   blocks since it came, the longest first
        """
        longest = lengths[0]
        error = np.zeros((4, len(lengths), len(MARKS)))
        found = np.zeros((longest, 2, len(lengths), len(MARKS)))
        for k, block in enumerate(list(self.blocks)[-longest:]):
            begun = sum(longest - length <= k for length in lengths)
            now = error[:, :begun]
            found[k, :, :begun] = np.tensordot(block.mark[:, :4], now, 1) + block.mark[:, None, 4:]
            error[:, :begun] = np.tensordot(block.passage[:, :4], now, 1) + block.passage[:, None, 4:]
        return found


def _noise_of(rows: Array) -> Array:
    """Standard deviation of the white noise of each column, (2,), by second differences; 0 where too few."""
    bends = np.abs(np.diff(rows, 2, axis=0)) / math.sqrt(6.0)
    known = [bend[np.isfinite(bend)] for bend in bends.T]
    return np.array([np.quantile(k, MOST_NOISE) / 1.645 if len(k) >= 20 else 0.0 for k in known])
