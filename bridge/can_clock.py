"""One clock for a bus on which some messages carry the vehicle's time and others do not."""

from collections import Counter

# A step back by more than this is a restart of the clock, not the order in which messages are sent.
RESTART_US = 1_000_000
# Crystal clocks differ by less than this, s/s: how fast an old estimate of the delay is given up.
DRIFT = 1e-4


class VehicleClock:
    """Unwraps stamps, moves receive times onto the same clock, refuses what does not advance.

    counts  takes "refused.time_backwards", "refused.repeat", "refused.no_clock" and "clock.restart"
    boot    restarts seen so far: of the vehicle, or of the clock of a recording
    """

    def __init__(self, counts: Counter[str]) -> None:
        self.boot = 0
        self._counts = counts
        self._latest_us: int | None = None
        self._last_us: dict[object, int] = {}  # by source; sources are the entries of a fixed table
        self._offset_us: float | None = None
        self._offset_at_us = 0

    def stamped(self, stamp_us: int, period_us: int | None, receive_us: int) -> int:
        """Unwrapped vehicle time of a message that carries it modulo `period_us`."""
        t_us = stamp_us
        if period_us is not None and self._latest_us is not None:
            step = (stamp_us - self._latest_us + period_us // 2) % period_us - period_us // 2
            # A step far back is a restart, and that begins at the stamp itself.
            t_us = self._latest_us + step if step >= -RESTART_US else stamp_us
        self._follow(t_us - receive_us, receive_us)
        return t_us

    def received(self, receive_us: int) -> int | None:
        """Receive time on the vehicle's clock; None, and counted, until a stamp has been seen."""
        if self._offset_us is None:
            self._counts["refused.no_clock"] += 1
            return None
        return receive_us + round(self._offset_us)

    def accept(self, source: object, t_us: int) -> bool:
        """Whether `t_us` is later than all before it from this source; a far step back starts a new boot."""
        if self._latest_us is not None and t_us < self._latest_us - RESTART_US:
            self.boot += 1
            self._counts["clock.restart"] += 1
            self._last_us.clear()
            self._latest_us = None
        last_us = self._last_us.get(source)
        if last_us is not None and t_us <= last_us:
            self._counts["refused.repeat" if t_us == last_us else "refused.time_backwards"] += 1
            return False
        self._last_us[source] = t_us
        self._latest_us = t_us if self._latest_us is None else max(self._latest_us, t_us)
        return True

    def _follow(self, offset_us: float, receive_us: int) -> None:
        # A message is never received before it is stamped, so the largest difference has the least delay.
        if self._offset_us is not None:
            kept = self._offset_us - DRIFT * abs(receive_us - self._offset_at_us)
            if abs(offset_us - kept) < RESTART_US:
                offset_us = max(offset_us, kept)
        self._offset_us = offset_us
        self._offset_at_us = receive_us
