"""Asynchronous measurements to recordings: stretches on the grid, cut at restarts and long gaps.

Spikes are left out first: on a line between two messages they would spread over the instants beside them, too
small there to be told from the motion.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bridge.measurement import Measurement, Quantity
from firmware_model.sample import Sample
from host.live.align import AlignConfig, Aligner
from host.recordings.outliers import CHANNELS, outliers, told
from host.recordings.own_times import Sent, at_own_times
from host.recordings.plane_readings import PlaneReadings
from host.recordings.recording import NEEDED, Array, Recording, split_at_gaps

ONE_CHANNEL = 0.5  # of the rows that tell depth: at most so many tell pitch, too, where each has its own
FEWEST = 10  # messages of either
SAME_STEP = 0.1  # of the vehicle's step, by which a table's may differ
SHORTEST, LONGEST = 1e-3, 30.0  # s, of a step that shows any motion
SLOW = 1.5  # steps, beyond which a pitch comes more seldom than the grid has instants
BESIDE = 2_000_000  # us: a command sent so long before or after a segment still tells of it


@dataclass(frozen=True, slots=True, kw_only=True)
class Messages:
    """What a file holds, in order of time, and what was refused of it.

    alarms  (boot, us) of what `mils run` found
    starts_at_zero  whether time counts from the file's own 0, not from each stretch's first row
    """

    name: str
    sha256: str
    measurements: Sequence[Measurement]
    counts: Counter[str]
    notes: tuple[str, ...] = ()
    alarms: tuple[tuple[int, int], ...] = ()
    has_angle: bool = True
    starts_at_zero: bool = False


@dataclass(slots=True)
class _Segment:
    boot: int
    samples: list[Sample] = field(default_factory=list)


def aligned(
    messages: Messages, config: AlignConfig, needs: tuple[str, ...] = NEEDED, on_grid: bool = True
) -> list[Recording]:
    """Stretches that have all that is needed; none where that never comes together.

    At the step of the grid, or that of a pitch that comes more seldom: between two of its messages there is
    nothing to be learnt.
    """
    messages = _without_spikes(messages)
    if SLOW * config.step < (usual := _usual_step(messages)) <= LONGEST:
        config = AlignConfig(step=usual, rudder_on_change=config.rudder_on_change)
        note = f"its pitch comes every {usual:.3g} s: taken at that step"
        messages = replace(messages, notes=(*messages.notes, note))
    aligner = Aligner(config)
    segments: dict[int, _Segment] = {}
    for measurement in messages.measurements:
        before = aligner.segment  # a push that starts a new segment returns the end of the old one
        samples = aligner.push(measurement)
        segments.setdefault(before, _Segment(measurement.boot)).samples.extend(samples)
        segments.setdefault(aligner.segment, _Segment(measurement.boot))
    segments.setdefault(aligner.segment, _Segment(0)).samples.extend(aligner.flush())
    counts = messages.counts + aligner.counts
    longest = max(1.0, 2.5 * config.step)
    pieces = []
    for segment in segments.values():
        if segment.samples:
            whole = _recording(messages, segment, config, counts)
            heard = np.isfinite(whole.rudder)
            whole = replace(whole, rudder=_bridged(whole.rudder, round(longest / config.step)))
            if not on_grid:
                sent = {quantity.value: _sent(quantity, messages, segment) for quantity in Quantity}
                whole = at_own_times(whole, sent, heard)
            pieces += split_at_gaps(whole, longest, needs)
    return pieces


def _usual_step(messages: Messages) -> float:
    """s, from one pitch to the next; 0 where hardly any comes."""
    times = [one.t_us for one in messages.measurements if one.quantity is Quantity.PITCH]
    return 1e-6 * float(np.median(np.diff(times))) if len(times) > FEWEST else 0.0


def _without_spikes(messages: Messages) -> Messages:
    by_channel: dict[tuple[str, int], list[int]] = {}
    for k, measurement in enumerate(messages.measurements):
        by_channel.setdefault((measurement.quantity.value, measurement.boot), []).append(k)
    spikes: set[int] = set()
    counts: Counter[str] = Counter()
    for (name, _), places in by_channel.items():
        if name in CHANNELS:
            found = _spikes([messages.measurements[k] for k in places])
            spikes |= {places[k] for k in found}
            counts[f"outlier.{name}"] += len(found)
    measured = Counter(measurement.quantity.value for measurement in messages.measurements)
    notes = [told(name, count, measured[name]) for name in CHANNELS if (count := counts[f"outlier.{name}"])]
    kept = [one for k, one in enumerate(messages.measurements) if k not in spikes]
    return replace(
        messages, measurements=kept, counts=messages.counts + counts, notes=(*messages.notes, *notes)
    )


def _spikes(measurements: list[Measurement]) -> list[int]:
    """Which of one channel's, but for those that come again or late, which the aligner refuses."""
    time = np.array([measurement.t_us for measurement in measurements])
    advancing = np.flatnonzero(np.diff(np.maximum.accumulate(time), prepend=-1) > 0)
    values = np.array([measurement.value for measurement in measurements])
    found: list[int] = advancing[outliers(1e-6 * time[advancing], values[advancing])].tolist()
    return found


