"""Messages as a DBC file lays them out, through cantools."""

from collections import Counter
from collections.abc import Mapping
from math import isnan, nan
from pathlib import Path
from typing import Any

import cantools

from bridge.can_dialect import CanMessage
from bridge.can_map import CanSignal
from bridge.errors import BridgeError
from bridge.link import Packet

DEFAULT_DBC = Path(__file__).with_name("default.dbc")
SUFFIXES = (".dbc", ".kcd", ".sym", ".arxml", ".cdd")
_ESTIMATE = "ESTIMATE_"


def load_database(path: Path) -> Any:
    """The cantools database of a file; raises BridgeError when it is not one."""
    if path.suffix.lower() not in SUFFIXES:
        raise BridgeError(f"can.dbc must end in one of {', '.join(SUFFIXES)} (got {path})")
    try:
        return cantools.database.load_file(str(path))
    except OSError as error:
        raise BridgeError(f"can.dbc {path} cannot be read: {error.strerror}") from error
    except Exception as error:
        # cantools and its parsers raise unrelated classes, from KeyError to UnicodeDecodeError.
        raise BridgeError(
            f"can.dbc {path} is not a valid {path.suffix} file: {_first_line(error)}"
        ) from error


class DbcDialect:
    """Decodes the messages that `signals` names; other messages of the DBC are only counted."""

    def __init__(self, path: Path | None, signals: tuple[CanSignal, ...], counts: Counter[str]) -> None:
        self._counts = counts
        database = load_database(DEFAULT_DBC if path is None else path)
        self._by_name: dict[str, Any] = {message.name: message for message in database.messages}
        self._by_id: dict[tuple[int, bool], Any] = {
            (message.frame_id, message.is_extended_frame): message for message in database.messages
        }
        self._mapped: dict[str, list[Any]] = {}  # cantools' signals that are used, by message
        for signal in signals:
            self._mapped.setdefault(signal.message, []).extend(self._used(signal))

    def decode(self, packet: Packet) -> CanMessage | None:
        message = self._by_id.get((packet.can_id or 0, packet.extended))
        if message is None:
            self._counts["other"] += 1
            return None
        self._counts[message.name] += 1
        mapped = self._mapped.get(message.name)
        if mapped is None:
            return None
        if len(packet.data) < message.length:
            self._counts["refused.short"] += 1
            return None
        try:
            fields = message.decode(packet.data, decode_choices=False)
        except Exception:  # KeyError and DecodeError of unknown multiplexers, among others
            self._counts["refused.not_decodable"] += 1
            return None
        for signal in mapped:
            if not _is_in_range(signal, fields.get(signal.name)):
                # A value that its own DBC excludes is a fault code or garbage, also when it looks plausible.
                self._counts["refused.range"] += 1
                fields.pop(signal.name)
        return CanMessage(message.name, message.name, fields)

    def encode(self, name: str, fields: Mapping[str, float], t_us: int) -> list[Packet]:
        message = self._by_name[name]
        values = {
            signal.name: 0 if signal.minimum is None else max(0, signal.minimum) for signal in message.signals
        }
        try:
            values |= fields
            # Values of other multiplexers may be among them, so not `strict`.
            message.assert_signals_encodable(values, scaling=True, assert_all_known=False)
            data = message.encode(values, strict=False)
        except Exception as error:  # EncodeError, OverflowError, struct.error
            raise ValueError(f"{name}: {_first_line(error)}") from error
        return [Packet(t_us=t_us, data=data, can_id=message.frame_id, extended=message.is_extended_frame)]

    def clock_period_us(self, name: str, time: str) -> int | None:
        signal = self._by_name[name].get_signal_by_name(time)
        return None if signal.is_float else round(2.0**signal.length * signal.scale * 1e6)

    def encode_estimates(self, t_us: int, values: Mapping[str, float]) -> list[Packet]:
        """The ESTIMATE_ messages that have at least one signal among `values`, their time first."""
        packets = []
        for name, message in self._by_name.items():
            signals = [signal.name for signal in message.signals]
            is_state = name == "ESTIMATE_STATE"
            if not name.startswith(_ESTIMATE) or not (
                is_state or any(signal in values for signal in signals)
            ):
                continue
            fields = {signal: values.get(signal, 0.0 if is_state else nan) for signal in signals}
            packets += (
                self.encode_stamped(name, fields, t_us) if is_state else self.encode(name, fields, t_us)
            )
        return packets

    def encode_stamped(self, name: str, fields: Mapping[str, float], t_us: int) -> list[Packet]:
        """`encode` with `t_us` in the message's own signal "time"."""
        period_us = self.clock_period_us(name, "time")
        stamp = (t_us if period_us is None else t_us % period_us) * 1e-6
        return self.encode(name, {**fields, "time": stamp}, t_us)

    def _used(self, signal: CanSignal) -> list[Any]:
        """cantools' signals of a table entry. Raises BridgeError when the DBC has no such signal."""
        message = self._by_name.get(signal.message)
        if message is None:
            names = ", ".join(sorted(self._by_name))
            raise BridgeError(f"can.signals message must be one of the DBC's: {names} (got {signal.message})")
        known = {each.name: each for each in message.signals}
        wanted = [signal.signal, *(selector.signal for selector in signal.only)]
        if signal.time is not None:
            wanted.append(signal.time)
        for name in wanted:
            if name not in known:
                raise BridgeError(
                    f"can.signals signal of {signal.message} must be one of {', '.join(known)} (got {name})"
                )
        return [known[name] for name in wanted]


def _is_in_range(signal: Any, value: Any) -> bool:
    if not isinstance(value, int | float) or isnan(value):
        return True  # absent under this multiplexer, or judged by the decoder
    # Half a step of room: the limits in a DBC are rounded for people.
    room = 0.5 * abs(signal.scale)
    return not (
        (signal.minimum is not None and value < signal.minimum - room)
        or (signal.maximum is not None and value > signal.maximum + room)
    )


def _first_line(error: Exception) -> str:
    return (str(error).strip() or type(error).__name__).splitlines()[0]
