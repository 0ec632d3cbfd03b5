"""Prints what a log holds: `python -m tools.log_counts FILE... [--vehicle VEHICLE.toml]`.

Of a CAN log without a vehicle file the frames are counted by identifier; the PGN is meant for NMEA 2000.
"""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

from bridge.can_log import READERS as CAN_READERS
from bridge.can_log import CanLog
from bridge.errors import BridgeError
from bridge.logs import LogReading, read_log
from bridge.nmea2000 import pgn_of
from host.errors import HostError
from host.vehicle import Vehicle, default_vehicle, read_vehicle

_NO_MESSAGES = ("refused.", "note.", "ack.", "lost")  # what else is counted


def describe(name: str, reading: LogReading, cpu_s: float) -> str:
    seen = sum(n for cause, n in reading.counts.items() if not cause.startswith(_NO_MESSAGES))
    lines = [f"{name}: {seen} messages in {cpu_s:.2f} s of CPU ({seen / max(cpu_s, 1e-9):,.0f} per second)"]
    lines += [f"  {cause} {n}" for cause, n in sorted(reading.counts.items())]
    channels = Counter((item.quantity, item.source, item.boot) for item in reading.measurements)
    lines += [
        f"  -> {quantity} from {source}, boot {boot}: {n}" for (quantity, source, boot), n in channels.items()
    ]
    lines += [f"  note: {note}" for note in reading.notes]
    return "\n".join(lines)


def read(path: Path, vehicle: Vehicle | None) -> LogReading:
    """Raises BridgeError, and OSError for a CAN log that cannot be opened."""
    if vehicle is None and path.suffix.lower() in CAN_READERS:
        return _frames(CanLog(path))
    vehicle = vehicle or default_vehicle()
    return read_log(path, vehicle.mavlink, vehicle.can)


def _frames(log: CanLog) -> LogReading:
    counts: Counter[str] = Counter()
    for packet in log:
        assert packet.can_id is not None
        counts[
            f"{packet.can_id:08X} (PGN {pgn_of(packet.can_id)})"
            if packet.extended
            else f"{packet.can_id:03X}"
        ] += 1
    return LogReading(
        measurements=[], counts=counts + log.counts, notes=[*log.warnings, "what the frames mean: --vehicle"]
    )


def main() -> int:
    parser = argparse.ArgumentParser(description="what a log holds")
    parser.add_argument("files", nargs="+", metavar="FILE")
    parser.add_argument("--vehicle", type=Path, metavar="VEHICLE.toml", help="what the channels mean")
    args = parser.parse_args()
    try:
        vehicle = read_vehicle(args.vehicle) if args.vehicle else None
    except HostError as error:
        print(error, file=sys.stderr)
        return 2
    status = 0
    for name in args.files:
        begin = time.process_time()
        try:
            reading = read(Path(name), vehicle)
        except (BridgeError, OSError) as error:
            print(error, file=sys.stderr)
            status = 2
            continue
        print(describe(name, reading, time.process_time() - begin))
    return status


if __name__ == "__main__":
    sys.exit(main())
