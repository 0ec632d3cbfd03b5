"""Client of a socketcand server: CAN frames as text over TCP, e.g. "< frame 123 1.5 0011FF >".

python-can's own client neither sees the end of the connection nor survives a damaged line.
"""

import socket
from collections import deque

import can

_CONNECT_S = 3.0
_MAX_ELEMENT = 300  # a CAN FD frame has 150 characters


class SocketcandBus:
    """The three methods of a python-can bus that a CAN link needs.

    Raises OSError when the server is gone or refuses.
    """

    def __init__(self, host: str, port: int, channel: str) -> None:
        self._text = b""
        self._elements: deque[str] = deque()
        self._socket = socket.create_connection((host, port), timeout=_CONNECT_S)
        try:
            self._expect("hi")
            self._say(f"open {channel}")
            self._expect("ok")
            self._say("rawmode")
            self._expect("ok")
        except OSError:
            self._socket.close()
            raise

    def recv(self, timeout: float) -> can.Message | None:
        """The next frame; raises ValueError for an element that is none."""
        element = self._next(timeout)
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

    def send(self, message: can.Message, timeout: float) -> None:
        digits = 8 if message.is_extended_id else 3
        data = " ".join(f"{byte:x}" for byte in message.data)
        self._socket.settimeout(timeout)
        self._say(f"send {message.arbitration_id:0{digits}X} {len(message.data):X} {data}")

    def shutdown(self) -> None:
        self._socket.close()

    def _say(self, element: str) -> None:
        self._socket.sendall(f"< {element} >".encode("ascii"))

    def _expect(self, wanted: str) -> None:
        element = self._next(_CONNECT_S)
        if element != wanted:
            raise OSError(f'the server must answer "{wanted}" (got {element or "nothing"})')

    def _next(self, timeout: float) -> str | None:
        """The content of the next "< ... >" that arrives in time."""
        if not self._elements:
            self._socket.settimeout(timeout)
            try:
                received = self._socket.recv(65536)
            except (TimeoutError, BlockingIOError):
                return None
            if not received:
                raise ConnectionResetError("the server closed the connection")
            *whole, rest = (self._text + received).split(b">")
            # Without a closing bracket this is not the protocol: keep no more than one element.
            self._text = rest[-_MAX_ELEMENT:]
            self._elements.extend(
                part.rpartition(b"<")[2].decode("ascii", "replace").strip() for part in whole
            )
        return self._elements.popleft() if self._elements else None
