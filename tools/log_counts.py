"""Prints what a log holds: `python -m tools.log_counts FILE... [--vehicle VEHICLE.toml]`."""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

from bridge.errors import BridgeError
from bridge.logs import LogReading, read_log
from host.errors import HostError
from host.vehicle import default_vehicle, read_vehicle


def describe(name: str, reading: LogReading, cpu_s: float) -> str:
    seen = sum(n for cause, n in reading.counts.items() if cause.isupper())
    lines = [f"{name}: {seen} messages in {cpu_s:.2f} s of CPU ({seen / max(cpu_s, 1e-9):,.0f} per second)"]
    lines += [f"  {cause} {n}" for cause, n in sorted(reading.counts.items())]
    channels = Counter((item.quantity, item.source, item.boot) for item in reading.measurements)
    lines += [
        f"  -> {quantity} from {source}, boot {boot}: {n}" for (quantity, source, boot), n in channels.items()
    ]
    lines += [f"  note: {note}" for note in reading.notes]
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description="what a log holds")
    parser.add_argument("files", nargs="+", metavar="FILE")
    parser.add_argument("--vehicle", type=Path, metavar="VEHICLE.toml", help="what the channels mean")
    args = parser.parse_args()
    try:
        vehicle = read_vehicle(args.vehicle) if args.vehicle else default_vehicle()
    except HostError as error:
        print(error, file=sys.stderr)
        return 2
    status = 0
    for name in args.files:
        begin = time.process_time()
        try:
            reading = read_log(name, vehicle.mavlink, vehicle.can)
        except BridgeError as error:
            print(error, file=sys.stderr)
            status = 2
            continue
        print(describe(name, reading, time.process_time() - begin))
    return status


if __name__ == "__main__":
    sys.exit(main())
