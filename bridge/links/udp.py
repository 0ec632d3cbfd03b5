"""UDP: `udp:` listens and answers its peer, `udpout:` speaks first to a known address."""

import select
import socket
import time
from collections import Counter
from collections.abc import Callable

from bridge.errors import LinkClosed, LinkError
from bridge.link import Packet
from bridge.links.refusal import refusal

_MOST_PER_READ = 1000  # datagrams; a flood must not keep the caller from its heartbeat
_PEER_SILENCE_US = 5_000_000


def monotonic_us() -> int:
    return time.monotonic_ns() // 1000


class UdpLink:
    """Packets from one peer.

    Listening, the first sender is the peer; datagrams of others are counted ("refused.udp_sender") and
    dropped unless the peer has been silent for 5 s, as after a restart on another port. Nothing is sent
    before a peer is known. Speaking first, the peer is the given address for ever.
    """

    def __init__(
        self,
        sock: socket.socket,
        *,
        peer: tuple[str, int] | None,
        counts: Counter[str] | None = None,
        clock_us: Callable[[], int] = monotonic_us,
    ) -> None:
        self._socket: socket.socket | None = sock
        self._fixed = peer is not None
        self._peer = peer
        self._heard_us = 0
        self._counts: Counter[str] = Counter() if counts is None else counts
        self._clock_us = clock_us

    @classmethod
    def listen(cls, host: str, port: int, counts: Counter[str] | None = None) -> "UdpLink":
        """Binds; LinkError when the port is in use or the host is none of this machine's."""
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            sock.bind((host, port))
        except (OSError, OverflowError) as error:
            sock.close()
            raise LinkError(f"udp:{host}:{port} cannot be opened: {refusal(error)}") from error
        return cls._ready(sock, None, counts)

    @classmethod
    def speak(cls, host: str, port: int, counts: Counter[str] | None = None) -> "UdpLink":
        """Sends to host:port from a free port; LinkError when the host cannot be resolved."""
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            peer = socket.getaddrinfo(host, port, socket.AF_INET, socket.SOCK_DGRAM)[0][4]
            sock.bind(("", 0))
        except (OSError, OverflowError, UnicodeError) as error:
            sock.close()
            raise LinkError(f"udpout:{host}:{port} cannot be opened: {refusal(error)}") from error
        return cls._ready(sock, (str(peer[0]), int(peer[1])), counts)

    @classmethod
    def _ready(
        cls, sock: socket.socket, peer: tuple[str, int] | None, counts: Counter[str] | None
    ) -> "UdpLink":
        sock.setblocking(False)
        return cls(sock, peer=peer, counts=counts)

    @property
    def port(self) -> int:
        """The local port."""
        return int(self._open_socket().getsockname()[1])

    def read(self, timeout_s: float) -> list[Packet]:
        sock = self._open_socket()
        packets: list[Packet] = []
        if not select.select([sock], [], [], max(0.0, timeout_s))[0]:
            return packets
        for _ in range(_MOST_PER_READ):
            try:
                data, sender = sock.recvfrom(65535)
            except BlockingIOError:
                break
            except ConnectionRefusedError:
                continue  # an answer to what was sent earlier: nobody listens there yet
            now = self._clock_us()
            if self._is_peer(sender, now):
                packets.append(Packet(t_us=now, data=data))
            else:
                self._counts["refused.udp_sender"] += 1
        return packets

    def _is_peer(self, sender: tuple[str, int], now_us: int) -> bool:
        if sender != self._peer:
            if self._fixed or (self._peer is not None and now_us - self._heard_us < _PEER_SILENCE_US):
                return False
            self._peer = sender
        self._heard_us = now_us
        return True

    def write(self, packet: Packet) -> None:
        sock = self._open_socket()
        if self._peer is None:
            return
        try:
            sock.sendto(packet.data, self._peer)
        except OSError:  # no route now, buffer full: the next heartbeat tries again
            self._counts["refused.send"] += 1

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _open_socket(self) -> socket.socket:
        if self._socket is None:
            raise LinkClosed("the UDP link was closed")
        return self._socket
