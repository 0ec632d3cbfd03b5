"""A source that outlives its link: a cable pulled is waited for, and nothing is joined across the break."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from bridge.errors import BridgeError, LinkClosed
from bridge.measurement import Measurement
from bridge.source import Source

_FIRST_WAIT = 0.5  # s, doubled with every attempt that fails
_LONGEST_WAIT = 10.0  # s


class LastingSource:
    """Reads from `source`, and when its link closes from the next one that `reopen` opens.

    A link that closes is reported once and opened again, at first after 0.5 s and then ever more seldom,
    until measurements come again or `reopen_for` s are over; one that opens and closes without any is still
    lost. The boots of a reopened source count on from those before. The counts go on as well, with
    "link.lost" and "link.reopened" among them.

    clock   monotonic time, s
    sleep   waits as many s as it is told
    say     takes each sentence about the link
    """

    def __init__(
        self,
        source: Source,
        reopen: Callable[[], Source],
        *,
        reopen_for: float,
        clock: Callable[[], float],
        sleep: Callable[[float], None],
        say: Callable[[str], None],
    ) -> None:
        self._source: Source | None = source
        self._reopen = reopen
        self._reopen_for = reopen_for
        self._clock = clock
        self._sleep = sleep
        self._say = say
        self._earlier: Counter[str] = Counter()
        self._first_boot = self._last_boot = 0
        self._lost_at: float | None = None
        self._next_attempt = 0.0
        self._wait = _FIRST_WAIT
        self._over: LinkClosed | None = None

    @property
    def counts(self) -> Counter[str]:
        return self._earlier + self._source.counts if self._source else Counter(self._earlier)

    @property
    def notes(self) -> Sequence[str]:
        """As `Source.notes`; none while the link is gone."""
        return self._source.notes if self._source else ()

    def read(self, timeout_s: float) -> list[Measurement]:
        """As `Source.read`; [] while the link is gone. Raises LinkClosed once it is given up."""
        if self._over is not None:
            raise self._over
        if self._source is None:
            self._try_again(timeout_s)
            return []
        try:
            measurements = self._source.read(timeout_s)
        except LinkClosed as closed:
            self._lose(closed)
            return self.read(timeout_s)
        if measurements and self._lost_at is not None:
            self._say(f"measurements come again after {self._clock() - self._lost_at:.1f} s")
            self._lost_at = None
        renumbered = [replace(m, boot=self._first_boot + m.boot) for m in measurements]
        self._last_boot = max([self._last_boot, *(m.boot for m in renumbered)])
        return renumbered

    def publish(self, t_us: int, values: Mapping[str, float]) -> None:
        """As `Source.publish`; nothing while the link is gone. The next read tells of a link that closes."""
        if self._source is not None:
            try:
                self._source.publish(t_us, values)
            except LinkClosed as closed:
                self._lose(closed)

    def warn(self, t_us: int, notice: str, values: Mapping[str, float]) -> None:
        """As `Source.warn`; nothing while the link is gone."""
        if self._source is not None:
            try:
                self._source.warn(t_us, notice, values)
            except LinkClosed as closed:
                self._lose(closed)

    def close(self) -> None:
        """May be called twice."""
        self._drop()
        self._over = self._over or LinkClosed("the link was closed here")

    def _drop(self) -> None:
        if self._source is not None:
            self._earlier = self.counts
            self._source.close()
            self._source = None

    def _lose(self, cause: LinkClosed) -> None:
        self._drop()
        if self._reopen_for <= 0:
            self._over = cause
            return
        if self._lost_at is None:
            self._lost_at = self._clock()
            self._wait = _FIRST_WAIT
            self._first_boot = self._last_boot + 1
            self._earlier["link.lost"] += 1
            self._say(f"link lost ({cause}); trying to open it again for {self._reopen_for:g} s")
        self._retry_later(self._lost_at, cause)

    def _try_again(self, timeout_s: float) -> None:
        now = self._clock()
        if now < self._next_attempt:
            self._sleep(min(timeout_s, self._next_attempt - now))
            return
        try:
            self._source = self._reopen()
            self._earlier["link.reopened"] += 1
        except BridgeError as error:
            assert self._lost_at is not None
            self._retry_later(self._lost_at, error)

    def _retry_later(self, lost_at: float, cause: BridgeError) -> None:
        now = self._clock()
        if now - lost_at >= self._reopen_for:
            self._over = LinkClosed(f"link lost for {self._reopen_for:g} s and given up ({cause})")
        self._next_attempt = now + self._wait
        self._wait = min(2 * self._wait, _LONGEST_WAIT)
