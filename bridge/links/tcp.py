"""TCP client: `tcp:HOST:PORT`, as ArduPilot's SITL and mavlink-router serve it."""

import select
import socket
from collections.abc import Callable

from bridge.errors import LinkClosed, LinkError
from bridge.link import Packet
from bridge.links.refusal import refusal
from bridge.links.udp import monotonic_us

_CONNECT_S = 5.0
_WRITE_S = 1.0


class TcpLink:
    """A byte stream. The peer's end of file is LinkClosed: reconnecting, with pauses, is the caller's."""

    def __init__(self, sock: socket.socket, name: str, clock_us: Callable[[], int] = monotonic_us) -> None:
        self._socket: socket.socket | None = sock
        self._name = name
        self._clock_us = clock_us

    @classmethod
    def open(cls, host: str, port: int) -> "TcpLink":
        name = f"tcp:{host}:{port}"
        try:
            sock = socket.create_connection((host, port), timeout=_CONNECT_S)
        except (OSError, OverflowError, UnicodeError) as error:
            raise LinkError(f"{name} cannot be opened: {refusal(error)}") from error
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.settimeout(_WRITE_S)
        return cls(sock, name)

    def read(self, timeout_s: float) -> list[Packet]:
        sock = self._open_socket()
        if not select.select([sock], [], [], max(0.0, timeout_s))[0]:
            return []
        try:
            data = sock.recv(65536)
        except OSError as error:
            raise self._ended(error.strerror or str(error)) from error
        if not data:
            raise self._ended("the peer closed it")
        return [Packet(t_us=self._clock_us(), data=data)]

    def write(self, packet: Packet) -> None:
        try:
            self._open_socket().sendall(packet.data)
        except OSError as error:
            raise self._ended(error.strerror or str(error)) from error

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _ended(self, reason: str) -> LinkClosed:
        self.close()
        return LinkClosed(f"{self._name} has ended: {reason}")

    def _open_socket(self) -> socket.socket:
        if self._socket is None:
            raise LinkClosed(f"{self._name} was closed")
        return self._socket
