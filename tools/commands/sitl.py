"""`mils sitl`: a simulated AUV that speaks MAVLink or CAN, or fills a recording."""

import argparse
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from itertools import count
from math import degrees, isfinite, nan
from pathlib import Path

import bridge
from bridge.errors import LinkError
from host.errors import ConfigError
from tools.sitl.errors import ScenarioError, TransportError
from tools.sitl.plant import Instant
from tools.sitl.recording import (
    COLUMNS,
    TRUTH_COLUMNS,
    TextTable,
    describe,
    measure,
    sail,
    write_csv,
    write_truth,
)
from tools.sitl.scenario import SCENARIOS, Scenario, load
from tools.sitl.schedule import Pace
from tools.sitl.track import Track
from tools.sitl.voyage import Vehicle, sail_live
from tools.status_line import StatusLine
from tools.stop_signals import stop_signals

HELP = "a simulated AUV that speaks MAVLink or CAN"
DEFAULT_DBC = Path(bridge.__file__).parent / "default.dbc"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    shipped = ", ".join(sorted(file.stem for file in SCENARIOS.glob("*.toml")))
    parser.add_argument("--scenario", default="default", help=f"TOML file, or a shipped one: {shipped}")
    parser.add_argument(
        "--link",
        default="udpout:127.0.0.1:14550",
        help="udpout:HOST:PORT, udp:HOST:PORT, tcp:HOST:PORT, tcpin:HOST:PORT, serial:DEVICE:BAUD,"
        " can:INTERFACE:CHANNEL, or none (default: %(default)s)",
    )
    parser.add_argument("--speed", type=float, default=1.0, help="simulated seconds a second (default: 1)")
    parser.add_argument("--duration", type=float, help="simulated seconds; 0 runs until stopped")
    parser.add_argument("--seed", type=int, help="seed of noise, sea and excitation")
    parser.add_argument(
        "--truth", type=Path, metavar="CSV", help="write the noise-free motion and the effects"
    )
    parser.add_argument("--record", type=Path, metavar="CSV", help="write the measured channels")
    parser.add_argument("--quiet", action="store_true", help="say nothing")


def run(args: argparse.Namespace) -> int:
    """Simulates; 0 when the run is over or was stopped. Raises ConfigError, LinkError."""
    if not (isfinite(args.speed) and args.speed > 0.0):
        raise ConfigError(f"--speed must be a number > 0 (got {args.speed})")
    if args.duration is not None and not (isfinite(args.duration) and args.duration >= 0.0):
        raise ConfigError(f"--duration must be a number >= 0 s (got {args.duration})")
    if args.seed is not None and args.seed < 0:
        raise ConfigError(f"--seed must be >= 0 (got {args.seed})")
    try:
        scenario = load(args.scenario)
        seed = scenario.seed if args.seed is None else args.seed
        if args.duration is not None:
            scenario = replace(scenario, duration_s=args.duration)
        if args.link == "none":
            return _fill(scenario, seed, args)
        return _speak(scenario, seed, args)
    except ScenarioError as error:
        raise ConfigError(str(error)) from error
    except TransportError as error:
        raise LinkError(str(error)) from error


def _fill(scenario: Scenario, seed: int, args: argparse.Namespace) -> int:
    """A recording and its truth, as fast as it goes."""
    if args.record is None and args.truth is None:
        raise ConfigError("--link none must come with --record or --truth (got neither)")
    truth = sail(scenario, seed)
    if args.record is not None:
        write_csv(args.record, measure(scenario, seed, truth))
    if args.truth is not None:
        write_truth(args.truth, scenario, truth)
    if not args.quiet:
        written = ", ".join(str(path) for path in (args.record, args.truth) if path is not None)
        print(f"{scenario.name}: {scenario.duration_s:g} s simulated with seed {seed}, written to {written}")
    return 0


def _speak(scenario: Scenario, seed: int, args: argparse.Namespace) -> int:
    """Runs on a link until the time is over or somebody stops it."""
    with ExitStack() as stack, stop_signals() as stop:
        truth = _truth_writer(scenario, args.truth, stack)
        track = Track(scenario, seed, truth)
        note = _note_writer(args.record, stack)
        vehicle: Vehicle
        # What a link needs is loaded with it, so that `mils doctor` starts where pymavlink is missing.
        if args.link.startswith("can:"):
            from tools.sitl.can_vehicle import CanVehicle, open_bus

            bus = open_bus(args.link)
            stack.callback(bus.shutdown)
            dbc = Path(scenario.folder) / scenario.can.dbc if scenario.can.dbc else DEFAULT_DBC
            vehicle = CanVehicle(scenario, seed, track, bus, dbc, note)
        else:
            from tools.sitl.mavlink_vehicle import MavlinkVehicle
            from tools.sitl.transport import open_transport

            transport = open_transport(args.link)
            stack.callback(transport.close)
            vehicle = MavlinkVehicle(scenario, seed, track, transport, note)
        status = StatusLine(lambda: _describe(track.now, vehicle), args.quiet)
        status.begin(f"{scenario.name}: {args.link}, speed {args.speed:g}, seed {seed}. Ctrl-C stops.")
        sail_live(
            track, vehicle, Pace(args.speed, time.monotonic), scenario.duration_s, stop.is_set, status.tell
        )
        status.finish()
    return 0


def _describe(now: Instant, vehicle: Vehicle) -> str:
    return (
        f"t {now.t_s:7.1f} s  depth {now.depth:6.2f} m  pitch {degrees(now.pitch):+6.1f} deg"
        f"  rudder {degrees(now.command):+6.1f} deg"
        f"  sent {vehicle.sent.total()}  heard {vehicle.heard.total()}"
    )


def _truth_writer(scenario: Scenario, path: Path | None, stack: ExitStack) -> Callable[[Instant], None]:
    if path is None:
        return lambda _: None
    table = stack.enter_context(TextTable(path, [*TRUTH_COLUMNS.values(), "effects"]))
    every = round(scenario.excitation.update_s / scenario.step_s)
    steps = count()

    def write(now: Instant) -> None:
        if next(steps) % every == 0:
            table.write(now, describe(scenario.effects, now.t_s))

    return write


def _note_writer(path: Path | None, stack: ExitStack) -> Callable[[float, str, float], None]:
    """Joins what was sent with one time stamp into one row."""
    if path is None:
        return lambda *_: None
    table = stack.enter_context(TextTable(path, ["time_s", *COLUMNS.values()]))
    row: dict[str, float] = {}

    def flush() -> None:
        if row:
            table.write([row["t_s"], *(row.get(channel, nan) for channel in COLUMNS)])
            row.clear()

    def note(t_s: float, channel: str, value: float) -> None:
        if row and abs(t_s - row["t_s"]) > 1e-6:
            flush()
        row.setdefault("t_s", t_s)
        row[channel] = value

    stack.callback(flush)
    return note
