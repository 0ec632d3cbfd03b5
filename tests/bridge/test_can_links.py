"""One contract for every CAN interface, and what goes wrong on each of them."""

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

from bridge.can_map import CanMap
from bridge.can_source import CanSource
from bridge.errors import LinkClosed, LinkError
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


@pytest.fixture(params=sorted(MEDIA))
def peer(request: pytest.FixtureRequest) -> Iterator[Peer]:
    with MEDIA[request.param]() as made:
        yield made


@pytest.fixture
def link(peer: Peer) -> Iterator[CanLink]:
    opened = CanLink.open(peer.rest, slcan_settle_s=0.0)
    yield opened
    opened.close()


def read_some(link: CanLink, count: int) -> list[Packet]:
    packets: list[Packet] = []
    end = time.monotonic() + 3.0
    while len(packets) < count and time.monotonic() < end:
        packets += link.read(0.2)
    return packets


def read_until_the_end(link: CanLink) -> None:
    for _ in range(100):
        link.read(0.1)


def key(packet: Packet) -> tuple[int | None, bytes, bool]:
    return packet.can_id, packet.data, packet.extended


def test_link_reads_frames_in_order_with_monotonic_times(peer: Peer, link: CanLink) -> None:
    before_us = time.monotonic_ns() // 1000
    for packet in (SHORT, LONG, EMPTY):
        peer.send(packet)
    packets = read_some(link, 3)
    assert [key(packet) for packet in packets] == [key(SHORT), key(LONG), key(EMPTY)]
    times = [packet.t_us for packet in packets]
    assert before_us - 1000 <= times[0] <= times[1] <= times[2] <= time.monotonic_ns() // 1000


def test_link_without_frames_waits_no_longer_than_told(link: CanLink) -> None:
    for timeout_s in (0.0, 0.05):
        start = time.monotonic()
        assert link.read(timeout_s) == []
        assert timeout_s * 0.5 <= time.monotonic() - start < timeout_s + 0.3


def test_link_writes(peer: Peer, link: CanLink) -> None:
    for packet in (SHORT, LONG, EMPTY):
        link.write(packet)
        assert peer.receive() == key(packet)


def test_link_counts_what_cannot_be_sent(link: CanLink) -> None:
    link.write(Packet(t_us=0, data=b"abc"))
    link.write(Packet(t_us=0, data=b"abc", can_id=0x1234))
    link.write(Packet(t_us=0, data=bytes(65), can_id=0x12))
    assert link.counts["refused.not_can"] == 1
    assert link.counts["refused.write"] == 2


def test_closed_link_says_so(link: CanLink) -> None:
    link.close()
    link.close()
    for _ in range(2):
        with pytest.raises(LinkClosed, match="is closed"):
            link.read(0.0)
    with pytest.raises(LinkClosed, match="is closed"):
        link.write(SHORT)


@pytest.mark.parametrize("medium", ["socketcand", "slcan"])
def test_unplugged_link_ends_once_and_for_all(medium: str) -> None:
    with MEDIA[medium]() as peer:
        link = CanLink.open(peer.rest, slcan_settle_s=0.0)
        peer.send(SHORT)
        assert read_some(link, 1)
        assert peer.unplug is not None
        peer.unplug()
        start = time.monotonic()
        with pytest.raises(LinkClosed, match=r"gone|has ended") as caught:
            read_until_the_end(link)
        assert time.monotonic() - start < 2.0
        assert "\n" not in str(caught.value)
        for _ in range(3):
            with pytest.raises(LinkClosed, match=r"gone|has ended"):
                link.read(0.1)
        with pytest.raises(LinkClosed, match=r"gone|has ended"):
            link.write(SHORT)
        link.close()


GARBAGE = {
    "udp_multicast": [b"", b"\xff\xfe\x00", b"\x81\xa1a\x01", b"x" * 3000],
    "socketcand": [
        b"< frame zz 1.0 00 >",
        b"\xff\xfe > < frame >",
        b"< frame 123 1.0 0 >",
        b"x" * 5000 + b">",
    ],
    "slcan": [b"\xff\xfe\x80\r", b"t12\r", b"t12388\r", b"tzzz1zz\r", b"\x07\x07", b"V1013\r", b"x" * 5000],
}


@pytest.mark.parametrize("medium", sorted(GARBAGE))
def test_garbage_on_the_wire_costs_no_later_frame(medium: str) -> None:
    with MEDIA[medium]() as peer:
        link = CanLink.open(peer.rest, slcan_settle_s=0.0)
        assert peer.send_bytes is not None
        for garbage in GARBAGE[medium]:
            peer.send_bytes(garbage)
        end = time.monotonic() + 2.0
        while link.counts["refused.bad_frame"] < 2 and time.monotonic() < end:
            link.read(0.05)
        peer.send(LONG)
        assert [key(packet) for packet in read_some(link, 1)] == [key(LONG)]
        assert link.counts["refused.bad_frame"] >= 2
        link.close()


def test_error_and_remote_frames_are_counted() -> None:
    with can.Bus("odd", interface="virtual", ignore_config=True) as bus:
        link = CanLink.open("virtual:odd")
        bus.send(can.Message(arbitration_id=1, is_remote_frame=True, dlc=2))
        bus.send(can.Message(is_error_frame=True))
        bus.send(can.Message(arbitration_id=1, data=b"ab", dlc=5))
        bus.send(can.Message(arbitration_id=1, data=b"ab", is_extended_id=False))
        assert [packet.data for packet in link.read(0.5)] == [b"ab"]
        assert link.counts == {"refused.remote_frame": 1, "refused.error_frame": 1, "refused.bad_frame": 1}
        link.close()


