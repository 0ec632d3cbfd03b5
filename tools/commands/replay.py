"""`mils replay`: a log as the live frames of a vehicle."""

import argparse
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from math import isnan
from pathlib import Path

from bridge.errors import LinkError
from bridge.link import Link, Packet
from host.errors import ConfigError
from host.vehicle import Vehicle, default_vehicle, read_vehicle
from tools.sitl.schedule import Pace
from tools.status_line import StatusLine
from tools.stop_signals import stop_signals

HELP = "a log as live frames"
_LONGEST_WAIT_S = 0.2  # so that a request to stop is soon heard


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "log", type=Path, metavar="LOG", help=".tlog, .BIN, .csv, .jsonl, candump .log, .asc, .blf"
    )
    parser.add_argument(
        "--link", required=True, help="udpout:HOST:PORT, serial:DEVICE:BAUD, can:INTERFACE:CHANNEL, ..."
    )
    parser.add_argument(
        "--vehicle", type=Path, metavar="TOML", help="vehicle file: meaning of columns, PWM, signals"
    )
    parser.add_argument(
        "--speed", type=float, default=1.0, help="times real time (default: 1); inf for no pauses"
    )
    parser.add_argument("--loop", action="store_true", help="begin again at the end")
    parser.add_argument("--quiet", action="store_true", help="say nothing")


def run(args: argparse.Namespace) -> int:
    """0 when the log was sent or the run was stopped, 1 when nothing in it could be sent.

    Raises ConfigError, LinkError, LinkClosed, LogFormatError, RecordingError.
    """
    # Loaded here, so that `mils doctor` starts where pymavlink is missing.
    from bridge.open import open_link
    from tools.log_frames import frames_of

    if isnan(args.speed) or args.speed <= 0.0:
        raise ConfigError(f"--speed must be > 0 (got {args.speed})")
    if args.link.startswith("log:"):
        raise LinkError("--link must be a link to send on (got a log)")
    vehicle = _demonstration() if args.vehicle is None else read_vehicle(args.vehicle)
    on_can = args.link.startswith("can:")
    counts: Counter[str] = Counter()

    def frames() -> Iterator[tuple[float, Packet]]:
        return frames_of(args.log, vehicle, on_can, counts)

    first = next(frames(), None)  # a log that cannot be used is refused before the link is opened
    if first is None:
        if not args.quiet:
            print(f"{args.log}: nothing in it can be sent on {args.link}{_causes(counts)}")
        return 1
    link = open_link(args.link)
    try:
        with stop_signals() as stop:
            player = Player(link, args.speed, time.monotonic, stop.is_set)
            status = StatusLine(player.describe, args.quiet)
            status.begin(f"{args.log} on {args.link}, {args.speed:g} times real time. Ctrl-C stops.")
            player.play(frames(), status.tell)
            while args.loop and not stop.is_set():
                player.play(frames(), status.tell)
            status.finish()
    finally:
        link.close()
    return 0


class Player:
    """Sends packets when they are due and reads what comes back, which keeps the link alive."""

    def __init__(
        self, link: Link, speed: float, clock: Callable[[], float], stopped: Callable[[], bool]
    ) -> None:
        self.link = link
        self.speed = speed
        self.clock = clock
        self.stopped = stopped
        self.t_s = 0.0
        self.sent = 0

    def describe(self) -> str:
        return f"t {self.t_s:8.1f} s  sent {self.sent}"

    def play(self, frames: Iterator[tuple[float, Packet]], tell: Callable[[], None]) -> None:
        """Sends all of `frames`, or until stopped; `tell` is called often."""
        pace = Pace(self.speed, self.clock)
        for due_s, packet in frames:
            while True:
                wait_s = pace.seconds_until(due_s)
                self.link.read(min(max(wait_s, 0.0), _LONGEST_WAIT_S))
                tell()
                if wait_s <= 0.0 or self.stopped():
                    break
            if self.stopped():
                return
            self.link.write(packet)
            self.t_s = due_s
            self.sent += 1


def _demonstration() -> Vehicle:
    """Without a vehicle file: the simulated vehicle's servo output; without it no rudder could be sent."""
    from bridge.mavlink_map import ServoTerm

    vehicle = default_vehicle()
    return replace(
        vehicle, mavlink=replace(vehicle.mavlink, rudder=(ServoTerm(channel=1, rad_per_us=0.001),))
    )


def _causes(counts: Counter[str]) -> str:
    return "".join(f"; {name} {count}" for name, count in sorted(counts.items()))
