"""One contract for every CAN interface, and what goes wrong on each of them."""

import socket
import time
from collections.abc import Iterator

import can
import pytest
from can_peers import EMPTY, LONG, MEDIA, SHORT, Peer, SocketcandServer, key, read_some

from bridge.can_map import CanMap
from bridge.can_source import CanSource
from bridge.errors import LinkClosed, LinkError
from bridge.link import Packet
from bridge.links.can import CanLink


@pytest.fixture(params=sorted(MEDIA))
def peer(request: pytest.FixtureRequest) -> Iterator[Peer]:
    with MEDIA[request.param]() as made:
        yield made


@pytest.fixture
def link(peer: Peer) -> Iterator[CanLink]:
    opened = CanLink.open(peer.rest, slcan_settle_s=0.0)
    yield opened
    opened.close()


def read_until_the_end(link: CanLink) -> None:
    for _ in range(100):
        link.read(0.1)


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
