"""A CasADi function evaluated at all rows at once.

CasADi's own evaluation goes through the function's instructions once for every row; here each instruction
is carried out once, by NumPy, on all rows: several times quicker, where no row needs the one before.
"""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from host.recording import Array

MOST_ROWS = 4096  # at once: the intermediate results of more would not stay in a cache
ALONE = -1  # in place of the second operand of an operation that has one


def _same(value: Array | float) -> Array | float:
    return value


_OPERATIONS: dict[int, Callable[..., Any]] = {
    ca.OP_ADD: np.add,
    ca.OP_SUB: np.subtract,
    ca.OP_MUL: np.multiply,
    ca.OP_DIV: np.divide,
    ca.OP_NEG: np.negative,
    ca.OP_SQ: np.square,
    ca.OP_SQRT: np.sqrt,
    ca.OP_TWICE: lambda x: x + x,
    ca.OP_INV: np.reciprocal,
    ca.OP_EXP: np.exp,
    ca.OP_LOG: np.log,
    ca.OP_POW: np.power,
    ca.OP_CONSTPOW: np.power,
    ca.OP_SIN: np.sin,
    ca.OP_COS: np.cos,
    ca.OP_TAN: np.tan,
    ca.OP_TANH: np.tanh,
    ca.OP_FABS: np.abs,
    ca.OP_SIGN: np.sign,
    ca.OP_FMIN: np.fmin,
    ca.OP_FMAX: np.fmax,
    ca.OP_LT: lambda x, y: 1.0 * (x < y),
    ca.OP_LE: lambda x, y: 1.0 * (x <= y),
    ca.OP_EQ: lambda x, y: 1.0 * (x == y),
    ca.OP_NE: lambda x, y: 1.0 * (x != y),
    ca.OP_NOT: lambda x: 1.0 * (x == 0.0),
    ca.OP_AND: lambda x, y: 1.0 * ((x != 0.0) & (y != 0.0)),
    ca.OP_OR: lambda x, y: 1.0 * ((x != 0.0) | (y != 0.0)),
    ca.OP_IF_ELSE_ZERO: lambda x, y: np.where(x, y, 0.0),
    ca.OP_ASSIGN: _same,
}


class AllRows:
    """An SX function of vectors, each (k, N) with a column a row or (k,) the same at all N rows.

    NotImplementedError for an operation of CasADi that is not in the table above.
    """

    def __init__(self, function: ca.Function) -> None:
        self._work: list[Array | float] = [0.0] * function.sz_w()
        self._program: list[tuple[Callable[..., Any], int, int, int]] = []
        self._given: list[tuple[int, int, int]] = []  # argument, component, place
        self._results: list[tuple[int, int, int, int]] = []  # result, row, column, place
        shapes = [function.sparsity_out(k) for k in range(function.n_out())]
        self._shapes = [sparsity.shape for sparsity in shapes]
        entries = [list(zip(*sparsity.get_triplet(), strict=True)) for sparsity in shapes]
        # CasADi uses a place again once it is free; what is given or constant gets one for good.
        now_at = list(range(len(self._work)))
        for step in range(function.n_instructions()):
            code, taken = function.instruction_id(step), function.instruction_output(step)
            given = function.instruction_input(step)
            if code == ca.OP_INPUT:
                now_at[taken[0]] = self._new_place()
                self._given.append((given[0], given[1], now_at[taken[0]]))
            elif code == ca.OP_CONST:
                now_at[taken[0]] = self._new_place()
                self._work[now_at[taken[0]]] = function.instruction_constant(step)
            elif code == ca.OP_OUTPUT:
                result, entry = taken
                place = self._new_place()
                self._results.append((result, *entries[result][entry], place))
                self._program.append((_same, now_at[given[0]], ALONE, place))
            elif code in _OPERATIONS:
                one, other = [*(now_at[place] for place in given), ALONE][:2]
                now_at[taken[0]] = taken[0]
                self._program.append((_OPERATIONS[code], one, other, taken[0]))
            else:
                raise NotImplementedError(f"CasADi's operation {code} over all rows")

    def __call__(self, *arguments: Array) -> list[Array]:
        """The results, each (N, rows, columns)."""
        count = max(argument.shape[1] for argument in arguments if argument.ndim == 2)
        results = [np.zeros((count, *shape)) for shape in self._shapes]
        for first in range(0, count, MOST_ROWS):
            here = slice(first, first + MOST_ROWS)
            work = self._work.copy()
            for argument, component, place in self._given:
                value = arguments[argument][component]
                work[place] = value[here] if value.ndim else float(value)
            with np.errstate(all="ignore"):  # a run that leaves the numbers is seen by its size
                for operation, one, other, place in self._program:
                    work[place] = (
                        operation(work[one]) if other == ALONE else operation(work[one], work[other])
                    )
            for result, row, column, place in self._results:
                results[result][here, row, column] = work[place]
        return results

    def _new_place(self) -> int:
        self._work.append(0.0)
        return len(self._work) - 1
