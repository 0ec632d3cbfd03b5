"""CAN buses through python-can: socketcan, slcan, socketcand, udp_multicast, virtual, makers' adapters."""

import errno
import logging
import re
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import can
from can.interfaces import BACKENDS

from bridge.errors import LinkClosed, LinkError
from bridge.link import Packet
from bridge.links.tcp import TcpLink
from bridge.links.text_can import SLCAN_SETTLE_S, SlcanBus, SocketcandBus

# python-can reports through logging what it then raises; unhandled, both would reach the terminal.
logging.getLogger("can").addHandler(logging.NullHandler())

_MULTICAST_GROUP = "239.74.163.2"  # python-can's default
_BATCH = 1000  # frames handed over at once
_HOPELESS = 1000  # failed receives in a row: a driver that says nothing of having lost its device
_WRITE_S = 0.1
_MAX_AGE_S = 5.0  # no frame waits longer for its reader


class CanLink:
    """A `Link` on an open bus.

    counts  takes "refused.error_frame", "refused.remote_frame", "refused.bad_frame", "refused.write"
    """

    def __init__(
        self,
        bus: Any,
        name: str = "can",
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
        wall_s: Callable[[], float] = time.time,
    ) -> None:
        self.counts: Counter[str] = Counter()
        self._bus = bus
        self._name = name
        self._monotonic_ns = monotonic_ns
        self._wall_s = wall_s
        self._last_us = 0
        self._failed = 0
        self._end = f"{name} is closed"

    @classmethod
    def open(cls, rest: str, slcan_settle_s: float = SLCAN_SETTLE_S) -> "CanLink":
        """Opens INTERFACE:CHANNEL[:BITRATE], what follows "can:" in a link's name.

            socketcan:can0      slcan:/dev/ttyACM0:500000      socketcand:HOST:PORT:CHANNEL
            udp_multicast[:GROUP[:PORT]]      virtual:NAME

        Raises LinkError with what to do.
        """
        name = f"can:{rest}"
        interface, _, channel = rest.partition(":")
        try:
            return cls(_open_bus(interface, channel, slcan_settle_s), name)
        except (LinkError, LinkClosed) as error:
            raise LinkError(str(error)) from error
        except Exception as error:
            # Every backend of python-can raises classes of its own.
            raise LinkError(f"{name} cannot be opened: {_explain(channel, error)}") from error

    def read(self, timeout_s: float) -> list[Packet]:
        if self._bus is None:
            raise LinkClosed(self._end)
        packets: list[Packet] = []
        wait_s = max(0.0, timeout_s)
        for _ in range(_BATCH):
            try:
                message = self._bus.recv(wait_s)
            except Exception as error:
                self._failed += 1
                if not _is_gone(error) and self._failed < _HOPELESS:
                    self.counts["refused.bad_frame"] += 1
                    break
                self._end_with(error)
                if packets:
                    return packets  # the next read reports the end
                raise LinkClosed(self._end) from error
            if message is None:
                break
            wait_s = 0.0
            self._failed = 0
            packet = self._to_packet(message)
            if packet is not None:
                packets.append(packet)
        return packets

    def write(self, packet: Packet) -> None:
        """Sends one frame; a frame that does not get onto the bus is counted, not waited for."""
        if self._bus is None:
            raise LinkClosed(self._end)
        if packet.can_id is None:
            self.counts["refused.not_can"] += 1
            return
        try:
            message = can.Message(
                arbitration_id=packet.can_id,
                is_extended_id=packet.extended,
                data=packet.data,
                is_fd=len(packet.data) > 8,
                check=True,
            )
            self._bus.send(message, timeout=_WRITE_S)
        except Exception as error:
            if _is_gone(error):
                self._end_with(error)
                raise LinkClosed(self._end) from error
            self.counts["refused.write"] += 1

    def close(self) -> None:
        bus, self._bus = self._bus, None
        if bus is not None:
            try:
                bus.shutdown()
            except Exception:
                # An unplugged adapter cannot be told to close; there is nothing left to release.
                self.counts["close_failed"] += 1

    def _to_packet(self, message: can.Message) -> Packet | None:
        if message.is_error_frame:
            self.counts["refused.error_frame"] += 1
        elif message.is_remote_frame:
            self.counts["refused.remote_frame"] += 1
        elif len(message.data) != message.dlc:
            self.counts["refused.bad_frame"] += 1
        else:
            return Packet(
                t_us=self._receive_us(message.timestamp),
                data=bytes(message.data),
                can_id=message.arbitration_id,
                extended=message.is_extended_id,
            )
        return None

    def _receive_us(self, stamp_s: float) -> int:
        """Monotonic receive time: now, less the time the frame has waited by the wall clock.

        A wait that cannot be means that the wall clock was set, or that the stamp is another machine's.
        """
        now_us = self._monotonic_ns() // 1000
        age_s = self._wall_s() - stamp_s
        if 0.0 <= age_s <= _MAX_AGE_S:
            now_us -= round(age_s * 1e6)
        self._last_us = max(self._last_us, now_us)
        return self._last_us

    def _end_with(self, error: Exception) -> None:
        self._end = str(error) if isinstance(error, LinkClosed) else f"{self._name} is gone: {_cause(error)}"
        self.close()


