"""`mils run`: identify a vehicle while it moves."""

import argparse
import math
import shutil
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import FrameType

from bridge.measurement import Quantity
from bridge.source import Source
from firmware_model.estimate import Estimate
from host.errors import ConfigError
from host.live.journal import Journal
from host.live.loop import LiveLoop, Progress
from host.vehicle import Vehicle, effective_table, read_vehicle

UNITS = {"a1": "1/s", "a2": "1/s", "a3": "1/s^2", "b1": "m/s^2", "b2": "1/s^2", "u0": "m/s", "c_wq": "m/s"}
WHAT_TO_CHECK = {
    Quantity.DEPTH: "[mavlink] depth_source, or the depth or pressure signal in [can]",
    Quantity.PITCH: "that the vehicle sends ATTITUDE, or the pitch signal in [can]",
    Quantity.RUDDER: "[mavlink] rudder (output channels of the stern plane), or the rudder signal in [can]",
}
_PIPE_PERIOD = 10.0  # s, between two lines where nobody watches


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("vehicle", metavar="VEHICLE.toml", type=Path, help="vehicle file")
    parser.add_argument("--link", metavar="URL", help="instead of link.url, e.g. udp:127.0.0.1:14550")
    parser.add_argument("--duration", metavar="S", type=float, help="stop after so many seconds")
    parser.add_argument("--speed", metavar="N", type=float, help="log: links at N times real time, or inf")
    parser.add_argument("--journal", metavar="PATH", type=Path, help="file ending in .jsonl, or folder")
    parser.add_argument("--no-state", action="store_true", help="neither restore nor save what was learnt")
    parser.add_argument("--quiet", action="store_true", help="no progress")


def run(args: argparse.Namespace) -> int:
    """0 done; 1 a needed quantity never came, or the link was lost for good. Raises LinkError, HostError."""
    if args.duration is not None and not args.duration > 0:
        raise ConfigError(f"--duration must be above 0 s (got {args.duration:g})")
    # Loaded here, so that `mils doctor` starts where pymavlink is missing.
    from bridge.open import open_source

    vehicle = _configured(read_vehicle(args.vehicle), args)

    def opened() -> Source:
        return open_source(vehicle.link.url, vehicle.mavlink, vehicle.can, log_speed=vehicle.link.log_speed)

    source = opened()
    try:
        display = _Display(args.quiet)
        journal = Journal(
            args.journal or vehicle.journal.folder,
            vehicle=vehicle.name,
            configuration=effective_table(vehicle),
            wall_s=time.time,
            warn=display.say,
        )
        loop = LiveLoop(
            source,
            vehicle,
            journal,
            reopen=opened,
            clock=time.monotonic,
            sleep=time.sleep,
            say=display.say,
            on_progress=display.show,
        )
    except BaseException:
        source.close()
        raise
    with _stopped_by_signals(loop):
        end = loop.run(args.duration)
    display.finish()
    print(_summary(end))
    print(f"journal: {journal.path}")
    if end.never_heard:
        print(f"mils: {_complaint(end, vehicle.link.url)}", file=sys.stderr)
    return 1 if end.never_heard or loop.has_lost_link else 0


def _configured(vehicle: Vehicle, args: argparse.Namespace) -> Vehicle:
    """The vehicle with what the command line says otherwise."""
    try:
        link = vehicle.link
        if args.link is not None:
            link = replace(link, url=args.link)
        if args.speed is not None:
            link = replace(link, log_speed=args.speed)
    except ValueError as error:
        raise ConfigError(f"command line: link.{error}") from error
    state = replace(vehicle.state, enabled=vehicle.state.enabled and not args.no_state)
    return replace(vehicle, link=link, state=state)


