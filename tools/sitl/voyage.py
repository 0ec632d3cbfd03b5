"""One run on a link, paced by the clock."""

from collections import Counter
from collections.abc import Callable
from typing import Protocol

from tools.sitl.schedule import Pace
from tools.sitl.track import Track

_LONGEST_WAIT_S = 0.2  # so that a request to stop is soon heard


class Vehicle(Protocol):
    """What speaks on the link."""

    sent: Counter[str]
    heard: Counter[str]

    @property
    def next_s(self) -> float:
        """Simulated time of the next thing to do."""

    def emit(self, t_s: float) -> None:
        """Sends all that is due."""

    def listen(self, timeout_s: float) -> None:
        """Waits at most `timeout_s` for others."""


def sail_live(
    track: Track,
    vehicle: Vehicle,
    pace: Pace,
    duration_s: float,
    stopped: Callable[[], bool],
    tell: Callable[[], None],
) -> None:
    """Sends until `duration_s` of simulated time (0: for ever) or until `stopped`; `tell` is called often."""
    while not stopped():
        due = vehicle.next_s
        if 0.0 < duration_s < due - 1e-9:
            track.advance(duration_s)
            return
        wait = pace.seconds_until(due)
        vehicle.listen(min(max(wait, 0.0), _LONGEST_WAIT_S))
        if wait <= 0.0:
            track.advance(due)
            vehicle.emit(due)
        tell()
