"""Says when the vehicle no longer moves as it was known to: the live alarm.

A reference model foretells the vehicle in two ways. A filter that follows it leaves innovations; freed of the
spectrum that waves and noise have given them so far, they speak for or against each simple change since each
of some moments (`host.live.evidence`). And once a second the reference runs freely over the last seconds
(`host.live.prediction_window`). Both are judged by what was usual, and by more where the vehicle moves more
than it ever did: a rough sea, a nonlinear hull and a noisy sensor set their own level. An alarm is evidence
well beyond the strongest that was usual while the free runs miss by more as well, or free runs that miss by
twice the worst that was usual for many seconds.

The reference is a snapshot of the live estimate, taken a minute or two late, and kept until one that is
clearly better comes while nothing looks suspicious: what the estimator learns of a fault cannot hide it.
"""

from collections import deque
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from firmware_model.config import EstimatorConfig
from firmware_model.estimate import Estimate
from firmware_model.sample import Sample
from host.live.evidence import evidence_of
from host.live.innovations import CHANGES, NAMES, Innovations
from host.live.prediction_history import HELD_BACK, SMALLEST, Comparison, Past, PredictionHistory
from host.live.prediction_window import PredictionWindow
from host.live.reference import Array, Reference, read_reference, reference_of
from host.live.whitening import LEAST, ORDER, Whitening

SLOTS = ("none", "heave", "pitch", "kinematics", "surge", "actuator", "sensor", "environment", "unknown")
"""Slots by the number under which they are published."""
SENTENCES = {
    "heave": "a heave force has come (ballast, buoyancy), or a vertical current",
    "pitch": "a pitch moment or the hull's damping has changed (trim, shifted load)",
    "actuator": "the stern plane no longer works as it did (damage, weed, slow drive)",
    "surge": "the forward speed is another (thrust, drag)",
    "sensor": "the pitch sensor has another datum",
    "unknown": "no single change explains it (rougher water, or several changes)",
}

BLOCKS = 20  # of innovations, in a horizon
MOMENTS = [80, 60, 40, 30, 20, 15, 10]  # blocks ago, since when a change may have been
IN_A_ROW = 2  # windows whose evidence is averaged
LEAST_RATIO = 1.4  # of the prediction error to the usual, without which evidence is no alarm
SEEN_IN = 10  # windows, in one of which it must have been
LEVEL_WINDOWS = 60  # windows that set the units in which a channel's errors count
SUSPICIOUS = 0.7  # of what is an alarm: from here on the reference is kept as it is
BETTER = 0.9  # ratio of prediction errors below which a new snapshot takes the place of the reference
SHORT_WAIT, LONG_WAIT = 3, 6  # windows for which an alarm that still grows waits: its first moments mislead
PLAIN = 1.25  # of what is an alarm: beyond that the wait is long
LARGEST_RATIO = 655.0  # that is sent
EXPLAINED = 0.2  # share of the innovations' excess that a change must explain to be named
AS_GOOD = 0.85  # of what the best change explains: one of another slot that explains more is as good


