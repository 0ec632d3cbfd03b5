"""Addresses of links: what each means, and one clear line for what means nothing."""

import socket
from math import inf

import pytest
from tlog_files import DATA
from vehicle_frames import Vehicle

from bridge.can_map import CanMap
from bridge.errors import LinkClosed, LinkError, LogFormatError
from bridge.mavlink_map import MavlinkMap
from bridge.mavlink_source import MavlinkSource
from bridge.open import SCHEMES, open_link, open_source


@pytest.mark.parametrize("url", ["", "udp", "udp:", "ftp:host:1", "14550", "/dev/ttyACM0", "UDP:1"])
def test_unknown_scheme_lists_the_known(url: str) -> None:
    with pytest.raises(LinkError, match="unknown link") as caught:
        open_link(url)
    assert all(f"{scheme}:" in str(caught.value) for scheme in SCHEMES)


@pytest.mark.parametrize(
    "url",
    [
        "udp:host:",
        "udp:1:x",
        "udp:70000",
        "udpout:14550",
        "tcp:host",
        "tcp::1",
        "serial:/dev/x:fast",
        "udp:²",
    ],
)
def test_malformed_address_is_one_clear_line(url: str) -> None:
    with pytest.raises(LinkError, match=f"^{url}: ") as caught:
        open_link(url)
    assert "\n" not in str(caught.value)


def test_missing_devices_are_one_clear_line() -> None:
    for url in ("serial:/dev/ttyNone", "tcp:127.0.0.1:1", "udpout:no-such-host.invalid:1"):
        with pytest.raises(LinkError, match="cannot be opened") as caught:
            open_source(url, MavlinkMap(), CanMap())
        assert "\n" not in str(caught.value)


def test_log_is_a_source_and_no_link() -> None:
    with pytest.raises(LinkError, match="not a link"):
        open_link(f"log:{DATA / 'small.tlog'}")
    source = open_source(f"log:{DATA / 'small.tlog'}", MavlinkMap(), CanMap(), log_speed=inf)
    assert len(source.read(0.0)) > 100
    with pytest.raises(LinkClosed):
        source.read(0.0)
    with pytest.raises(LogFormatError, match="cannot be read"):
        open_source("log:none.tlog", MavlinkMap(), CanMap())


def test_udp_source_measures_answers_and_counts_strangers() -> None:
    """The whole way over loopback: frames in, heartbeat and requests out, one Counter for all."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    source = open_source(f"udp:127.0.0.1:{port}", MavlinkMap(), CanMap())
    assert isinstance(source, MavlinkSource)
    vehicle = Vehicle()
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sub,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        sub.settimeout(1.0)
        sub.sendto(vehicle.heartbeat() + vehicle.attitude(1000), ("127.0.0.1", port))
        stranger.connect(("127.0.0.1", port))
        out = source.read(1.0)
        stranger.send(vehicle.attitude(1100))
        out += source.read(0.2)
        assert len(out) == 2
        assert source.counts["refused.udp_sender"] == 1
        source.publish(1_000_000, {"a1": -0.6})
        answers = [sub.recv(300)]
        while b"a1" not in answers[-1]:
            answers.append(sub.recv(300))
        assert answers[0][7:10] == b"\x4c\0\0"  # COMMAND_LONG: the first rate request
    source.close()
