"""Libraries compiled before, kept in the user's cache folder: each is compiled once, not in every process.

The folder is `$MILS_CACHE`, else auv-mils in `$XDG_CACHE_HOME` or ~/.cache; an empty `MILS_CACHE` keeps
nothing. It may be removed at any time.
"""

import os
from functools import cache
from hashlib import sha256
from pathlib import Path
from platform import machine
from tempfile import NamedTemporaryFile

MOST_KEPT, FEWER = 3000, 2000  # libraries, of some 30 kB; beyond the most only those used last stay


def place_of(compiler: str, options: tuple[str, ...], source: str) -> Path | None:
    """Where the library of a C source is kept; None where none are.

    Another compiler, or one that was updated, another processor, other options or another source: another
    place.
    """
    shelf = folder()
    if shelf is None:
        return None
    try:
        state = Path(compiler).stat()
    except OSError:
        return None
    parts = (compiler, f"{state.st_size} {state.st_mtime_ns}", _processor(), *options, source)
    return shelf / f"{sha256(chr(0).join(parts).encode()).hexdigest()}.so"


def keep(library: Path, place: Path) -> None:
    """Puts a library in its place, whole or not at all; what cannot be kept is compiled again."""
    try:
        with NamedTemporaryFile(dir=place.parent, delete=False) as file:
            file.write(library.read_bytes())
        os.replace(file.name, place)
        kept = [*place.parent.glob("*.so")]
        if len(kept) > MOST_KEPT:
            kept.sort(key=lambda one: one.stat().st_mtime)
            for old in kept[:-FEWER]:
                old.unlink(missing_ok=True)
    except OSError:
        return


@cache
def folder() -> Path | None:
    """The folder, made where it is not there; None where it cannot be, or is not the user's alone."""
    told = os.environ.get("MILS_CACHE")
    if told == "":
        return None
    try:
        home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        shelf = Path(told) if told else Path(home) / "auv-mils"
        shelf.mkdir(mode=0o700, parents=True, exist_ok=True)
        # What lies here is loaded and run.
        state = shelf.stat()
        is_own = not hasattr(os, "getuid") or (state.st_uid == os.getuid() and not state.st_mode & 0o022)
        return shelf if is_own else None
    except (OSError, RuntimeError):
        return None


@cache
def _processor() -> str:
    """What code for this very processor depends on; a home may be shared between computers."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    telling = ("flags", "Features", "model name", "CPU part")
    return "\n".join([machine(), *dict.fromkeys(line for line in lines if line.startswith(telling))])
