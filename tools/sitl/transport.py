"""How the simulated vehicle's bytes leave and arrive."""

import contextlib
import os
import select
import socket
from collections.abc import Callable
from typing import Protocol

import serial

from tools.sitl.errors import TransportError

_CHUNK = 65536


class Transport(Protocol):
    """A way for bytes, both directions."""

    def send(self, data: bytes) -> None:
        """Sends all or, when nobody is there, nothing. Raises TransportError when the device has gone."""

    def receive(self, timeout_s: float) -> bytes:
        """Waits at most `timeout_s`; b"" when nothing came."""

    def close(self) -> None:
        """May be called twice."""


class Udp:
    """Datagrams. `speaks_first` sends to the address; else it binds there and answers the last who spoke."""

    def __init__(self, host: str, port: int, speaks_first: bool) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.peer: tuple[str, int] | None = None
        if speaks_first:
            self.peer = (socket.gethostbyname(host), port)
        else:
            self.socket.bind((host, port))
        self.socket.setblocking(False)

    def send(self, data: bytes) -> None:
        if self.peer is not None:
            # Nobody listening yet, or a full buffer: a vehicle keeps talking.
            with contextlib.suppress(OSError):
                self.socket.sendto(data, self.peer)

    def receive(self, timeout_s: float) -> bytes:
        if not select.select([self.socket], [], [], timeout_s)[0]:
            return b""
        try:
            data, self.peer = self.socket.recvfrom(_CHUNK)
        except OSError:  # the echo of an earlier datagram that met a closed port
            return b""
        return data

    def close(self) -> None:
        self.socket.close()


class TcpServer:
    """Waits for one peer at a time; when it leaves, the next may come."""

    def __init__(self, host: str, port: int) -> None:
        self.server = socket.create_server((host, port))
        self.peer: socket.socket | None = None

    @property
    def port(self) -> int:
        """The port in use, of interest when 0 was asked for."""
        port: int = self.server.getsockname()[1]
        return port

    def send(self, data: bytes) -> None:
        if self.peer is not None:
            try:
                self.peer.sendall(data)
            except OSError:
                self._drop()

    def receive(self, timeout_s: float) -> bytes:
        waiting = self.peer if self.peer is not None else self.server
        if not select.select([waiting], [], [], timeout_s)[0]:
            return b""
        if self.peer is None:
            self.peer, _ = self.server.accept()
            self.peer.settimeout(1.0)
            return b""
        try:
            data = self.peer.recv(_CHUNK)
        except OSError:
            data = b""
        if not data:
            self._drop()
        return data

    def close(self) -> None:
        self._drop()
        self.server.close()

    def _drop(self) -> None:
        if self.peer is not None:
            self.peer.close()
            self.peer = None


class TcpClient:
    """Connects once."""

    def __init__(self, host: str, port: int) -> None:
        self.socket = socket.create_connection((host, port), timeout=5.0)
        self.socket.settimeout(1.0)

    def send(self, data: bytes) -> None:
        try:
            self.socket.sendall(data)
        except OSError as error:
            raise TransportError(f"tcp: the other side has gone ({error})") from error

    def receive(self, timeout_s: float) -> bytes:
        if not select.select([self.socket], [], [], timeout_s)[0]:
            return b""
        try:
            data = self.socket.recv(_CHUNK)
        except OSError as error:
            raise TransportError(f"tcp: the other side has gone ({error})") from error
        if not data:
            raise TransportError("tcp: the other side has closed the connection")
        return data

    def close(self) -> None:
        self.socket.close()


class Serial:
    """A serial port, or a pseudo-terminal that plays one."""

    def __init__(self, device: str, baud: int) -> None:
        self.device = device
        self.serial = serial.Serial(device, baud, timeout=0, write_timeout=1.0)

    def send(self, data: bytes) -> None:
        try:
            self.serial.write(data)
        except serial.SerialTimeoutException:
            return  # nobody reads: bytes are lost, as on a wire
        except (OSError, serial.SerialException) as error:
            raise TransportError(f"serial:{self.device} has gone ({error})") from error

    def receive(self, timeout_s: float) -> bytes:
        try:
            if not select.select([self.serial.fileno()], [], [], timeout_s)[0]:
                return b""
            data: bytes = self.serial.read(_CHUNK)
        except (OSError, serial.SerialException) as error:
            raise TransportError(f"serial:{self.device} has gone ({error})") from error
        return data

    def close(self) -> None:
        self.serial.close()


def _host_and_port(rest: str) -> tuple[str, int]:
    host, _, port = rest.rpartition(":")
    if not host or not port.isdigit() or not 0 <= int(port) <= 65535:
        raise TransportError(f"link address must be HOST:PORT (got {rest!r})")
    return host, int(port)


def _serial(rest: str) -> Serial:
    device, colon, baud = rest.rpartition(":")
    if not colon:
        return Serial(rest, 115200)
    if not baud.isdigit():
        raise TransportError(f"serial link must be serial:DEVICE:BAUD (got {rest!r})")
    return Serial(device, int(baud))


SCHEMES: dict[str, Callable[[str], Transport]] = {
    "udpout": lambda rest: Udp(*_host_and_port(rest), speaks_first=True),
    "udp": lambda rest: Udp(*_host_and_port(rest), speaks_first=False),
    "tcp": lambda rest: TcpClient(*_host_and_port(rest)),
    "tcpin": lambda rest: TcpServer(*_host_and_port(rest)),
    "serial": _serial,
}


def open_transport(url: str) -> Transport:
    """udpout:HOST:PORT speaks first, udp:HOST:PORT listens, tcp:HOST:PORT connects, tcpin:HOST:PORT listens,
    serial:DEVICE[:BAUD]. Raises TransportError."""
    scheme, _, rest = url.partition(":")
    if scheme not in SCHEMES:
        raise TransportError(f"link must begin with one of {', '.join(SCHEMES)}, can (got {url!r})")
    try:
        return SCHEMES[scheme](rest)
    except (OSError, OverflowError, serial.SerialException) as error:
        number = getattr(error, "errno", None)
        cause = os.strerror(number) if number and number > 0 else str(error)
        raise TransportError(f"link {url} cannot be opened: {cause}; `mils doctor` checks links") from error