def is_of_messages(table: Recording) -> bool:
    """Whether each row tells one message, of one channel or a few, and hardly any both depth and pitch."""
    depth, pitch = np.isfinite(table.depth), np.isfinite(table.pitch)
    fewer = min(depth.sum(), pitch.sum())
    return bool(fewer >= FEWEST and (depth & pitch).sum() < ONE_CHANNEL * fewer)


def aligned_table(
    table: Recording, config: AlignConfig, needs: tuple[str, ...] = NEEDED, on_grid: bool = True
) -> list[Recording]:
    """A table of messages on the grid: at the vehicle's step, if pitch comes so, else at that of pitch."""
    usual = float(np.median(np.diff(table.time[np.isfinite(table.pitch)])))
    if abs(usual - config.step) > SAME_STEP * config.step:
        config = AlignConfig(step=max(usual, SHORTEST), rudder_on_change=config.rudder_on_change)
    note = f"its rows tell one message each: taken at every {config.step:.3g} s"
    messages = Messages(
        name=table.name,
        sha256=table.sha256,
        measurements=list(_measurements(table)),
        counts=table.counts,
        notes=(*table.notes, note),
        has_angle=table.has_angle,
        starts_at_zero=True,
    )
    return aligned(messages, config, needs, on_grid)


def _measurements(table: Recording) -> Iterable[Measurement]:
    channels = {quantity: getattr(table, quantity.value).tolist() for quantity in Quantity}
    for row, t_us in enumerate(np.rint(table.time * 1e6).astype(int).tolist()):
        for quantity, values in channels.items():
            if np.isfinite(values[row]):
                yield Measurement(quantity=quantity, value=values[row], t_us=t_us, source="row")


def _recording(messages: Messages, segment: _Segment, config: AlignConfig, counts: Counter[str]) -> Recording:
    samples = segment.samples
    first, last = samples[0].t_us, samples[-1].t_us
    begins = 0 if messages.starts_at_zero else first
    marked = [t_us for boot, t_us in messages.alarms if boot == segment.boot and first <= t_us <= last]
    return Recording(
        name=messages.name,
        sha256=messages.sha256,
        time=np.array([sample.t_us - begins for sample in samples], dtype=float) * 1e-6,
        depth=np.array([sample.depth for sample in samples]),
        pitch=np.array([sample.pitch for sample in samples]),
        rudder=np.array([sample.rudder for sample in samples]),
        speed=np.array([sample.speed for sample in samples]),
        pitch_rate=np.array([sample.pitch_rate for sample in samples]),
        step=config.step,
        has_angle=messages.has_angle,
        plane=None if config.rudder_on_change else _plane(messages, segment, config.step),
        counts=counts,
        notes=messages.notes,
        alarms=tuple(1e-6 * (t_us - begins) for t_us in marked),
    )


def _plane(messages: Messages, segment: _Segment, step: float) -> PlaneReadings | None:
    """The readings of a plane that was sent more seldom than there are samples; None of any other."""
    time, angle = _sent(Quantity.RUDDER, messages, segment)
    if time.size < FEWEST:
        return None
    plane = PlaneReadings(time, angle, step)
    return plane if plane.is_slow else None


def _sent(quantity: Quantity, messages: Messages, segment: _Segment) -> Sent:
    """Times s, on the recording's axis, and values of a channel's messages about a segment, as they come."""
    first, last = segment.samples[0].t_us, segment.samples[-1].t_us
    begins = 0 if messages.starts_at_zero else first
    sent = [
        (1e-6 * (one.t_us - begins), one.value)
        for one in messages.measurements
        if one.quantity is quantity
        and one.boot == segment.boot
        and first - BESIDE <= one.t_us <= last + BESIDE
    ]
    time, values = np.array(sent).reshape(-1, 2).T
    advancing = np.diff(np.maximum.accumulate(time), prepend=-np.inf) > 0.0
    return Sent(time[advancing], values[advancing])


def _bridged(rudder: Array, longest: int) -> Array:
    """Losses of up to `longest` rows on a straight line: the plane turned on the way, nobody knows when."""
    rows, known = np.arange(rudder.size), np.isfinite(rudder)
    before = np.maximum.accumulate(np.where(known, rows, -1))
    after = np.minimum.accumulate(np.where(known, rows, rudder.size)[::-1])[::-1]
    is_short = (before >= 0) & (after < rudder.size) & (after - before <= longest + 1)
    share = (rows - before) / np.maximum(after - before, 1)
    line = (1.0 - share) * rudder[before] + share * rudder[np.minimum(after, rudder.size - 1)]
    return np.where(is_short & ~known, line, rudder)
