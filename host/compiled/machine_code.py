"""Machine code, where the computer has a C compiler."""

import ctypes
import os
import shutil
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

from host.compiled.library_shelf import keep, place_of

# No product and sum may be rounded at once, as some compilers do by themselves.
FLAGS = ("-fPIC", "-shared", "-ffp-contract=off")
PLAIN = ("-O1",)  # more takes longer than it saves
LONGEST = 60.0  # s, a compiler may take

T = TypeVar("T")


@cache
def compiler() -> str | None:
    """The computer's C compiler, if it has one that works and what it makes may be loaded."""
    found = filter(None, map(shutil.which, ("cc", "gcc", "clang")))
    return next((one for one in found if _made_by(one, "int works = 1;", ctypes.CDLL)), None)


def compiled(
    source: str, load: Callable[[str], T], *efforts: tuple[str, ...], is_kept: bool = False
) -> T | None:
    """What `load` makes of a library compiled from C; None where there is no compiler, or it refuses.

    The library's file may go once it is loaded.

    efforts  options, of which the first that the compiler takes are used
    is_kept  or None where it was not compiled before
    """
    found = compiler()
    if found is None:
        return None
    for effort in efforts or (PLAIN,):
        place = place_of(found, (*effort, *FLAGS), source)
        if place is not None and (kept := _loaded(place, load)) is not None:
            return kept
        if not is_kept and (made := _made_by(found, source, load, effort, place)) is not None:
            return made
    return None


def _loaded(place: Path, load: Callable[[str], T]) -> T | None:
    """A library that is kept, which is used again by that; one that does not load goes."""
    try:
        os.utime(place)
    except OSError:
        return None
    try:
        return load(str(place))
    except (OSError, RuntimeError):
        place.unlink(missing_ok=True)
        return None


def _made_by(
    compiler: str,
    source: str,
    load: Callable[[str], T],
    effort: tuple[str, ...] = PLAIN,
    place: Path | None = None,
) -> T | None:
    with TemporaryDirectory() as folder:
        text, library = Path(folder, "source.c"), Path(folder, "library.so")
        text.write_text(source, encoding="utf-8")
        command = [compiler, *effort, *FLAGS, "-o", str(library), str(text)]
        try:
            subprocess.run(
                command, check=True, stdin=subprocess.DEVNULL, capture_output=True, timeout=LONGEST
            )
            made = load(str(library))
        except (OSError, subprocess.SubprocessError, RuntimeError):
            return None
        if place is not None:
            keep(library, place)
        return made
