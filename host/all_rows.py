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
    ca.OP_ASSIGN: lambda x: x,
}


class AllRows:
    """An SX function of vectors, each (k, N) with a column a row or (k,) the same at all N rows.

    NotImplementedError for an operation of CasADi that no equation here has used so far.
    """

    def __init__(self, function: ca.Function) -> None:
        steps = range(function.n_instructions())
        codes = [function.instruction_id(step) for step in steps]
        if unknown := set(codes) - {*_OPERATIONS, ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT}:
            raise NotImplementedError(f"CasADi operations {sorted(unknown)} over all rows")
        self._program = [
            (
                code,
                _OPERATIONS.get(code),
                function.instruction_constant(step) if code == ca.OP_CONST else 0.0,
                tuple(function.instruction_input(step)),
                tuple(function.instruction_output(step)),
            )
            for step, code in zip(steps, codes, strict=True)
        ]
        results = [function.sparsity_out(k) for k in range(function.n_out())]
        self._shapes = [result.shape for result in results]
        self._places = [list(zip(*result.get_triplet(), strict=True)) for result in results]

    def __call__(self, *arguments: Array) -> list[Array]:
        """The results, each (N, rows, columns)."""
        count = max(argument.shape[1] for argument in arguments if argument.ndim == 2)
        results = [np.zeros((count, *shape)) for shape in self._shapes]
        for first in range(0, count, MOST_ROWS):
            here = slice(first, first + MOST_ROWS)
            given = [list(a[:, here] if a.ndim == 2 else a) for a in arguments]
            with np.errstate(all="ignore"):  # a run that leaves the numbers is seen by its size
                self._evaluate(given, [result[here] for result in results])
        return results

    def _evaluate(self, arguments: list[list[Array]], results: list[Array]) -> None:
        work: dict[int, Array | float] = {}
        for code, operation, constant, given, taken in self._program:
            if operation is not None:
                work[taken[0]] = operation(*[work[place] for place in given])
            elif code == ca.OP_INPUT:
                work[taken[0]] = arguments[given[0]][given[1]]
            elif code == ca.OP_CONST:
                work[taken[0]] = constant
            else:
                row, column = self._places[taken[0]][taken[1]]
                results[taken[0]][:, row, column] = work[given[0]]
