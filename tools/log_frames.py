"""A log as the frames of a live vehicle, each with the time at which it is due."""

from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import groupby
from math import isfinite
from pathlib import Path

from bridge.errors import LogFormatError
from bridge.link import Packet
from bridge.logs import read_log
from bridge.mavlink_encoder import MavlinkEncoder
from bridge.mavlink_frames import Scanner
from bridge.measurement import Measurement, Quantity
from host.live.journal import read_journal
from host.recordings.csv_recording import read_csv_recording
from host.vehicle import Vehicle

CAN_SUFFIXES = (".log", ".txt", ".asc", ".blf")
_STAMP = 8  # bytes before each frame of a .tlog
_LONGEST_PAUSE_US = 3600 * 1_000_000  # a longer step of the clock is a clock that was set
_HEARTBEAT_US = 1_000_000


def frames_of(
    path: Path, vehicle: Vehicle, on_can: bool, counts: Counter[str]
) -> Iterator[tuple[float, Packet]]:
    """(seconds since the first, packet) of a log, in order.

    The frames themselves where log and link are of one kind (.tlog on a byte link, a CAN log on a bus); else
    the log's measurements, encoded after the vehicle file. `counts` takes what was refused, by cause.
    Raises LogFormatError, RecordingError.
    """
    suffix = path.suffix.lower()
    if on_can and suffix in CAN_SUFFIXES:
        from bridge.can_log import CanLog  # python-can loads only for CAN

        log = CanLog(path)
        return _since_first(log)
    if not on_can and suffix == ".tlog":
        return _since_first(_tlog_frames(path, counts))
    measurements = _measurements(path, vehicle)
    if on_can:
        return _since_first(_as_can(measurements, vehicle, counts))
    return _since_first(_as_mavlink(measurements, vehicle))


def _since_first(packets: Iterable[Packet]) -> Iterator[tuple[float, Packet]]:
    """Times that never run backwards and never pause for more than an hour."""
    due_us, last_us = 0, None
    for packet in packets:
        step_us = 0 if last_us is None else packet.t_us - last_us
        if 0 < step_us <= _LONGEST_PAUSE_US:
            due_us += step_us
        last_us = packet.t_us
        yield due_us * 1e-6, packet


def _tlog_frames(path: Path, counts: Counter[str]) -> Iterator[Packet]:
    """The intact frames of a .tlog, byte for byte, under the stamps before them."""
    data = path.read_bytes()
    scanner = Scanner(counts)
    at = 0
    frame, start = scanner.next_frame(data, min(_STAMP, len(data)), final=True)
    if frame is None:
        raise LogFormatError(f"{path}: no MAVLink in it; a .tlog is what a ground station records")
    while frame is not None:
        at = start + frame.length
        yield Packet(t_us=int.from_bytes(data[start - _STAMP : start], "big"), data=data[start:at])
        frame, start = scanner.next_frame(data, min(at + _STAMP, len(data)), final=True)


def _measurements(path: Path, vehicle: Vehicle) -> list[Measurement]:
    match path.suffix.lower():
        case ".jsonl":
            return list(read_journal(path).measurements)
        case ".csv":
            return _csv_measurements(path, vehicle)
        case _:
            return read_log(path, vehicle.mavlink, vehicle.can).measurements


def _csv_measurements(path: Path, vehicle: Vehicle) -> list[Measurement]:
    measurements = []
    for piece in read_csv_recording(path, vehicle.csv):
        columns = [(quantity, getattr(piece, quantity.value).tolist()) for quantity in Quantity]
        for row, time_s in enumerate(piece.time.tolist()):
            measurements += [
                Measurement(quantity=quantity, value=values[row], t_us=round(time_s * 1e6), source=path.name)
                for quantity, values in columns
                if isfinite(values[row])
            ]
    return measurements


def _as_mavlink(measurements: list[Measurement], vehicle: Vehicle) -> Iterator[Packet]:
    """One datagram for each instant, and the heartbeat of an autopilot once a second."""
    mapping = vehicle.mavlink
    encoder = MavlinkEncoder(
        mapping,
        system=1 if mapping.system_id is None else mapping.system_id,
        component=1 if mapping.component_id is None else mapping.component_id,
    )
    beat_us: int | None = None
    for (boot, t_us), instant in groupby(measurements, key=lambda item: (item.boot, item.t_us)):
        del boot
        if beat_us is None or not 0 <= t_us - beat_us < _HEARTBEAT_US:
            beat_us = t_us
            yield Packet(t_us=t_us, data=encoder.vehicle_heartbeat())
        data = encoder.measurements(instant)
        if data:
            yield Packet(t_us=t_us, data=data)


def _as_can(measurements: list[Measurement], vehicle: Vehicle, counts: Counter[str]) -> Iterator[Packet]:
    from bridge.can_encoder import CanEncoder  # cantools loads only for CAN

    encoder = CanEncoder(vehicle.can, counts)
    for measurement in measurements:
        yield from encoder.encode(measurement)
