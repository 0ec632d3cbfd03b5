"""Functions of CasADi as machine code, where the computer has a C compiler.

CasADi goes through a function's instructions one by one, which takes ten times as long as what a compiler
makes of them. It is the same operations in the same order, so the results have the same bits: nothing that
is found depends on whether there is a compiler.
"""

import shutil
import subprocess
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import casadi as ca

# Nothing may be reordered, nor a product and a sum be rounded at once.
FLAGS = ("-O1", "-fPIC", "-shared", "-ffp-contract=off")
LONGEST = 60.0  # s, a compiler may take


@cache
def compiler() -> str | None:
    """The computer's C compiler, if any."""
    return next((found for name in ("cc", "gcc", "clang") if (found := shutil.which(name))), None)


def as_machine_code(function: ca.Function) -> ca.Function | None:
    """The same function compiled; None where there is no compiler, or it does not work."""
    if (found := compiler()) is None:
        return None
    with TemporaryDirectory() as folder:
        source, library = Path(folder, "function.c"), Path(folder, "function.so")
        generator = ca.CodeGenerator(source.name)
        generator.add(function)
        generator.generate(f"{folder}/")
        try:
            subprocess.run(
                [found, *FLAGS, "-o", library, source], check=True, capture_output=True, timeout=LONGEST
            )
            return ca.external(function.name(), str(library))  # the file may go once it is loaded
        except (OSError, subprocess.SubprocessError, RuntimeError):
            return None
