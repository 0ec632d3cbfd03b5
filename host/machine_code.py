"""Machine code, where the computer has a C compiler.

CasADi goes through a function's instructions one by one, which takes ten times as long as what a compiler
makes of them. It is the same operations in the same order, so the results have the same bits.
"""

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

import casadi as ca

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


def compiled(source: str, load: Callable[[str], T], *efforts: tuple[str, ...]) -> T | None:
    """What `load` makes of a library compiled from C; None where there is no compiler, or it refuses.

    The library's file may go once it is loaded.

    efforts  options, of which the first that the compiler takes are used
    """
    found = compiler()
    if found is None:
        return None
    made = (_made_by(found, source, load, effort) for effort in efforts or (PLAIN,))
    return next((one for one in made if one is not None), None)


def _made_by(
    compiler: str, source: str, load: Callable[[str], T], effort: tuple[str, ...] = PLAIN
) -> T | None:
    with TemporaryDirectory() as folder:
        text, library = Path(folder, "source.c"), Path(folder, "library.so")
        text.write_text(source, encoding="utf-8")
        command = [compiler, *effort, *FLAGS, "-o", str(library), str(text)]
        try:
            subprocess.run(
                command, check=True, stdin=subprocess.DEVNULL, capture_output=True, timeout=LONGEST
            )
            return load(str(library))
        except (OSError, subprocess.SubprocessError, RuntimeError):
            return None


def as_machine_code(function: ca.Function) -> ca.Function | None:
    """The same function compiled, or None."""
    generator = ca.CodeGenerator("function")
    generator.add(function)
    return compiled(generator.dump(), lambda library: ca.external(function.name(), library))
