"""One contract for every byte link, over loopback and a pseudo terminal; then what each medium adds."""

import errno
import os
import pty
import socket
import termios
import time
import tty
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from bridge.errors import LinkClosed, LinkError
from bridge.link import Link, Packet
from bridge.links.refusal import refusal
from bridge.links.serial import SerialLink
from bridge.links.tcp import TcpLink
from bridge.links.udp import UdpLink

HOST = "127.0.0.1"


@dataclass
class Pair:
    """A link and the far end of its medium."""

    link: Link
    send: Callable[[bytes], object]
    receive: Callable[[], bytes]
    hang_up: Callable[[], None] | None = None


def udp_listen() -> Iterator[Pair]:
    far = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    far.settimeout(1.0)
    link = UdpLink.listen(HOST, 0)
    far.sendto(b"hello", (HOST, link.port))
    assert link.read(1.0)[0].data == b"hello"  # the peer is known from here on
    yield Pair(link, lambda data: far.sendto(data, (HOST, link.port)), lambda: far.recv(65535))
    far.close()


def udp_speak() -> Iterator[Pair]:
    far = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    far.settimeout(1.0)
    far.bind((HOST, 0))
    link = UdpLink.speak(HOST, far.getsockname()[1])
    yield Pair(link, lambda data: far.sendto(data, (HOST, link.port)), lambda: far.recv(65535))
    far.close()


def tcp() -> Iterator[Pair]:
    with socket.create_server((HOST, 0)) as server:
        link = TcpLink.open(HOST, server.getsockname()[1])
        far, _ = server.accept()
        far.settimeout(1.0)
        yield Pair(link, far.sendall, lambda: far.recv(65535), far.close)
        far.close()


def serial_port() -> Iterator[Pair]:
    near, far = pty.openpty()
    tty.setraw(near)
    tty.setraw(far, termios.TCSANOW)
    link = SerialLink.open(os.ttyname(far))
    os.close(far)
    closed = []

    def hang_up() -> None:
        if not closed:
            closed.append(True)
            os.close(near)

    yield Pair(link, lambda data: os.write(near, data), lambda: os.read(near, 65535), hang_up)
    hang_up()


@pytest.fixture(params=[udp_listen, udp_speak, tcp, serial_port], ids=lambda make: make.__name__)
def pair(request: pytest.FixtureRequest) -> Iterator[Pair]:
    made = request.param()
    pair = next(made)
    yield pair
    pair.link.close()
    next(made, None)


def read_all(link: Link, n_bytes: int) -> bytes:
    data = b""
    deadline = time.monotonic() + 2.0
    while len(data) < n_bytes and time.monotonic() < deadline:
        data += b"".join(packet.data for packet in link.read(0.1))
    return data


def test_bytes_arrive_as_sent_with_a_rising_receive_time(pair: Pair) -> None:
    times = []
    for k in range(3):
        pair.send(bytes([k, 0xFD, 0, 10, 13]))
        packets = pair.link.read(1.0)
        assert b"".join(packet.data for packet in packets) == bytes([k, 0xFD, 0, 10, 13])
        times += [packet.t_us for packet in packets]
    assert times == sorted(times)


def test_bytes_are_sent_as_written(pair: Pair) -> None:
    pair.link.write(Packet(t_us=0, data=b"\xfd\x00\x11\x13\r\n"))
    assert pair.receive() == b"\xfd\x00\x11\x13\r\n"


def test_read_waits_no_longer_than_told(pair: Pair) -> None:
    begin = time.monotonic()
    assert pair.link.read(0.05) == []
    assert 0.04 < time.monotonic() - begin < 0.5
    begin = time.monotonic()
    assert pair.link.read(0.0) == []
    assert time.monotonic() - begin < 0.05


def test_what_waits_comes_together(pair: Pair) -> None:
    for _ in range(100):
        pair.send(b"0123456789")
    time.sleep(0.05)
    reads, n_bytes = 0, 0
    while n_bytes < 1000 and reads < 50:
        n_bytes += sum(len(packet.data) for packet in pair.link.read(0.5))
        reads += 1
    assert n_bytes == 1000
    assert reads < 50  # a pseudo terminal hands over in portions, but never message by message


def test_close_twice_then_read_says_closed(pair: Pair) -> None:
    pair.link.close()
    pair.link.close()
    with pytest.raises(LinkClosed):
        pair.link.read(0.0)


@pytest.mark.parametrize("pair", [tcp, serial_port], ids=["tcp", "serial"], indirect=True)
def test_far_end_gone_is_link_closed(pair: Pair) -> None:
    assert pair.hang_up is not None
    pair.send(b"last words")
    assert read_all(pair.link, 10) == b"last words"
    pair.hang_up()
    with pytest.raises(LinkClosed, match="has ended"):
        read_all(pair.link, 1)
    with pytest.raises(LinkClosed, match="was closed"):
        pair.link.write(Packet(t_us=0, data=b"x"))


# UDP


