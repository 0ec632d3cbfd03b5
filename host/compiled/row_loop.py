"""A step from one row to the next as one compiled loop.

CasADi goes through a step's instructions one by one, which takes ten times as long as what a compiler makes
of them, and its own loop over compiled steps longer from one row to the next than most of them. It is the
same operations in the same order, so the results have the same bits.
"""

import ctypes
from collections.abc import Callable

import casadi as ca
import numpy as np

from host.compiled.machine_code import compiled
from host.recordings.recording import Array

Loop = Callable[[Array, Array, Array], Array]

# A step may have the name of a function that the process has loaded, which would be called in its place.
PRIVATE = "#define CASADI_SYMBOL_EXPORT static\n"
# By CasADi's calling convention: pointers to each argument and result, and room to work.
LOOP = """
void over_rows(long long int rows, const double* start, const double* driven, const double* parameters,
               double* out) {{
  double carried[2][{carried} + 1], numbers[{numbers} + 1];
  long long int integers[{integers} + 1];
  const double* arguments[{arguments} + 3];
  double* results[{results} + 2];
  for (int i = 0; i < {carried}; ++i) carried[0][i] = start[i];
  for (long long int row = 0; row < rows; ++row) {{
    arguments[0] = carried[row % 2];
    arguments[1] = driven + row * {driven};
    arguments[2] = parameters;
    results[0] = carried[(row + 1) % 2];
    results[1] = out + row * {width};
    {step}(arguments, results, integers, numbers, 0);
  }}
}}
"""


def as_loop(step: ca.Function, is_kept: bool = False) -> Loop | None:
    """A step (carried, per row, parameters) -> (carried on, results), all dense vectors, over N rows.

    (start, per row (N, m), parameters) -> results (N, k), or None where it cannot be compiled; with `is_kept`
    where it was not compiled before.
    """
    generator = ca.CodeGenerator("function")
    generator.add(step)
    width = step.size1_out(1)
    loop = LOOP.format(
        step=step.name(),
        carried=step.size1_in(0),
        driven=step.size1_in(1),
        width=width,
        arguments=step.sz_arg(),
        results=step.sz_res(),
        integers=step.sz_iw(),
        numbers=step.sz_w(),
    )
    library = compiled(PRIVATE + generator.dump() + loop, ctypes.CDLL, is_kept=is_kept)
    if library is None:
        return None
    library.over_rows.argtypes = [ctypes.c_longlong] + [ctypes.c_void_p] * 4
    library.over_rows.restype = None

    def run(start: Array, driven: Array, parameters: Array) -> Array:
        given = [np.ascontiguousarray(each, dtype=float) for each in (start, driven, parameters)]
        out = np.empty((len(driven), width))
        library.over_rows(len(driven), *(each.ctypes.data for each in (*given, out)))
        return out

    return run
