"""y = c^T x, x' = F x + g v from row to row: a linear filter with coefficients of each row's own.

Small matrices, for which a call from Python takes many times as long as the arithmetic: compiled where the
computer has a C compiler, else by NumPy, which differs by rounding.
"""

import ctypes
from collections.abc import Callable
from functools import cache

import numpy as np

from host.compiled.all_rows import library_of
from host.recordings.recording import Array

MOST_STATES = 8  # as in linear_filter.c


def linear_filter(F: Array, g: Array, c: Array, values: Array) -> Array:
    """y (columns, N) of values v (columns, N), from x = 0; F (N, nx, nx), g (N, nx), c (nx,).

    ValueError for more than 8 states.
    """
    (rows, nx), columns = g.shape, values.shape[0]
    if nx > MOST_STATES:
        raise ValueError(f"{nx} states, of at most {MOST_STATES}")
    if (run := _compiled()) is None:
        x, seen = np.zeros((nx, columns)), np.empty((columns, rows))
        for k, (slope, driven) in enumerate(zip(F, g, strict=True)):
            seen[:, k] = c @ x
            x = slope @ x + driven[:, None] * values[:, k]
        return seen
    kept = [np.ascontiguousarray(each, dtype=float) for each in (F, g, c, values)]
    seen = np.empty((columns, rows))
    run(rows, nx, columns, *(each.ctypes.data for each in (*kept, seen)))
    return seen


@cache
def _compiled() -> Callable[..., None] | None:
    library = library_of("linear_filter.c")
    if library is None:
        return None
    library.linear_filter.argtypes = [ctypes.c_long] * 3 + [ctypes.c_void_p] * 5
    library.linear_filter.restype = None
    run: Callable[..., None] = library.linear_filter
    return run