def _open_bus(interface: str, channel: str, slcan_settle_s: float) -> Any:
    if interface == "socketcand":
        match = re.fullmatch(r"(\[[^]]+\]|[^:]+):(\d{1,5}):(.+)", channel)
        if match is None:
            raise LinkError(f"can:socketcand must be followed by HOST:PORT:CHANNEL (got {channel!r})")
        return SocketcandBus(TcpLink.open(match[1].strip("[]"), int(match[2])), match[3])
    if interface == "udp_multicast":
        match = re.fullmatch(r"(?:(\[[^]]+\]|[^:]+)(?::(\d{1,5}))?)?", channel)
        if match is None:
            raise LinkError(f"can:udp_multicast must be followed by GROUP[:PORT] (got {channel!r})")
        group = (match[1] or _MULTICAST_GROUP).strip("[]")
        port: dict[str, Any] = {"port": int(match[2])} if match[2] else {}
        return can.Bus(group, interface=interface, ignore_config=True, **port)
    if interface not in BACKENDS:
        known = "socketcan, slcan, socketcand, udp_multicast, virtual"
        raise LinkError(f"can:{interface} is not a CAN interface: use one of {known}")
    channel, bitrate = _split_bitrate(channel)
    if not channel:
        raise LinkError(f"can:{interface} must be followed by a channel (got none), e.g. can:socketcan:can0")
    options: dict[str, Any] = {} if bitrate is None else {"bitrate": bitrate}
    if interface == "socketcan" and bitrate is not None:
        raise LinkError(
            f"can:socketcan takes no bitrate (got {bitrate}):"
            f" sudo ip link set {channel} up type can bitrate {bitrate}"
        )
    if interface == "slcan":
        from bridge.links.serial import SerialLink  # pyserial is needed for this interface only

        device, _, baud = channel.partition("@")
        return SlcanBus(SerialLink.open(device, int(baud or 115200)), bitrate, slcan_settle_s)
    return can.Bus(channel, interface=interface, ignore_config=True, **options)


def _split_bitrate(channel: str) -> tuple[str, int | None]:
    head, _, tail = channel.rpartition(":")
    return (head, int(tail)) if head and tail.isdecimal() else (channel, None)


def _is_gone(error: Exception) -> bool:
    """Whether the device or the peer has left, rather than that one frame was bad or one queue full."""
    if isinstance(error, LinkClosed):
        return True
    if isinstance(error, can.CanTimeoutError):
        return False
    number = _errno(error)
    if number in (errno.ENOBUFS, errno.EAGAIN):
        return False
    return number is not None or isinstance(error, OSError) or isinstance(error.__cause__, OSError)


def _errno(error: Exception) -> int | None:
    for each in (error, error.__cause__, error.__context__):
        number = getattr(each, "errno", None) or getattr(each, "error_code", None)
        if isinstance(number, int):
            return number
    return None


def _cause(error: Exception) -> str:
    cause = error.__cause__ or error
    return (str(cause).strip() or type(cause).__name__).splitlines()[0]


def _explain(channel: str, error: Exception) -> str:
    number = _errno(error)
    cause = _cause(error)
    text = f"{error} {cause}".lower()
    advice = {
        errno.EINVAL: f"{cause}; a multicast GROUP is 224.0.0.0 to 239.255.255.255",
        errno.EAFNOSUPPORT: "the kernel has no CAN support: sudo modprobe can_raw, or take slcan, socketcand",
        errno.ENODEV: f"there is no interface {channel}: `ip link show type can` lists them",
        errno.EACCES: f"no permission ({cause})",
        errno.EBUSY: f"another program is using it ({cause})",
    }
    if "msgpack" in text:
        return "msgpack is missing: pip install 'python-can[multicast]'"
    if "serial" in text and isinstance(error, ImportError | NotImplementedError):
        return "pyserial is missing: pip install pyserial"
    if isinstance(error, NameError | ImportError):  # a maker's library that python-can has not found
        return f"the driver of its maker is not installed ({cause})"
    return advice.get(number or 0, cause)