class Clock:
    now_us = 0

    def __call__(self) -> int:
        return self.now_us


def listening(counts: Counter[str]) -> tuple[UdpLink, Clock, socket.socket, socket.socket]:
    near = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    near.bind((HOST, 0))
    near.setblocking(False)
    clock = Clock()
    peers = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
    for peer in peers:
        peer.settimeout(0.2)
        peer.bind((HOST, 0))
    return UdpLink(near, peer=None, counts=counts, clock_us=clock), clock, *peers


def test_udp_keeps_to_its_first_sender_until_that_falls_silent() -> None:
    counts: Counter[str] = Counter()
    link, clock, first, second = listening(counts)
    first.sendto(b"a", (HOST, link.port))
    assert [packet.data for packet in link.read(0.5)] == [b"a"]
    second.sendto(b"b", (HOST, link.port))
    assert link.read(0.5) == []
    assert counts == {"refused.udp_sender": 1}
    link.write(Packet(t_us=0, data=b"to the first"))
    assert first.recv(100) == b"to the first"
    clock.now_us = 6_000_000
    second.sendto(b"c", (HOST, link.port))
    assert [packet.data for packet in link.read(0.5)] == [b"c"]
    link.write(Packet(t_us=0, data=b"to the second"))
    assert second.recv(100) == b"to the second"
    for item in (link, first, second):
        item.close()


def test_udp_listening_sends_nothing_before_it_heard_anyone() -> None:
    link, _, first, second = listening(Counter())
    link.write(Packet(t_us=0, data=b"x"))
    with pytest.raises(TimeoutError):
        first.recv(10)
    for item in (link, first, second):
        item.close()


def test_udp_speaking_refuses_everyone_else_for_ever() -> None:
    counts: Counter[str] = Counter()
    link = UdpLink.speak(HOST, 9, counts)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.sendto(b"x", (HOST, link.port))
        assert link.read(0.5) == []
    assert counts == {"refused.udp_sender": 1}
    link.close()


def test_udp_speaking_to_a_port_where_nobody_listens_goes_on() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind((HOST, 0))
        port = free.getsockname()[1]
    link = UdpLink.speak(HOST, port)
    for _ in range(3):
        link.write(Packet(t_us=0, data=b"x"))
        assert link.read(0.01) == []
    link.close()


# Opening


def test_port_in_use_is_one_clear_line() -> None:
    link = UdpLink.listen(HOST, 0)
    with pytest.raises(
        LinkError, match=rf"^udp:{HOST}:{link.port} cannot be opened: Address already in use; .*$"
    ):
        UdpLink.listen(HOST, link.port)
    link.close()


def test_host_that_is_not_ours_is_one_clear_line() -> None:
    with pytest.raises(LinkError, match=r"^udp:192\.0\.2\.1:14550 .*; HOST must be an address of this"):
        UdpLink.listen("192.0.2.1", 14550)


@pytest.mark.parametrize("host", ["no-such-host.invalid", "a" * 300, ""])
def test_host_that_does_not_resolve_is_one_clear_line(host: str) -> None:
    for open_it in (UdpLink.speak, TcpLink.open):
        if host == "" and open_it is UdpLink.speak:
            continue  # the empty host is this machine
        with pytest.raises(LinkError, match=r"cannot be opened: .+") as caught:
            open_it(host, 1)
        assert "\n" not in str(caught.value)


def test_tcp_without_a_server_is_one_clear_line() -> None:
    with pytest.raises(LinkError, match=r"^tcp:127\.0\.0\.1:1 cannot be opened: Connection refused; is the"):
        TcpLink.open(HOST, 1)


def test_missing_serial_device_is_one_clear_line(tmp_path: Path) -> None:
    ordinary = tmp_path / "notes.txt"
    ordinary.touch()
    for device, cause in [
        (tmp_path / "ttyNone", "No such file or directory; plug the device in; `mils doctor` lists"),
        (tmp_path, "Is a directory"),
        (ordinary, "it must be a serial port"),
    ]:
        with pytest.raises(LinkError) as caught:
            SerialLink.open(str(device), 57600)
        assert str(caught.value).startswith(f"serial:{device}:57600 cannot be opened: {cause}")
        assert "\n" not in str(caught.value)


def test_refusal_says_what_to_do() -> None:
    for number, remedy in [
        (errno.EADDRINUSE, "ss -lnup"),
        (errno.ENETUNREACH, "ip route"),
        (errno.EBUSY, "another program"),
    ]:
        assert remedy in refusal(OSError(number, "x"))
    assert refusal(OSError(errno.EACCES, "x"), {errno.EACCES: "ask"}) == "Permission denied; ask"
    assert refusal(TimeoutError("timed out")).startswith("Connection timed out; check")
    assert refusal(socket.gaierror(-2, "Name or service not known")).endswith(
        "check HOST, or give it as numbers"
    )
    assert refusal(OverflowError("port must be 0-65535")) == "port must be 0-65535"