@contextmanager
def _stopped_by_signals(loop: LiveLoop) -> Iterator[None]:
    """SIGINT, SIGTERM and SIGHUP stop the loop cleanly; a second one ends the program at once."""
    names = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
    before = {name: signal.getsignal(name) for name in names}

    def stop(number: int, frame: FrameType | None) -> None:  # noqa: ARG001
        loop.stop(f"stopped by {signal.Signals(number).name}")
        for name in names:
            signal.signal(name, before[name])

    for name in names:
        signal.signal(name, stop)
    try:
        yield
    finally:
        for name in names:
            signal.signal(name, before[name])


class _Display:
    """Progress on stderr: one line rewritten on a terminal, one line every 10 s elsewhere."""

    def __init__(self, is_quiet: bool) -> None:
        self._is_quiet = is_quiet
        self._is_terminal = sys.stderr.isatty()
        self._shown_at = -math.inf

    def show(self, progress: Progress) -> None:
        if self._is_quiet:
            return
        if self._is_terminal:
            width = shutil.get_terminal_size().columns - 1
            self._write(f"\r\x1b[K{_status_line(progress)[:width]}")
        elif progress.seconds - self._shown_at >= _PIPE_PERIOD:
            self._shown_at = progress.seconds
            self._write(f"{_status_line(progress)}\n")

    def say(self, sentence: str) -> None:
        self._write(f"\r\x1b[K{sentence}\n" if self._is_terminal else f"{sentence}\n")

    def finish(self) -> None:
        if self._is_terminal and not self._is_quiet:
            self._write("\n")

    def _write(self, text: str) -> None:
        try:
            sys.stderr.write(text)
            sys.stderr.flush()
        except OSError:
            self._is_quiet = True  # nobody reads any more; the journal has it all


def _status_line(progress: Progress) -> str:
    estimate = progress.estimate
    values = "  ".join(_estimated(estimate, name) for name in estimate.values)
    taken = f"{progress.samples.total():6d} samples, {progress.refused.total()} refused"
    mismatch = progress.mismatch
    alarm = f"MISMATCH {mismatch.slot} x{mismatch.ratio:.1f}  " if mismatch is not None else ""
    return f"{progress.seconds:6.0f} s  {alarm}{taken}  {estimate.status.name:11s}  {values}"


def _estimated(estimate: Estimate, name: str) -> str:
    """A value with its deviation; in brackets while it may not be relied on."""
    value, std = estimate.values[name], estimate.std[name]
    if not math.isfinite(value):
        return f"{name} ?"
    text = f"{value:.3f}+-{std:.3f}" if std else f"{value:.3f}"
    return f"{name} {text}" if estimate.valid[name] else f"{name} ({text})"


def _summary(end: Progress) -> str:
    received = ", ".join(f"{quantity} {end.measurements[quantity]}" for quantity in Quantity)
    samples = ", ".join(f"{name} {count}" for name, count in end.samples.most_common())
    refused = ", ".join(f"{cause} {count}" for cause, count in end.refused.most_common())
    lines = [
        f"{end.seconds:.1f} s, {end.cause}",
        f"received: {received}",
        f"samples: {samples or 'none'}",
        f"refused: {refused or 'none'}",
    ]
    if end.alarms:
        alarms = f"{end.alarms} alarm{'s' * (end.alarms > 1)}"
        lines.append(f"mismatch: {alarms}; `mils diagnose` of the journal says what changed")
    if end.lost_lines:
        lines.append(f"not recorded: {end.lost_lines} lines could not be written")
    for name in end.estimate.values:
        unit = UNITS[name] + ("" if end.estimate.valid[name] else "  (not reliable)")
        lines.append(f"  {_estimated(end.estimate, name)} {unit}")
    return "\n".join(lines)


def _complaint(end: Progress, url: str) -> str:
    if not end.measurements.total():
        return f"nothing usable came on {url}; check that the vehicle sends there, and `mils doctor`"
    checks = "; ".join(f"no {quantity} came, check {WHAT_TO_CHECK[quantity]}" for quantity in end.never_heard)
    return f"nothing can be identified: {checks}"
