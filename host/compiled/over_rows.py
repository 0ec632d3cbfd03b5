"""A function of CasADi carried over the rows of a recording: each row begins where the one before ended."""

from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import Any, TypeVar

import casadi as ca
import numpy as np

from host.compiled.row_loop import as_loop
from host.recordings.recording import Array

ROWS_AT_ONCE = 256
KEPT = 64  # functions of each kind: a search meets hundreds of sets, and those of all would fill the memory
# Instructions and rows after which a function is compiled: it has run for about as long as that takes. One
# that was compiled before is at once.
FEW_ROWS, FEW_INSTRUCTIONS = 3e4, 1.3e7

F = TypeVar("F")
OverRows = Callable[[Array, Array, Array], Array]


def over_rows(step: Callable[[F], ca.Function], form: F, rows: int) -> OverRows:
    """One step's function carried over N rows: (start, per row (m, N), parameters) -> results (k, N).

    `step` gives, for a form, (carried, per row, parameters) -> (carried on, results).
    """
    carried_on = _carried_on(step, form, min(ROWS_AT_ONCE, 1 << (rows - 1).bit_length()))

    def run(start: Array, per_row: Array, parameters: Array) -> Array:
        return carried_on(start, per_row.T, parameters).T

    return run


class _CarriedOn:
    """A step carried over rows by CasADi, or compiled: once that pays, or at once where it was before.

    By CasADi over few rows at once: it takes longer to build it over many than to run it.
    """

    def __init__(self, step: ca.Function, at_once: int) -> None:
        self._step, self._at_once = step, at_once
        self._loop = as_loop(step, is_kept=True)
        self._left = FEW_ROWS + FEW_INSTRUCTIONS / step.n_instructions()

    def __call__(self, start: Array, driven: Array, parameters: Array) -> Array:
        is_due = self._loop is None and 0.0 < self._left <= len(driven)
        self._left -= len(driven)
        if is_due:
            self._loop = as_loop(self._step)
        return (self._loop or self._by_casadi)(start, driven, parameters)

    def _by_casadi(self, start: Array, driven: Array, parameters: Array) -> Array:
        # CasADi reads and writes these arrays in place, column by column; its own matrices would be
        # copied number by number, which takes as long as the propagation.
        function, rows, at_once = self._chunk, len(driven), self._at_once
        chunks = -(-rows // at_once)
        padded = np.zeros((chunks * at_once, driven.shape[1]))
        padded[:rows] = driven
        repeated = np.tile(parameters, (at_once, 1))
        carried = np.empty((at_once, function.size1_out(0)))
        out = np.empty((chunks * at_once, function.size1_out(1)))
        buffer: Any
        buffer, evaluate = function.buffer()  # typed in C terms: pointer and size
        buffer.set_arg(2, repeated.data)
        buffer.set_res(0, carried.data)
        for first in range(0, chunks * at_once, at_once):
            begin = np.array(carried[-1]) if first else start
            buffer.set_arg(0, begin.data)
            buffer.set_arg(1, padded[first : first + at_once].data)
            buffer.set_res(1, out[first : first + at_once].data)
            evaluate()
        return out[:rows]

    @cached_property
    def _chunk(self) -> ca.Function:
        return self._step.mapaccum(f"rows_{self._at_once}", self._at_once)


@lru_cache(KEPT)
def _carried_on(step: Callable[[F], ca.Function], form: F, at_once: int) -> _CarriedOn:
    """With results made dense, as the arrays that it writes into are: what is always zero has a place."""
    one = step(form)
    inputs = one.sx_in()
    dense = ca.Function(one.name(), inputs, [ca.densify(result) for result in one.call(inputs)])
    return _CarriedOn(dense, at_once)
