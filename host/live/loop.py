"""The live loop: read, record, align, estimate, publish, save. Logs and simulations go the same way."""

from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from math import isfinite

from bridge.errors import LinkClosed
from bridge.measurement import Measurement, Quantity
from bridge.source import Source
from firmware_model.estimate import PARAMETERS, Estimate
from firmware_model.estimator import make_estimator
from firmware_model.sample import Sample
from host.errors import HostError
from host.live.align import Aligner
from host.live.journal import Journal
from host.live.lasting_source import LastingSource
from host.live.mismatch import Mismatch, MismatchWatch
from host.live.silence import SilenceWatch
from host.live.state import load_state, save_state, set_aside
from host.vehicle import Vehicle

_READ_TIMEOUT = 0.1  # s, how long Ctrl-C may have to wait
_PROGRESS_PERIOD = 1.0  # s


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """Where a run stands, and at its end the summary.

    seconds       since the start
    measurements  by quantity
    samples       grid instants by the name of the estimator's status
    refused       by cause, with who refused in front: "link.refused.crc", "alignment.refused.backwards", ...
    never_heard   needed quantities that have not come once
    mismatch      the last alarm, until the vehicle as it is now has become the usual one
    alarms        raised since the start
    lost_lines    of the journal, because they could not be written
    cause         why the run ended; empty while it goes on
    """

    seconds: float
    measurements: Counter[Quantity]
    samples: Counter[str]
    refused: Counter[str]
    estimate: Estimate
    never_heard: tuple[Quantity, ...]
    lost_lines: int
    mismatch: Mismatch | None = None
    alarms: int = 0
    cause: str = ""


