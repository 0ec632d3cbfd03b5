"""Says when the vehicle no longer moves as it was known to: the live alarm.

Once a second a reference model runs freely over the last seconds (`host.live.prediction_window`). What it
misses is judged by what the same model missed before, while the vehicle moved at least as much: a rough sea,
a nonlinear hull and a noisy sensor set their own level, and only a change of that level tells. An alarm is a
mean of normalised deviations, over some windows in a row, that is longer than a threshold.

The reference is a snapshot of the live estimate, one to two minutes old and kept while anything looks
suspicious, so that what the estimator learns of a fault cannot hide it.
"""

from collections import deque
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from firmware_model.config import EstimatorConfig
from firmware_model.estimate import Estimate
from firmware_model.sample import Sample
from host.live.prediction_history import Past, PredictionHistory
from host.live.prediction_window import (
    CHANGES,
    NAMES,
    Array,
    Comparison,
    PredictionWindow,
    Reference,
    read_reference,
    reference_of,
)

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

LEVEL_WINDOWS = 60  # windows that set the units in which a channel's errors count
SUSPICIOUS = 0.5  # of the threshold: from here on the reference is kept as it is
NO_WORSE = 1.2  # ratio of prediction errors up to which a new snapshot is as good as the reference
LONGEST_WAIT = 10  # windows for which an alarm that still grows waits: the moment of the change misleads
LARGEST_RATIO = 655.0  # that is sent
EXPLAINED = 0.2  # share of the excess error that a change must explain to be named
AS_GOOD = 0.85  # of what the best change explains: one of another slot that explains more is as good
NAMING = 4  # windows, the last ones, that name the slot


@dataclass(frozen=True, slots=True, kw_only=True)
class MismatchConfig:
    """The alarm of a live run. Durations left out follow from the estimator's pitch time T."""

    enabled: bool = True
    model: Path | None = (
        None  # model.json to predict with; left out: what was learnt until a minute or two ago
    )
    horizon: float | None = None  # s, > 0: length of a free run; default 10 T (10 s)
    period: float | None = None  # s, > 0: between two free runs; default a tenth of the horizon
    persistence: int = 20  # free runs, 1 to 100, over which the deviation is averaged
    threshold: float = 3.5  # > 0: length of the mean deviation that is an alarm, in spreads of the past
    memory: float = 1800.0  # s, > 0: past that sets the level
    settling: float = 240.0  # s, >= 0: past without which nothing is judged, also after an alarm
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
    ratio     its prediction error over the level before
    explained share of the excess error that the change explains
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
        self._learning = round(0.5 * config.settling / step)
        self._floor = 0.5 * np.array([estimator.robust.pitch_noise, estimator.robust.depth_noise])
        self._fixed = None if config.model is None else read_reference(config.model)
        self._window = PredictionWindow(max(10, round(horizon / step)), step)
        self._history = PredictionHistory(max(self._settling, round(config.memory / step / self._every)))
        self._recent: deque[tuple[Comparison, Array]] = deque(maxlen=max(config.persistence, NAMING))
        self._samples = 0
        self._begin()

    def _begin(self) -> None:
        """Knows nothing: first the units of the errors are learnt, then what is usual."""
        self.reference = self._fixed
        """What is predicted with; None before anything is known."""
        self._candidate: Reference | None = None
        self._is_suspicious = False
        self._levels = self._floor
        self._first_errors: list[Array] = []
        self._history.clear()
        self._forget_recent()

    def _forget_recent(self) -> None:
        self._recent.clear()
        self._waited = 0
        self._size = 0.0

    def clear(self) -> None:
        """Joins nothing across this moment: the vehicle rebooted, or its clock started anew."""
        self._window.clear()
        self._forget_recent()

    @property
    def wants_estimate(self) -> bool:
        """Whether the next `push` should have the live estimate with it."""
        return self._fixed is None and (self._samples + 1) % self._refresh == 0

    def push(self, sample: Sample, estimate: Estimate | None = None) -> Mismatch | None:
        """An alarm, if this sample raises one."""
        self._window.push(sample)
        self._samples += 1
        if estimate is not None:
            self._take(estimate)
        is_due = self._samples % self._every == 0 and self._window.is_full
        if self.reference is None or not is_due or not self._window.moves(2.0 * self._floor):
            return None
        found = self._window.compare(self.reference, self._levels)
        if len(self._first_errors) < LEVEL_WINDOWS:
            self._first_errors.append(found.errors)
            if len(self._first_errors) == LEVEL_WINDOWS:
                self._levels = np.maximum(self._floor, self._levels * np.median(self._first_errors, axis=0))
            return None
        return self._judge(found, sample.t_us)

    def _take(self, estimate: Estimate) -> None:
        """The snapshot before this one becomes the reference, if nothing looks wrong and it is no worse."""
        snapshot = reference_of(estimate) if estimate.updates >= self._learning else None
        if snapshot is None or not snapshot.is_usable or self._is_suspicious:
            snapshot, self._candidate = None, None
        earlier, self._candidate = self._candidate, snapshot
        self._is_suspicious = False
        if self.reference is None or earlier is None:
            self.reference = self.reference or earlier
        elif self._window.is_full:
            before = self._window.compare(self.reference, self._levels).errors
            after = self._window.compare(earlier, self._levels).errors
            if (after <= NO_WORSE * before).all():
                self.reference = earlier

    def _judge(self, found: Comparison, t_us: int) -> Mismatch | None:
        past = self._history.like(found)
        self._history.add(found)
        if past is None:
            self._forget_recent()
            return None
        self._recent.append((found, past.deviations(found)))
        if len(self._recent) < self._config.persistence:
            return None
        deviations = np.array([deviation for _, deviation in self._recent])
        size = float(np.linalg.norm(np.mean(deviations, axis=0)))
        threshold = self._config.threshold
        self._is_suspicious |= size > SUSPICIOUS * threshold
        if self._history.size < self._settling:
            return None
        self.current = None
        is_growing, self._size = size > self._size, size
        if size <= threshold and not self._waited:
            return None
        self._waited += 1
        if is_growing and self._waited < LONGEST_WAIT:
            return None
        self.current = _explained([comparison for comparison, _ in self._recent][-NAMING:], past, t_us)
        self._begin()
        return self.current


def _explained(recent: list[Comparison], past: Past, t_us: int) -> Mismatch:
    """The alarm with the change that explains most of the excess error, the same size in all windows.

    By least squares a change takes (sum of leverage x evidence)^2 / sum of leverage^2 off the sum of squares;
    what the reference lacked already is taken off the evidence first.
    """
    evidence = np.array([each.evidence for each in recent])
    leverage = np.array([each.leverage for each in recent])
    news = evidence - leverage * past.sizes
    gains = (leverage * news).sum(axis=0) ** 2 / (leverage**2).sum(axis=0)
    errors = np.sqrt(np.mean([each.errors**2 for each in recent], axis=0))
    ratios = errors / past.errors
    slots = [CHANGES[name] for name in NAMES]
    excess = sum(float(each.squares) for each in recent) - len(recent) * past.squares
    best = int(np.argmax(gains))
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
