"""Links move packets and know nothing of what is in them; one file per medium in `bridge.links`."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True, kw_only=True)
class Packet:
    """What one read of a medium gave.

    t_us    receive time: monotonic clock when live, the log's own time in a log
    data    bytes as they came (byte links), or the payload of one CAN frame
    can_id  None on byte links; else the arbitration id
    """

    t_us: int
    data: bytes
    can_id: int | None = None
    extended: bool = False


class Link(Protocol):
    """A byte stream or a CAN bus."""

    def read(self, timeout_s: float) -> list[Packet]:
        """Waits at most `timeout_s`; [] when nothing came. Raises LinkClosed once nothing more can come."""

    def write(self, packet: Packet) -> None:
        """Sends one packet; on a medium that cannot send (a log) this does nothing."""

    def close(self) -> None:
        """Releases the medium; may be called twice."""
