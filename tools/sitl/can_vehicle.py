"""The simulated vehicle on a CAN bus, encoded by cantools after a DBC file."""

import logging
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import cantools

from tools.sitl.errors import TransportError
from tools.sitl.plant import stream
from tools.sitl.recording import COLUMNS
from tools.sitl.scenario import Scenario
from tools.sitl.schedule import Timetable
from tools.sitl.sensors import Instrument
from tools.sitl.track import Track

# python-can reports through logging what it then raises.
logging.getLogger("can").addHandler(logging.NullHandler())

_MULTICAST_GROUP = "239.74.163.2"  # python-can's default

Note = Callable[[float, str, float], None]


def open_bus(url: str) -> can.BusABC:
    """A bus by its address, INTERFACE as python-can names it. Raises TransportError.

    can:INTERFACE:CHANNEL[:BITRATE]    can:socketcand:HOST:PORT:CHANNEL    can:udp_multicast[:GROUP[:PORT]]
    """
    scheme, _, rest = url.partition(":")
    interface, _, channel = rest.partition(":")
    if scheme != "can" or not interface or not (channel or interface == "udp_multicast"):
        raise TransportError(f"link must be can:INTERFACE:CHANNEL (got {url!r})")
    if interface == "socketcand" and channel.count(":") != 2:
        raise TransportError(f"link must be can:socketcand:HOST:PORT:CHANNEL (got {url!r})")
    try:
        # A can.conf of this machine must not say otherwise.
        return can.Bus(interface=interface, ignore_config=True, **_bus_arguments(interface, channel))
    except Exception as error:  # every backend of python-can has classes of its own
        remedy = "; `mils doctor` says what is missing" if isinstance(error, OSError) else ""
        cause = " ".join(str(error).split())
        raise TransportError(f"link {url} cannot be opened: {cause}{remedy}") from error


def _bus_arguments(interface: str, channel: str) -> dict[str, Any]:
    name, colon, number = channel.rpartition(":")
    if interface == "udp_multicast":
        if colon and number.isdigit():
            return {"channel": name, "port": int(number)}
        return {"channel": channel or _MULTICAST_GROUP}
    if interface == "socketcand":
        host, port, bus = channel.split(":")
        return {"host": host, "port": int(port), "channel": bus}
    if colon and number.isdigit():
        return {"channel": name, "bitrate": int(number)}
    return {"channel": channel}


def load_dbc(path: Path) -> Any:
    """The messages of a DBC file. Raises TransportError."""
    try:
        return cantools.database.load_file(path)
    except (OSError, ValueError, cantools.database.errors.Error) as error:
        raise TransportError(f"dbc {path} cannot be used: {error}") from error


class CanVehicle:
    """Sends every message of the DBC that has a signal of a known channel, each at that channel's rate.

    Signals that are neither a channel nor the clock are sent as 0.
    """

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        track: Track,
        bus: can.BusABC,
        dbc: Path,
        note: Note = lambda *_: None,
    ) -> None:
        self.track = track
        self.bus = bus
        self.note = note
        self.sent: Counter[str] = Counter()
        self.heard: Counter[str] = Counter()
        self.clock_signal = scenario.can.time
        channel_of = {getattr(scenario.can, name): name for name in COLUMNS}
        self.instruments = {
            name: Instrument(getattr(scenario.sensors, name), stream(seed, name)) for name in COLUMNS
        }
        self.database = load_dbc(dbc)
        rng = stream(seed, "messages")
        self.frames: list[tuple[Any, dict[str, str], Timetable]] = []
        for message in self.database.messages:
            carried = {s.name: channel_of[s.name] for s in message.signals if s.name in channel_of}
            if carried:
                settings = self.instruments[next(iter(carried.values()))].channel
                self.frames.append((message, carried, Timetable(settings.rate_hz, settings.jitter_s, rng)))
        if not self.frames:
            raise TransportError(f"dbc {dbc} must have a signal named one of {', '.join(channel_of)}")

    @property
    def next_s(self) -> float:
        """Simulated time of the next frame."""
        return min(timetable.due_s for _, _, timetable in self.frames)

    def emit(self, t_s: float) -> None:
        """Sends all that is due at or before `t_s`, to which the track has been advanced."""
        for message, carried, timetable in self.frames:
            while timetable.due_s <= t_s + 1e-9:
                self._frame(message, carried, timetable.due_s)
                timetable.advance()

    def listen(self, timeout_s: float) -> None:
        """Waits for frames of others at most `timeout_s`."""
        try:
            frame = self.bus.recv(timeout_s)
        except (can.CanError, OSError) as error:
            raise TransportError(f"can: the bus has gone ({error})") from error
        if frame is not None:
            self.heard[f"{frame.arbitration_id:X}"] += 1

    def _frame(self, message: Any, carried: dict[str, str], t_s: float) -> None:
        values = {signal.name: 0.0 for signal in message.signals}
        for signal in message.signals:
            if signal.name == self.clock_signal:  # a clock of few bits starts again at 0
                values[signal.name] = t_s % (signal.scale * 2**signal.length)
        lost = False
        for signal_name, channel in carried.items():
            instrument = self.instruments[channel]
            true_value = self.track.value(channel, t_s - instrument.channel.latency_s)
            value = instrument.read(true_value)
            lost |= instrument.loses(t_s)
            if not lost:
                self.note(t_s, channel, value)
            values[signal_name] = value
        if lost:
            return
        try:
            data = message.encode(values, strict=False)
        except (
            ValueError,
            OverflowError,
            cantools.database.errors.Error,
        ):  # NaN and what the bits cannot hold
            self.sent["unencodable"] += 1
            return
        self.sent[message.name] += 1
        frame = can.Message(
            arbitration_id=message.frame_id, is_extended_id=message.is_extended_frame, data=data
        )
        try:
            self.bus.send(frame)
        except can.CanError:
            self.sent["unsent"] += 1
