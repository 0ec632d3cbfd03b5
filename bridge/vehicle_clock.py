"""One monotonic timeline from the vehicle's boot clock, through restarts, wraps and absurd stamps."""

_US = 1_000_000
_MS_WRAP = 2**32 * 1000  # us; time_boot_ms is a uint32, 49.7 days
_US_WRAP = 2**32  # us; SERVO_OUTPUT_RAW.time_usec is a uint32, 71.6 min
_JITTER = 1 * _US  # messages overtake each other by less than this
_LEAP = 10 * _US  # a larger step needs a second message that confirms it, at most so much later
_LONGEST_PAUSE = 3600 * _US  # between the boots of one timeline; receive clocks can be years off
_RELEARN = 1 * _US  # a delay that grew by more than this is a new link or a slower clock
_LEAK = 2e-4  # share of the excess that the smallest delay gives up per message, to follow drifting clocks


class VehicleClock:
    """Puts every stamp on the clock of the vehicle's first boot.

    A step of more than 1 s back, or ahead of the receive time that has passed, counts only once a second
    message agrees with it; the first one is refused (None). So a single absurd stamp moves nothing, and a
    restart costs one message.
    After a restart `boot` is one higher and the timeline goes on by the receive time that has passed.
    """

    def __init__(self) -> None:
        self.boot = 0
        self._base = 0  # timeline = base + boot clock
        self._latest: int | None = None  # boot clock
        self._latest_receive = 0
        self._suspect: int | None = None
        self._delay: float | None = None  # smallest receive time - timeline

    def from_boot(self, boot_us: int, receive_us: int) -> int | None:
        """Timeline of a message that carries the time since boot."""
        if self._latest is not None:
            boot_us = _unwrap(boot_us, self._latest, _MS_WRAP)
            step = boot_us - self._latest
            elapsed = min(max(receive_us - self._latest_receive, 0), _LEAP)
            if not -_JITTER <= step <= _JITTER + elapsed:
                if self._suspect is None or not -_JITTER <= boot_us - self._suspect <= _LEAP:
                    self._suspect = boot_us
                    return None
                if step < 0:
                    self._restart(boot_us, receive_us)
        self._suspect = None
        if self._latest is None or boot_us > self._latest:
            self._latest, self._latest_receive = boot_us, receive_us
        t_us = self._base + boot_us
        self._learn_delay(t_us, receive_us)
        return t_us

    def from_wrapped_us(self, time_usec: int) -> int | None:
        """Timeline of a uint32 microsecond stamp; None while nothing near it is known."""
        if self._latest is None:
            return None
        boot_us = _unwrap(time_usec, self._latest, _US_WRAP)
        if abs(boot_us - self._latest) > _LEAP:
            return None
        return self._base + boot_us

    def from_receive(self, receive_us: int) -> int | None:
        """Timeline of a message without a stamp, by the smallest delay seen; None while that is unknown."""
        if self._latest is None or self._delay is None:
            return None
        t_us = round(receive_us - self._delay)
        if not -_JITTER <= t_us - (self._base + self._latest) <= _LEAP:
            return None
        return t_us

    def _restart(self, boot_us: int, receive_us: int) -> None:
        assert self._latest is not None
        pause = min(max(receive_us - self._latest_receive, 1), _LONGEST_PAUSE)
        self._base += self._latest + pause - boot_us
        self._latest = boot_us
        self._delay = None
        self.boot += 1

    def _learn_delay(self, t_us: int, receive_us: int) -> None:
        delay = receive_us - t_us
        if self._delay is None or delay < self._delay or delay > self._delay + _RELEARN:
            self._delay = delay
        else:
            self._delay += _LEAK * (delay - self._delay)


def _unwrap(value: int, near: int, modulus: int) -> int:
    """The number congruent to `value` that is nearest to `near`."""
    return value + modulus * round((near - value) / modulus)