@dataclass(frozen=True, slots=True, kw_only=True)
class MismatchConfig:
    """The alarm of a live run. Durations left out follow from the estimator's pitch time T."""

    enabled: bool = True
    model: Path | None = None  # model.json to predict with; left out: the best that was learnt on the way
    horizon: float | None = None  # s, > 0: length of a free run; default 10 T (10 s)
    period: float | None = None  # s, > 0: between two free runs; default a tenth of the horizon
    persistence: int = 20  # free runs, 1 to 100, over which their errors are averaged
    threshold: float = 1.4  # > 0: evidence that is an alarm, by the strongest that is usual
    memory: float = 1800.0  # s, > 0: past that sets the level
    settling: float = 120.0  # s, >= 0: past without which nothing is judged, also after an alarm
    refresh: float = 60.0  # s, > 0: between two snapshots of the live estimate

    def __post_init__(self) -> None:
        for name in ("horizon", "period", "threshold", "memory", "refresh"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value <= 1e6:
                raise ValueError(f"{name} must be above 0 (got {value})")
        if not 0.0 <= self.settling <= 1e6:
            raise ValueError(f"settling must be 0 s or more (got {self.settling})")
        if not 1 <= self.persistence <= 100:
            raise ValueError(f"persistence must be 1 to 100 (got {self.persistence})")


@dataclass(frozen=True, slots=True, kw_only=True)
class Mismatch:
    """One alarm.

    t_us      when it was raised, vehicle clock
    slot      where in the chain, one of `SLOTS`
    change    the simple change that explains most of it; "" for slot unknown
    others    slots of changes that explain it about as well
    channel   "pitch" or "depth", whose prediction error grew more
    ratio     its prediction error over the level before, in the worst of the last windows
    explained share of the innovations' excess that the change explains
    """

    t_us: int
    slot: str
    change: str
    others: tuple[str, ...]
    channel: str
    ratio: float
    explained: float

    @property
    def sentence(self) -> str:
        return (
            f"the vehicle no longer moves as predicted: {self.channel} error x{self.ratio:.1f}; "
            f"slot {' or '.join((self.slot, *self.others))}: {SENTENCES[self.slot]}"
        )

    @property
    def notice(self) -> str:
        """At most 50 characters, for a ground station."""
        return f"mils mismatch: {self.slot}, {self.channel} error x{min(self.ratio, LARGEST_RATIO):.1f}"

    @property
    def values(self) -> dict[str, float]:
        """By the names that go onto the link."""
        return {"mismatch": float(SLOTS.index(self.slot)), "mism_ratio": min(self.ratio, LARGEST_RATIO)}


class MismatchWatch:
    """Takes every sample of a run, and the estimate when it asks for one.

    Raises ConfigError when the model file of the configuration cannot be used.
    """

    def __init__(self, config: MismatchConfig, estimator: EstimatorConfig) -> None:
        self.current: Mismatch | None = None
        """The last alarm, until the vehicle as it is now has become the usual one."""
        self._config = config
        step = estimator.step
        horizon = 10.0 * estimator.pitch_time if config.horizon is None else config.horizon
        period = 0.1 * horizon if config.period is None else config.period
        self._every = max(1, round(period / step))
        self._refresh = max(1, round(config.refresh / step / self._every)) * self._every
        self._settling = max(1, round(config.settling / step / self._every))
        self._learning = round(config.settling / step)
        noise = np.array([estimator.robust.pitch_noise, estimator.robust.depth_noise])
        self._floor = 0.5 * noise
        self._fixed = None if config.model is None else read_reference(config.model)
        block = max(1, round(horizon / BLOCKS / step))
        held_back = round(HELD_BACK * self._every / block)
        memory = round(config.memory / step)
        self._window = PredictionWindow(max(10, round(horizon / step)), step)
        self._innovations = Innovations(step, block, MOMENTS[0] + ORDER, noise)
        self._whitening = Whitening(held_back, max(LEAST, memory // block))
        self._history = PredictionHistory(max(SMALLEST, memory // self._every), len(MOMENTS))
        self._growths: deque[Array] = deque(maxlen=config.persistence)
        self._strengths: deque[Array] = deque(maxlen=IN_A_ROW)
        self._ratios: deque[Array] = deque(maxlen=SEEN_IN)
        self._samples = 0
        self._begin()

    def _begin(self) -> None:
        """Knows nothing: first the units of the errors are learnt, then what is usual."""
        self.reference: Reference | None = None
        """What is predicted with; None before anything is known."""
        self._candidate: Reference | None = None
        self._is_suspicious = False
        self._levels = self._floor
        self._first_errors: list[Array] = []
        self._history.clear()
        self._whitening.clear()
        self._forget_recent()
        if self._fixed is not None:
            self._follow(self._fixed)

    def _forget_recent(self) -> None:
        self._growths.clear()
        self._strengths.clear()
        self._ratios.clear()
        self._waited = 0
        self._size = 0.0

    def clear(self) -> None:
        """Joins nothing across this moment: the vehicle rebooted, or its clock started anew."""
        self._window.clear()
        self._innovations.clear()
        self._forget_recent()

    @property
    def wants_estimate(self) -> bool:
        """Whether the next `push` should have the live estimate with it."""
        return self._fixed is None and (self._samples + 1) % self._refresh == 0

    def push(self, sample: Sample, estimate: Estimate | None = None) -> Mismatch | None:
        """An alarm, if this sample raises one."""
        self._window.push(sample)
        if self._innovations.push(sample):
            self._whitening.take(self._innovations.means)
        self._samples += 1
        if estimate is not None:
            self._take(estimate)
        is_due = self._samples % self._every == 0 and self._window.is_full
        if self.reference is None or not is_due or not self._window.moves(2.0 * self._floor):
            return None
        errors = self._window.errors(self.reference, self._levels)
        if len(self._first_errors) < LEVEL_WINDOWS:
            self._first_errors.append(errors)
            if len(self._first_errors) == LEVEL_WINDOWS:
                self._levels = np.maximum(self._floor, self._levels * np.median(self._first_errors, axis=0))
            return None
        if len(self._innovations.blocks) < MOMENTS[0] + ORDER or not self._whitening.is_known:
            return None
        evidence = evidence_of(self._innovations, self._whitening, MOMENTS, self._history.lacking)
        return self._judge(Comparison(errors, evidence), sample.t_us)

    def _take(self, estimate: Estimate) -> None:
        """The snapshot before this one becomes the reference, if nothing looks wrong and it is better."""
        snapshot = reference_of(estimate) if estimate.updates >= self._learning else None
        if snapshot is None or not snapshot.is_usable or self._is_suspicious:
            snapshot, self._candidate = None, None
        earlier, self._candidate = self._candidate, snapshot
        self._is_suspicious = False
        if earlier is None:
            return
        if self.reference is None:
            self._follow(earlier)
        elif self._window.is_full:
            before = self._window.errors(self.reference, self._levels)
            after = self._window.errors(earlier, self._levels)
            if (after <= BETTER * before).all():
                self._follow(earlier)

    def _follow(self, reference: Reference) -> None:
        self.reference = reference
        self._innovations.follow(reference)
        self._history.begin_lacking()
        if not self._whitening.has_begun:
            means = self._innovations.means
            for k in range(len(means)):
                self._whitening.take(means[: k + 1])

    def _judge(self, found: Comparison, t_us: int) -> Mismatch | None:
        past = self._history.usual_for(found)
        self._history.add(found)
        if past is None:
            self._forget_recent()
            return None
        self._strengths.append(past.strength(found))
        self._growths.append(past.growth(found))
        self._ratios.append(found.errors / past.usual_errors)
        size = float(np.abs(np.mean(self._strengths, axis=0)).max()) / self._config.threshold
        if np.max(self._ratios) < LEAST_RATIO:
            size = min(size, 1.0)
        if len(self._growths) == self._config.persistence:
            size = max(size, float(np.mean(self._growths, axis=0).max()))
        self._is_suspicious |= size > SUSPICIOUS
        if self._history.size < self._settling:
            return None
        self.current = None
        is_growing, self._size = size > self._size, size
        if size <= 1.0 and not self._waited:
            return None
        self._waited += 1
        if is_growing and self._waited < (LONG_WAIT if size > PLAIN else SHORT_WAIT):
            return None
        self.current = _explained(found, past, np.max(self._ratios, axis=0), t_us)
        self._begin()
        return self.current


def _explained(found: Comparison, past: Past, ratios: Array, t_us: int) -> Mismatch:
    """The alarm with the change, and its moment, that explain most of the innovations' excess.

    By least squares a change takes the square of its ratio off the sum of their squares.
    """
    news = found.evidence.ratios**2
    gains = news.max(axis=0)
    slots = [CHANGES[name] for name in NAMES]
    best = int(np.argmax(gains))
    moment = int(np.argmax(news[:, best]))
    excess = float(found.evidence.squares[moment] - np.mean(past.squares[:, moment]))
    explained = min(float(gains[best]) / max(excess, 1e-9), 1.0)
    is_named = explained >= EXPLAINED
    as_good = {slot: None for slot, gain in zip(slots, gains, strict=True) if gain > AS_GOOD * gains[best]}
    worse = int(np.argmax(ratios))
    return Mismatch(
        t_us=t_us,
        slot=slots[best] if is_named else "unknown",
        change=NAMES[best] if is_named else "",
        others=tuple(slot for slot in as_good if is_named and slot != slots[best]),
        channel=("pitch", "depth")[worse],
        ratio=float(ratios[worse]),
        explained=explained,
    )
