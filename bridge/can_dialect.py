"""What a CAN bus speaks: frames to named messages with named fields, and back."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from bridge.link import Packet


@dataclass(frozen=True, slots=True)
class CanMessage:
    """One whole message, from one frame or several.

    name     as `CanSignal.message` has it
    label    as counts and `Measurement.source` have it
    fields   physical values; None where the sender says "not available"
    address  of the sender, where the dialect has one
    """

    name: str
    label: str
    fields: Mapping[str, float | None]
    address: int | None = None


class CanDialect(Protocol):
    """One way of laying messages into frames. `decode` never raises: refusals are counted by cause."""

    def decode(self, packet: Packet) -> CanMessage | None:
        """The message that this frame completes, if any of interest."""

    def encode(self, name: str, fields: Mapping[str, float], t_us: int) -> list[Packet]:
        """The frames of one message; fields left out are "not available", or 0 in a DBC.

        Raises ValueError when a value does not fit its field.
        """

    def clock_period_us(self, name: str, time: str) -> int | None:
        """After how long the time field of a message starts again at 0; None: never."""
