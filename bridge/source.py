"""What the host loop reads: a link joined to its decoder and encoder."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Protocol

from bridge.measurement import Measurement


class Source(Protocol):
    """Measurements in, estimates out, whatever the medium."""

    counts: Counter[str]
    """Everything seen and everything refused, by cause: "ATTITUDE", "refused.crc", "refused.repeat", ..."""

    @property
    def notes(self) -> Sequence[str]:
        """What was decided on the user's behalf, one sentence each; grows while reading."""

    def read(self, timeout_s: float) -> list[Measurement]:
        """Measurements that came within `timeout_s`; also keeps the link alive (heartbeat, rate requests).

        Raises LinkClosed at the end of a log or when the device is gone.
        """

    def publish(self, t_us: int, values: Mapping[str, float]) -> None:
        """Sends named values (at most 10 characters each) to whoever listens on this link."""

    def warn(self, t_us: int, notice: str, values: Mapping[str, float]) -> None:
        """Sends a warning (at most 50 characters) and its named values, once, to whoever listens."""

    def close(self) -> None:
        """Releases the link; may be called twice."""