class LiveLoop:
    """One run of the estimator on a source, until `stop`, the end of the source or of the duration.

    reopen       opens the source again when its link is lost
    clock, sleep monotonic s, and waiting for s
    say          takes each sentence that a person should see; the journal has them too
    on_progress  called about once a second
    """

    def __init__(
        self,
        source: Source,
        vehicle: Vehicle,
        journal: Journal,
        *,
        reopen: Callable[[], Source],
        clock: Callable[[], float],
        sleep: Callable[[float], None],
        say: Callable[[str], None],
        on_progress: Callable[[Progress], None],
    ) -> None:
        self.has_lost_link = False
        """Whether the run ended because a live link was gone for good; the end of a log is no loss."""
        self._is_log = vehicle.link.url.startswith("log:")
        self._vehicle = vehicle
        self._journal = journal
        self._clock = clock
        self._say = say
        self._on_progress = on_progress
        self._source = LastingSource(
            source,
            reopen,
            reopen_for=0.0 if self._is_log else vehicle.link.reopen_for,
            clock=clock,
            sleep=sleep,
            say=lambda sentence: self._note("link", sentence),
        )
        self._aligner = Aligner(vehicle.alignment)
        self._estimator = make_estimator(vehicle.estimator)
        self._watch = MismatchWatch(vehicle.mismatch, vehicle.estimator) if vehicle.mismatch.enabled else None
        self._alarms = 0
        self._started = clock()
        self._silence = SilenceWatch(vehicle.link.silence, self._started)
        self._measurements: Counter[Quantity] = Counter()
        self._samples: Counter[str] = Counter()
        self._noted: set[str] = set()
        self._boot = 0
        self._published_t_us: int | None = None
        self._synced = self._saved = self._told = self._started
        self._saved_updates = 0
        self._cannot_save = False
        self._cause = ""

    def stop(self, cause: str) -> None:
        """Ends the run after the read under way; safe to call from a signal handler."""
        self._cause = cause

    def run(self, duration: float | None = None) -> Progress:
        """Runs, at most for `duration` s. Whatever ends it, what was received is recorded and learnt."""
        if self._vehicle.state.enabled:
            self._restore()
        try:
            while not self._cause:
                now = self._clock()
                if duration is not None and now - self._started >= duration:
                    self.stop(f"{duration:g} s are over")
                    break
                try:
                    self._take(self._source.read(_READ_TIMEOUT))
                except LinkClosed as closed:
                    self.has_lost_link = not self._is_log
                    self.stop(str(closed))
                self._keep_house()
        finally:
            self._finish()
        return self.progress()

    def progress(self) -> Progress:
        """Costs about as much as ten estimator updates."""
        estimate = self._estimator.estimate()
        refused = Counter(
            {f"link.{cause}": n for cause, n in self._source.counts.items() if "refused" in cause}
        )
        refused.update(
            {f"alignment.{cause}": n for cause, n in self._aligner.counts.items() if "refused" in cause}
        )
        refused.update({f"estimator.{cause}": n for cause, n in estimate.refused.items() if n})
        return Progress(
            seconds=self._clock() - self._started,
            measurements=Counter(self._measurements),
            samples=Counter(self._samples),
            refused=refused,
            estimate=estimate,
            never_heard=tuple(self._silence.never_heard),
            lost_lines=self._journal.lost,
            mismatch=None if self._watch is None else self._watch.current,
            alarms=self._alarms,
            cause=self._cause,
        )

    def _note(self, event: str, sentence: str) -> None:
        self._journal.event(event, sentence)
        self._say(sentence)

    def _take(self, measurements: list[Measurement]) -> None:
        self._journal.measurements(measurements)
        now = self._clock()
        for measurement in measurements:
            self._measurements[measurement.quantity] += 1
            for sentence in self._silence.hear(measurement.quantity, now):
                self._note("silence", sentence)
            segment = self._aligner.segment
            for sample in self._aligner.push(measurement):
                self._learn(sample)
            if self._aligner.segment != segment:
                self._start_segment(measurement)

    def _start_segment(self, measurement: Measurement) -> None:
        self._estimator.forget_rows()
        if self._watch is not None:
            self._watch.clear()
        self._published_t_us = None
        restarted = measurement.boot != self._boot
        self._boot = measurement.boot
        why = "the vehicle or the link restarted" if restarted else "after a silence or a clock set back"
        self._note("segment", f"a new stretch of time begins at {measurement.t_us / 1e6:.1f} s: {why}")

    def _learn(self, sample: Sample) -> None:
        self._samples[self._estimator.update(sample).name] += 1
        last, period = self._published_t_us, self._vehicle.publish.period
        if last is None or sample.t_us - last >= period * 1e6:
            self._published_t_us = sample.t_us
            self._publish(sample.t_us)
        if self._watch is not None:
            estimate = self._estimator.estimate() if self._watch.wants_estimate else None
            mismatch = self._watch.push(sample, estimate)
            if mismatch is not None:
                self._raise_alarm(mismatch)

    def _raise_alarm(self, mismatch: Mismatch) -> None:
        self._alarms += 1
        self._journal.event("mismatch", mismatch.sentence, asdict(mismatch))
        self._say(mismatch.sentence)
        if self._vehicle.publish.enabled:
            self._source.warn(mismatch.t_us, mismatch.notice, mismatch.values)

    def _publish(self, t_us: int) -> None:
        values = published_values(self._estimator.estimate())
        self._journal.estimate(t_us, values)
        if self._vehicle.publish.enabled:
            self._source.publish(t_us, values)

    def _keep_house(self) -> None:
        now = self._clock()
        for sentence in self._silence.check(now):
            self._note("silence", sentence)
        for sentence in self._source.notes:
            if sentence not in self._noted:
                self._noted.add(sentence)
                self._note("source", sentence)
        if now - self._synced >= self._vehicle.journal.sync_period:
            self._synced = now
            self._journal.sync()
        if now - self._saved >= self._vehicle.state.period:
            self._saved = now
            self._save()
        if now - self._told >= _PROGRESS_PERIOD:
            self._told = now
            self._on_progress(self.progress())

    def _restore(self) -> None:
        vehicle = self._vehicle
        reading = load_state(vehicle.state_file, vehicle=vehicle.name, configuration=vehicle.meaning)
        note = reading.note
        if reading.body is not None:
            try:
                self._estimator.restore(reading.body)
            except ValueError as error:
                kept = set_aside(vehicle.state_file)
                note = f"{vehicle.state_file}: does not fit ({error}), kept as {kept}; starting fresh"
        self._saved_updates = self._estimator.estimate().updates
        self._note("state", note)

    def _save(self) -> None:
        updates = self._estimator.estimate().updates
        if not self._vehicle.state.enabled or updates == self._saved_updates:
            return
        vehicle = self._vehicle
        try:
            save_state(
                vehicle.state_file,
                self._estimator.state(),
                vehicle=vehicle.name,
                configuration=vehicle.meaning,
            )
            self._saved_updates = updates
            self._cannot_save = False
        except HostError as error:
            if not self._cannot_save:
                self._note("state", str(error))
            self._cannot_save = True

    def _finish(self) -> None:
        try:
            for sample in self._aligner.flush():
                self._learn(sample)
            self._save()
            self._journal.event("end", self._cause or "interrupted")
        finally:
            self._source.close()
            self._journal.close()


def published_values(estimate: Estimate) -> dict[str, float]:
    """What is known, by the names that go onto the link: a1, a1_std, ..., u0, u0_std, status, valid.

    valid  sum of 1 for a1, 2 for a2, 4 for a3, 8 for b1, 16 for b2, 32 for u0, for those to be relied on
    """
    values: dict[str, float] = {}
    for name, value in estimate.values.items():
        if isfinite(value):
            values |= {name: value, f"{name}_std": estimate.std[name]}
    values["status"] = float(estimate.status)
    values["valid"] = float(
        sum(2**bit for bit, name in enumerate((*PARAMETERS, "u0")) if estimate.valid[name])
    )
    return values
