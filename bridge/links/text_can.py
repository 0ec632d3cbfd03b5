"""CAN frames as text over a byte link: slcan over a serial port, socketcand over TCP.

python-can's slcan reads byte by byte and keeps what it cannot decode; its socketcand client neither sees the
end of the connection nor survives a damaged element.
"""

import re
import time
from collections import deque
from contextlib import suppress
from typing import Any

import can

from bridge.errors import LinkClosed, LinkError
from bridge.link import Link, Packet

_ANSWER_S = 3.0
_LONGEST = 300  # a CAN FD frame has 150 characters
SLCAN_SETTLE_S = 2.0  # an adapter that restarts when its port is opened needs this long
# LAWICEL's S7 is 800 kbit/s, CANable's 750.
_SLCAN_BITRATES = dict(
    zip(
        (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 750_000, 800_000, 1_000_000, 83_300),
        (0, 1, 2, 3, 4, 5, 6, 7, 7, 8, 9),
        strict=True,
    )
)
# t 3 digits of identifier, T 8; length; data; some adapters append a time of 4 digits.
_SLCAN_FRAME = re.compile(r"(?:t([0-9A-Fa-f]{3})|T([0-9A-Fa-f]{8}))([0-8])((?:[0-9A-Fa-f]{2})*)")
_SLCAN_REMOTE = re.compile(r"r[0-9A-Fa-f]{3}[0-8]|R[0-9A-Fa-f]{8}[0-8]")
_SLCAN_ANSWER = re.compile(r"[zZ]?|[VNFv]\w*")


class _TextBus:
    """What slcan and socketcand share; the methods without underscore are those of a python-can bus."""

    def __init__(self, link: Link, end: bytes) -> None:
        self._link = link
        self._end = re.compile(end)
        self._rest = b""
        self._texts: deque[str] = deque()

    def shutdown(self) -> None:
        self._link.close()

    def _say(self, text: str) -> None:
        self._link.write(Packet(t_us=0, data=text.encode("ascii")))

    def _hear(self, timeout: float) -> str | None:
        """The next whole element that arrives in time."""
        if not self._texts:
            for packet in self._link.read(timeout):
                *whole, rest = self._end.split(self._rest + packet.data)
                # Without an end this is not the protocol: keep no more than one element.
                self._rest = rest[-_LONGEST:]
                self._texts.extend(text.decode("ascii", "replace") for text in whole)
        return self._texts.popleft() if self._texts else None


class SlcanBus(_TextBus):
    """An adapter with the LAWICEL protocol."""

    def __init__(self, link: Link, bitrate: int | None, settle_s: float = SLCAN_SETTLE_S) -> None:
        super().__init__(link, rb"[\r\a]")
        if bitrate is not None and bitrate not in _SLCAN_BITRATES:
            known = ", ".join(str(rate) for rate in sorted(_SLCAN_BITRATES))
            raise LinkError(f"can:slcan: BITRATE must be one of {known} (got {bitrate})")
        time.sleep(settle_s)
        # C closes the channel that a program before may have left open; its answers are passed over.
        self._say("C\r" + ("" if bitrate is None else f"S{_SLCAN_BITRATES[bitrate]}\r") + "O\r")

    def shutdown(self) -> None:
        with suppress(LinkClosed):
            self._say("C\r")  # or the adapter goes on sending
        super().shutdown()

    def recv(self, timeout: float) -> can.Message | None:
        """The next frame; raises ValueError for a line that is none."""
        line = self._hear(timeout)
        while line is not None and _SLCAN_ANSWER.fullmatch(line):
            line = self._hear(0.0)
        if line is None:
            return None
        if _SLCAN_REMOTE.match(line):
            return can.Message(is_remote_frame=True)
        # Only the first letter of a frame is a t: what stands before it is noise.
        match = _SLCAN_FRAME.match(line, max(line.rfind("t"), line.rfind("T"), 0))
        if match is None:
            raise ValueError(f"not a frame: {line}")
        standard, extended, length, data = match.groups()
        size = 2 * int(length)
        if len(data) < size:
            raise ValueError(f"not {length} bytes: {line}")
        return can.Message(
            arbitration_id=int(standard or extended, 16),
            is_extended_id=standard is None,
            data=bytes.fromhex(data[:size]),
            check=True,
        )

    def send(self, message: Any, timeout: float) -> None:  # noqa: ARG002
        if len(message.data) > 8:
            raise ValueError("slcan carries 8 bytes at most")
        head = (
            f"T{message.arbitration_id:08X}" if message.is_extended_id else f"t{message.arbitration_id:03X}"
        )
        self._say(f"{head}{len(message.data)}{message.data.hex().upper()}\r")


class SocketcandBus(_TextBus):
    """A bus of a socketcand server: elements as "< frame 123 1.5 0011FF >"."""

    def __init__(self, link: Link, channel: str) -> None:
        super().__init__(link, b">")
        self._expect("hi")
        self._say(f"< open {channel} >")
        self._expect("ok")
        self._say("< rawmode >")
        self._expect("ok")

    def recv(self, timeout: float) -> can.Message | None:
        """The next frame; raises ValueError for an element that is none."""
        element = self._element(timeout)
        if element is None:
            return None
        kind, _, rest = element.partition(" ")
        if kind == "error":
            return can.Message(is_error_frame=True)
        if kind != "frame":
            raise ValueError(f"not a frame: {element}")
        can_id, _, *data = rest.split()
        return can.Message(
            arbitration_id=int(can_id, 16),
            is_extended_id=len(can_id) != 3,
            data=bytes.fromhex("".join(data)),
            check=True,
        )

    def send(self, message: Any, timeout: float) -> None:  # noqa: ARG002
        digits = 8 if message.is_extended_id else 3
        data = "".join(f"{byte:x} " for byte in message.data)
        self._say(f"< send {message.arbitration_id:0{digits}X} {len(message.data):X} {data}>")

    def _element(self, timeout: float) -> str | None:
        text = self._hear(timeout)
        return None if text is None else text.rpartition("<")[2].strip()

    def _expect(self, wanted: str) -> None:
        element = self._element(_ANSWER_S)
        if element != wanted:
            self.shutdown()
            raise LinkError(f'can:socketcand: the server must answer "{wanted}" (got {element or "nothing"})')
