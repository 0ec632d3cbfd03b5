"""The other end of each CAN interface, as the tests hold it."""

import contextlib
import os
import pty
import select
import socket
import threading
import time
import tty
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import can
import pytest

from bridge.link import Packet
from bridge.links.can import CanLink

SHORT = Packet(t_us=0, data=b"\x01\x02\x03", can_id=0x123)


LONG = Packet(t_us=0, data=bytes(range(8)), can_id=0x18FEF1AB, extended=True)


EMPTY = Packet(t_us=0, data=b"", can_id=0x7FF)


@dataclass
class Peer:
    """The other end of a link: what it sends and hears, whatever the medium."""

    rest: str
    send: Callable[[Packet], None]
    receive: Callable[[], tuple[int, bytes, bool]]
    send_bytes: Callable[[bytes], object] | None = None
    unplug: Callable[[], None] | None = None


def bus_peer(rest: str, bus: can.BusABC) -> Peer:
    def send(packet: Packet) -> None:
        bus.send(
            can.Message(
                arbitration_id=packet.can_id or 0,
                data=packet.data,
                is_extended_id=packet.extended,
                check=True,
            )
        )

    def receive() -> tuple[int, bytes, bool]:
        message = bus.recv(2.0)
        assert message is not None
        return message.arbitration_id, bytes(message.data), message.is_extended_id

    return Peer(rest=rest, send=send, receive=receive)


@contextlib.contextmanager
def virtual() -> Iterator[Peer]:
    with can.Bus("contract", interface="virtual", ignore_config=True) as bus:
        yield bus_peer("virtual:contract", bus)


@contextlib.contextmanager
def udp_multicast() -> Iterator[Peer]:
    pytest.importorskip("msgpack", reason="python-can[multicast] is not installed")
    port = 43113 + os.getpid() % 1000
    try:
        bus = can.Bus("239.74.163.2", interface="udp_multicast", port=port, ignore_config=True)
        bus.send(can.Message(arbitration_id=1))
        heard = bus.recv(0.5)
    except (can.CanError, OSError) as error:
        pytest.skip(f"this machine has no multicast: {error}")
    if heard is None:
        bus.shutdown()
        pytest.skip("this machine does not deliver multicast to itself")
    with bus, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as raw:
        peer = bus_peer(f"udp_multicast:239.74.163.2:{port}", bus)
        peer.send_bytes = lambda data: raw.sendto(data, ("239.74.163.2", port))
        yield peer


class SocketcandServer:
    """Enough of socketcand for one client: the handshake, then frames both ways."""

    def __init__(self, refusal: str = "") -> None:
        self.refusal = refusal
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self.listener.getsockname()[1]
        self.opened = ""
        self.connected = threading.Event()
        self.client: socket.socket | None = None
        self.text = b""
        self.thread = threading.Thread(target=self.accept, daemon=True)
        self.thread.start()

    def accept(self) -> None:
        with contextlib.suppress(OSError):
            self.client, _ = self.listener.accept()
            self.client.settimeout(2.0)
            self.client.sendall(b"< hi >")
            self.opened = self.element()
            if self.refusal:
                self.client.sendall(f"< {self.refusal} >".encode())
                return
            self.client.sendall(b"< ok >")
            assert self.element() == "rawmode"
            self.client.sendall(b"< ok >")
        self.connected.set()

    def element(self) -> str:
        assert self.client is not None
        while b">" not in self.text:
            self.text += self.client.recv(100)
        element, _, self.text = self.text.partition(b">")
        return element.decode().strip("< ")

    def say(self, data: bytes) -> None:
        assert self.connected.wait(2.0)
        assert self.client is not None
        self.client.sendall(data)

    def close(self) -> None:
        self.listener.close()
        if self.client is not None:
            self.client.close()


@contextlib.contextmanager
def socketcand() -> Iterator[Peer]:
    server = SocketcandServer()

    def send(packet: Packet) -> None:
        can_id = f"{packet.can_id:08X}" if packet.extended else f"{packet.can_id:03X}"
        server.say(f"< frame {can_id} 17.000001 {packet.data.hex().upper()} >".encode())

    def receive() -> tuple[int, bytes, bool]:
        assert server.connected.wait(2.0)
        word, can_id, length, *data = server.element().split()
        assert word == "send"
        assert int(length, 16) == len(data)
        return int(can_id, 16), bytes(int(byte, 16) for byte in data), len(can_id) == 8

    yield Peer(
        rest=f"socketcand:127.0.0.1:{server.port}:can0",
        send=send,
        receive=receive,
        send_bytes=server.say,
        unplug=server.close,
    )
    server.close()


@contextlib.contextmanager
def slcan() -> Iterator[Peer]:
    main, other = pty.openpty()
    tty.setraw(main)
    tty.setraw(other)
    name = os.ttyname(other)
    os.close(other)
    closed = False

    def send(packet: Packet) -> None:
        head = f"T{packet.can_id:08X}" if packet.extended else f"t{packet.can_id:03X}"
        os.write(main, f"{head}{len(packet.data)}{packet.data.hex().upper()}\r".encode())

    def receive() -> tuple[int, bytes, bool]:
        line = b""
        while True:
            assert select.select([main], [], [], 2.0)[0]
            byte = os.read(main, 1)
            if byte != b"\r":
                line += byte
                continue
            digits = {b"t": 3, b"T": 8}.get(line[:1])
            if digits is not None:
                can_id, length = int(line[1 : 1 + digits], 16), int(line[1 + digits : 2 + digits])
                data = bytes.fromhex(line[2 + digits :].decode())
                assert len(data) == length
                return can_id, data, digits == 8
            line = b""

    def unplug() -> None:
        nonlocal closed
        closed = True
        os.close(main)

    yield Peer(
        rest=f"slcan:{name}:500000",
        send=send,
        receive=receive,
        send_bytes=lambda data: os.write(main, data),
        unplug=unplug,
    )
    if not closed:
        os.close(main)


@contextlib.contextmanager
def socketcan() -> Iterator[Peer]:
    channel = os.environ.get("MILS_TEST_CAN", "vcan0")
    try:
        bus = can.Bus(channel, interface="socketcan", ignore_config=True)
    except (OSError, can.CanError) as error:
        pytest.skip(f"no socketcan {channel}: {error}")
    with bus:
        yield bus_peer(f"socketcan:{channel}", bus)


MEDIA = {each.__name__: each for each in (virtual, udp_multicast, socketcand, slcan, socketcan)}


def read_some(link: CanLink, count: int) -> list[Packet]:
    packets: list[Packet] = []
    end = time.monotonic() + 3.0
    while len(packets) < count and time.monotonic() < end:
        packets += link.read(0.2)
    return packets


def key(packet: Packet) -> tuple[int | None, bytes, bool]:
    return packet.can_id, packet.data, packet.extended
