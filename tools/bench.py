"""What the bench commands share: the vehicle file, the recordings, progress, and a word about the extra."""

import argparse
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from host.errors import MissingExtra, RecordingError
from host.vehicle import Vehicle, default_vehicle, read_vehicle

if TYPE_CHECKING:
    from host.recordings.recording import Recording

COUNT = re.compile(r",? \d+/\d+\b")  # "2 effects, 3/20: ..."
BENCH_MODULES = ("scipy", "casadi", "matplotlib", "jinja2", "rich")


def require_bench() -> None:
    """Raises MissingExtra when the bench extra is not installed."""
    missing = [name for name in BENCH_MODULES if find_spec(name) is None]
    if missing:
        raise MissingExtra(
            f"this command needs {', '.join(missing)}, which the companion install leaves out: "
            "pip install '.[bench]' in its source folder"
        )


def add_leave_out(parser: argparse.ArgumentParser) -> None:
    """--leave-out: stretches of a recording that are not looked at, read by host.recordings.left_out."""
    parser.add_argument(
        "--leave-out",
        default="",
        metavar="START-END,...",
        help="seconds of the recording that are not looked at, as 60-80,120-140 (turns, say)",
    )


def load_vehicle(path: Path | None) -> Vehicle:
    """The vehicle file, or the defaults where none is given."""
    return default_vehicle() if path is None else read_vehicle(path)


def read_all(
    paths: list[Path],
    vehicle: Vehicle,
    say: Callable[[str], None],
    needs: tuple[str, ...] = ("depth", "pitch", "rudder"),
    on_grid: bool = True,
) -> "list[Recording]":
    """Every stretch of every file. Raises RecordingError when they do not belong together.

    on_grid  as of host.recordings.read
    """
    from host.recordings.read import read_recordings

    read: list[Recording] = []
    for path in paths:
        say(f"reading {path.name}")
        read += read_recordings(path, vehicle, needs, on_grid)
    with_speed = [recording.has_speed for recording in read]
    if any(with_speed) and not all(with_speed):
        lacking = read[with_speed.index(False)].name
        raise RecordingError(
            f"{lacking}: has no usable speed while others have; use --each, or leave the column out"
        )
    return read


def joint_or_each(
    recordings: "list[Recording]", out: Path, each: bool
) -> "Iterator[tuple[list[Recording], Path]]":
    """All recordings for one model in `out`, or one model for each file in a folder of its own below."""
    if not each:
        yield recordings, out
        return
    for name in dict.fromkeys(recording.name for recording in recordings):
        yield [recording for recording in recordings if recording.name == name], out / Path(name).stem


def tell_notes(recordings: "list[Recording]") -> None:
    """What was lost or decided while the files were read, on stderr."""
    from host.recordings.recording import notes_of

    for note in notes_of(recordings):
        print(f"note: {note}", file=sys.stderr)


@contextmanager
def progress(quiet: bool) -> "Iterator[Callable[[str], None]]":
    """A spinner on a terminal, a line per stage (whatever it counts) on a pipe, nothing when quiet."""
    if quiet:
        yield lambda _: None
    elif sys.stderr.isatty():
        from rich.console import Console

        console = Console(stderr=True)
        with console.status("") as status:
            yield status.update
    else:
        said = ""

        def say(text: str) -> None:
            nonlocal said
            stage = COUNT.split(text)[0]
            if stage != said:
                print(stage, file=sys.stderr, flush=True)
            said = stage

        yield say