class ScriptedBus:
    """A bus that gives messages with chosen stamps."""

    def __init__(self, stamps: list[float]) -> None:
        self.messages = [can.Message(timestamp=stamp, arbitration_id=1, data=b"x") for stamp in stamps]

    def recv(self, timeout: float) -> can.Message | None:  # noqa: ARG002
        return self.messages.pop(0) if self.messages else None

    def shutdown(self) -> None:
        raise OSError("unplugged")


def test_times_do_not_jump_with_the_wall_clock() -> None:
    """Stamps: 30 ms ago, 10 ms ago, an hour ahead, an hour ago (the clock was set), none, 20 ms ago."""
    wall_s = 1.6e9
    stamps = [wall_s - 0.03, wall_s - 0.01, wall_s + 3600, wall_s - 3600, 0.0, wall_s - 0.02]
    link = CanLink(ScriptedBus(stamps), monotonic_ns=lambda: 5_000_000_000, wall_s=lambda: wall_s)
    times = [packet.t_us for packet in link.read(0.0)]
    assert times == [4_970_000, 4_990_000, 5_000_000, 5_000_000, 5_000_000, 5_000_000]
    link.close()
    assert link.counts["close_failed"] == 1


class BrokenBus:
    """A driver that raises for ever and names no cause."""

    def recv(self, timeout: float) -> can.Message | None:  # noqa: ARG002
        raise can.CanOperationError("receive failed")

    def send(self, message: can.Message, timeout: float) -> None:  # noqa: ARG002
        raise can.CanOperationError("Network is down", 100)

    def shutdown(self) -> None:
        pass


def test_driver_that_only_fails_is_given_up() -> None:
    link = CanLink(BrokenBus(), "can:maker:0")
    assert [link.read(0.0) for _ in range(999)] == [[]] * 999
    with pytest.raises(LinkClosed, match="can:maker:0 is gone: receive failed"):
        link.read(0.0)
    assert link.counts == {"refused.bad_frame": 999}


def test_interface_that_goes_down_ends_the_link_on_write() -> None:
    link = CanLink(BrokenBus(), "can:socketcan:can0")
    with pytest.raises(LinkClosed, match="Network is down"):
        link.write(SHORT)


@pytest.mark.parametrize(
    ("rest", "words"),
    [
        ("", "not a CAN interface"),
        ("vcan0", "not a CAN interface: use one of socketcan, slcan"),
        ("virtual", "must be followed by a channel"),
        ("socketcan:can0:500000", "takes no bitrate"),
        ("slcan:/dev/ttyNONE:500000", "serial:/dev/ttyNONE:115200 cannot be opened"),
        ("slcan:/dev/ttyNONE@57600:500000", "serial:/dev/ttyNONE:57600 cannot be opened"),
        ("slcan:/dev/null:500000", "cannot be opened"),
        ("socketcand:can0", "HOST:PORT:CHANNEL"),
        ("udp_multicast:239.1.1.1:port", "GROUP"),
        ("udp_multicast:10.0.0.1", "cannot be opened"),
    ],
)
def test_what_cannot_be_opened_is_one_clear_line(rest: str, words: str) -> None:
    with pytest.raises(LinkError) as caught:
        CanLink.open(rest, slcan_settle_s=0.0)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_no_server_and_refusing_server_are_one_clear_line() -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with pytest.raises(LinkError, match="is the server running"):
        CanLink.open(f"socketcand:127.0.0.1:{port}:can0")
    server = SocketcandServer(refusal="error could not open bus")
    with pytest.raises(LinkError, match="could not open bus"):
        CanLink.open(f"socketcand:127.0.0.1:{server.port}:can7")
    assert server.opened == "open can7"
    server.close()


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(97, "Address family not supported by protocol"), "the kernel has no CAN support"),
        (OSError(19, "No such device"), "there is no interface can9"),
        (PermissionError(13, "Permission denied"), "no permission"),
        (OSError(16, "Device or resource busy"), "another program"),
        (ImportError("No module named 'serial'"), "pip install pyserial"),
        (can.CanInterfaceNotImplementedError("msgpack not installed"), r"python-can\[multicast\]"),
    ],
)
def test_each_cause_says_what_to_do(monkeypatch: pytest.MonkeyPatch, error: Exception, words: str) -> None:
    def fail(*_args: object, **_options: object) -> None:
        raise error

    monkeypatch.setattr(can, "Bus", fail)
    with pytest.raises(LinkError, match=words):
        CanLink.open("socketcan:can9")


def test_source_publishes_estimates_only_where_it_may() -> None:
    with can.Bus("publish", interface="virtual", ignore_config=True) as bus:
        for can_map, expected in (
            (CanMap(), [432, 433]),
            (CanMap(publish=False), []),
            (CanMap(kind="nmea2000"), []),
            (CanMap(kind="nmea2000", publish=True), [432, 433]),
        ):
            source = CanSource(CanLink.open("virtual:publish"), can_map)
            source.publish(1_000_000, {"a1": -0.6, "a1_std": 0.1})
            heard = []
            while (message := bus.recv(0.0)) is not None:
                heard.append(message.arbitration_id)
            assert heard == expected
            source.close()
            source.close()


def test_source_joins_the_counts_of_link_and_decoder() -> None:
    with can.Bus("joined", interface="virtual", ignore_config=True) as bus:
        source = CanSource(CanLink.open("virtual:joined"), CanMap())
        bus.send(can.Message(is_error_frame=True))
        bus.send(can.Message(arbitration_id=256, data=bytes(8), is_extended_id=False))
        assert [item.quantity for item in source.read(0.5)] == ["depth"]
        assert source.counts == {"refused.error_frame": 1, "DEPTH": 1}
        source.close()
        with pytest.raises(LinkClosed):
            source.read(0.0)
