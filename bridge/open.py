"""What a link's address means: one table, one line a scheme."""

from collections import Counter
from collections.abc import Callable

from bridge.can_map import CanMap
from bridge.errors import LinkError
from bridge.link import Link
from bridge.log_source import LogSource
from bridge.logs import read_log
from bridge.mavlink_map import MavlinkMap
from bridge.mavlink_source import MavlinkSource
from bridge.source import Source

_ANY_HOST = "0.0.0.0"


def open_link(url: str, counts: Counter[str] | None = None) -> Link:
    """The link of an address such as "udp:127.0.0.1:14550"; `counts` takes what the link itself refuses.

    LinkError, in one line, for an unknown scheme, a malformed address, a busy port, a host or device that
    does not exist, a CAN interface that the kernel lacks.
    """
    _, opener, rest = _split(url)
    if opener is None:
        raise LinkError(f"{url}: a log is a source of measurements, not a link to send on")
    return opener(rest, url, counts)


def open_source(url: str, mavlink: MavlinkMap, can: CanMap, log_speed: float = 1.0) -> Source:
    """The source of measurements at an address; LinkError as `open_link`, LogFormatError for a bad log."""
    scheme, opener, rest = _split(url)
    if opener is None:
        return LogSource(read_log(rest, mavlink, can), speed=log_speed)
    counts: Counter[str] = Counter()
    link = opener(rest, url, counts)
    if scheme == "can":
        from bridge.can_source import CanSource  # python-can and cantools load only for CAN

        return CanSource(link, can)
    return MavlinkSource(link, mavlink, counts=counts)


def _split(url: str) -> tuple[str, "_Opener | None", str]:
    scheme, colon, rest = url.partition(":")
    if scheme not in SCHEMES or not colon or not rest:
        known = ", ".join(f"{name}:{form}" for name, (form, _) in SCHEMES.items())
        raise LinkError(f"unknown link {url!r}; known are {known}")
    return scheme, SCHEMES[scheme][1], rest


def _host_port(rest: str, url: str, default_host: str | None = None) -> tuple[str, int]:
    host, colon, port = rest.rpartition(":")
    if not colon and default_host is not None:
        host = default_host
    if not host or not port.isascii() or not port.isdigit() or not 0 <= int(port) <= 65535:
        raise LinkError(f"{url}: must end in HOST:PORT with PORT in 0..65535")
    return host, int(port)


def _udp(rest: str, url: str, counts: Counter[str] | None) -> Link:
    from bridge.links.udp import UdpLink

    return UdpLink.listen(*_host_port(rest, url, _ANY_HOST), counts)


def _udpout(rest: str, url: str, counts: Counter[str] | None) -> Link:
    from bridge.links.udp import UdpLink

    return UdpLink.speak(*_host_port(rest, url), counts)


def _tcp(rest: str, url: str, counts: Counter[str] | None) -> Link:  # noqa: ARG001
    from bridge.links.tcp import TcpLink

    return TcpLink.open(*_host_port(rest, url))


def _serial(rest: str, url: str, counts: Counter[str] | None) -> Link:  # noqa: ARG001
    from bridge.links.serial import SerialLink

    device, colon, baud = rest.rpartition(":")
    if not colon:
        return SerialLink.open(rest)
    if not baud.isascii() or not baud.isdigit():
        raise LinkError(f"{url}: BAUD must be a number")
    return SerialLink.open(device, int(baud))


def _can(rest: str, url: str, counts: Counter[str] | None) -> Link:  # noqa: ARG001
    from bridge.links.can import CanLink

    return CanLink.open(rest)


_Opener = Callable[[str, str, Counter[str] | None], Link]

SCHEMES: dict[str, tuple[str, _Opener | None]] = {
    "udp": ("[HOST:]PORT", _udp),
    "udpout": ("HOST:PORT", _udpout),
    "tcp": ("HOST:PORT", _tcp),
    "serial": ("DEVICE[:BAUD]", _serial),
    "can": ("INTERFACE:CHANNEL[:BITRATE]", _can),
    "log": ("FILE", None),  # played by LogSource; nothing can be sent on it
}
"""Scheme to the form of what follows it, and what opens it."""
