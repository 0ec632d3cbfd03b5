"""S' = F S + G from row to row: what is left to do one row after the other where all else is done at once.

Small matrices, for which a call from Python takes eight times as long as the arithmetic: compiled where the
computer has a C compiler, else by NumPy, which differs by rounding.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from importlib.resources import files

import numpy as np

from host.compiled.machine_code import compiled
from host.recordings.recording import Array

EFFORT = ("-O3",)  # so that the columns are done several at a time


def linear_recursion(F: Array, G: Array, start: Array) -> Array:
    """S (N, nx, columns) from its value at the first row; F (N, nx, nx), G (N, nx, the first columns)."""
    rows, nx, given = G.shape
    S = np.empty((rows, *start.shape))
    S[0] = start
    if (run := _compiled()) is None:
        S[1:, :, :given], S[1:, :, given:] = G[:-1], 0.0
        for slope, now, following in zip(F, S, S[1:], strict=False):
            following += slope.dot(now)
        return S
    F, G = np.ascontiguousarray(F, dtype=float), np.ascontiguousarray(G, dtype=float)
    run(rows, nx, start.shape[1], given, F.ctypes.data, G.ctypes.data, S.ctypes.data)
    return S


@cache
def _compiled() -> Callable[..., None] | None:
    source = files("host.compiled").joinpath("linear_recursion.c").read_text(encoding="utf-8")
    library = compiled(source, ctypes.CDLL, EFFORT)
    if library is None:
        return None
    library.linear_recursion.argtypes = [ctypes.c_long] * 4 + [ctypes.c_void_p] * 3
    library.linear_recursion.restype = None
    run: Callable[..., None] = library.linear_recursion
    return run
