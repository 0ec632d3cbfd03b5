"""Serial ports: `serial:DEVICE[:BAUD]`."""

import errno
from collections.abc import Callable

import serial

from bridge.errors import LinkClosed, LinkError
from bridge.link import Packet
from bridge.links.refusal import refusal
from bridge.links.udp import monotonic_us

_WRITE_S = 1.0


class SerialLink:
    """A byte stream. An unplugged device is LinkClosed, and the port is closed with it."""

    def __init__(self, port: serial.Serial, name: str, clock_us: Callable[[], int] = monotonic_us) -> None:
        self._port: serial.Serial | None = port
        self._name = name
        self._clock_us = clock_us

    @classmethod
    def open(cls, device: str, baud: int = 115200) -> "SerialLink":
        name = f"serial:{device}:{baud}"
        try:
            port = serial.Serial(device, baud, timeout=0, write_timeout=_WRITE_S)
        except (serial.SerialException, OSError, ValueError) as error:
            raise LinkError(f"{name} cannot be opened: {_refusal(device, error)}") from error
        return cls(port, name)

    def read(self, timeout_s: float) -> list[Packet]:
        port = self._open_port()
        try:
            port.timeout = max(0.0, timeout_s)
            data = port.read(1)
            if data:
                data += port.read(port.in_waiting)
        except (serial.SerialException, OSError, TypeError) as error:
            self.close()
            raise LinkClosed(f"{self._name} has ended: the device is gone ({_why(error)})") from error
        return [Packet(t_us=self._clock_us(), data=data)] if data else []

    def write(self, packet: Packet) -> None:
        port = self._open_port()
        try:
            port.write(packet.data)
        except serial.SerialTimeoutException:
            return  # flow control holds the line: the next heartbeat tries again
        except (serial.SerialException, OSError, TypeError) as error:
            self.close()
            raise LinkClosed(f"{self._name} has ended: the device is gone ({_why(error)})") from error

    def close(self) -> None:
        if self._port is not None:
            self._port.close()
            self._port = None

    def _open_port(self) -> serial.Serial:
        if self._port is None:
            raise LinkClosed(f"{self._name} was closed")
        return self._port


def _refusal(device: str, error: Exception) -> str:
    if isinstance(error, serial.SerialException) and "configure" in str(error):
        return "it must be a serial port"  # pyserial keeps the errno to itself here
    rights = f"sudo usermod -aG dialout $USER, then log in again; see `ls -l {device}`"
    return refusal(error, {errno.EACCES: rights})


def _why(error: Exception) -> str:
    """pyserial repeats the device and the errno; the last part says what happened."""
    return getattr(error, "strerror", None) or str(error).split("] ")[-1].split(": ")[0]
