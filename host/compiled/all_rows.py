"""A CasADi function evaluated at all rows at once.

CasADi's own evaluation goes through the function's instructions once for every row; here each instruction
is carried out on many rows, where no row needs the one before: compiled where the computer has a C compiler,
else by NumPy, which takes several times longer and differs by rounding.
"""

import ctypes
from collections.abc import Callable
from copy import copy
from functools import cache
from importlib.resources import files
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from host.compiled.machine_code import compiled
from host.recordings.recording import Array

MOST_ROWS = 4096  # at once by NumPy: the intermediate results of more would not stay in a cache
BLOCK = 64  # rows at once where it is compiled, as in all_rows.c
# As wide as this computer can, if the compiler knows how.
EFFORTS = (("-O3", "-fopenmp-simd", "-march=native"), ("-O3", "-fopenmp-simd"), ("-O3",))

_OPERATIONS: tuple[tuple[tuple[int, ...], Callable[..., Any]], ...] = (
    ((ca.OP_ASSIGN, ca.OP_OUTPUT), lambda x, _: x),
    ((ca.OP_ADD,), np.add),
    ((ca.OP_SUB,), np.subtract),
    ((ca.OP_MUL,), np.multiply),
    ((ca.OP_DIV,), np.divide),
    ((ca.OP_NEG,), lambda x, _: np.negative(x)),
    ((ca.OP_SQ,), lambda x, _: np.square(x)),
    ((ca.OP_SQRT,), lambda x, _: np.sqrt(x)),
    ((ca.OP_TWICE,), lambda x, _: x + x),
    ((ca.OP_INV,), lambda x, _: np.reciprocal(x)),
    ((ca.OP_EXP,), lambda x, _: np.exp(x)),
    ((ca.OP_LOG,), lambda x, _: np.log(x)),
    ((ca.OP_POW, ca.OP_CONSTPOW), np.power),
    ((ca.OP_SIN,), lambda x, _: np.sin(x)),
    ((ca.OP_COS,), lambda x, _: np.cos(x)),
    ((ca.OP_TAN,), lambda x, _: np.tan(x)),
    ((ca.OP_TANH,), lambda x, _: np.tanh(x)),
    ((ca.OP_FABS,), lambda x, _: np.abs(x)),
    ((ca.OP_SIGN,), lambda x, _: np.sign(x)),
    ((ca.OP_FMIN,), np.fmin),
    ((ca.OP_FMAX,), np.fmax),
    ((ca.OP_LT,), lambda x, y: 1.0 * (x < y)),
    ((ca.OP_LE,), lambda x, y: 1.0 * (x <= y)),
    ((ca.OP_EQ,), lambda x, y: 1.0 * (x == y)),
    ((ca.OP_NE,), lambda x, y: 1.0 * (x != y)),
    ((ca.OP_NOT,), lambda x, _: 1.0 * (x == 0.0)),
    ((ca.OP_AND,), lambda x, y: 1.0 * ((x != 0.0) & (y != 0.0))),
    ((ca.OP_OR,), lambda x, y: 1.0 * ((x != 0.0) | (y != 0.0))),
    ((ca.OP_IF_ELSE_ZERO,), lambda x, y: np.where(x, y, 0.0)),
)
"""CasADi's codes and the operation, in the order of all_rows.c."""
_NUMBERS = {code: number for number, (codes, _) in enumerate(_OPERATIONS) for code in codes}


class AllRows:
    """An SX function of vectors, each (k, N) with a column a row or (k,) the same at all N rows.

    NotImplementedError for an operation of CasADi that is not in the table above.
    """

    def __init__(self, function: ca.Function) -> None:
        places = function.sz_w()
        self._shapes = [function.sparsity_out(k).shape for k in range(function.n_out())]
        entries = [
            list(zip(*function.sparsity_out(k).get_triplet(), strict=True)) for k in range(function.n_out())
        ]
        self._constants: dict[int, float] = {}
        inputs: list[tuple[int, int, int]] = []  # argument, component, place
        outputs: list[tuple[int, int, int, int]] = []  # result, row, column, place
        program: list[tuple[int, int, int, int]] = []
        # CasADi uses a place again once it is free; what is given, constant or a result gets one for good.
        now_at = list(range(places))
        for step in range(function.n_instructions()):
            code, taken = function.instruction_id(step), function.instruction_output(step)
            if code == ca.OP_CONST:
                now_at[taken[0]] = places
                self._constants[places] = function.instruction_constant(step)
                places += 1
                continue
            given = function.instruction_input(step)
            if code == ca.OP_INPUT:
                now_at[taken[0]] = places
                inputs.append((given[0], given[1], places))
                places += 1
            elif code == ca.OP_OUTPUT:
                outputs.append((taken[0], *entries[taken[0]][taken[1]], places))
                program.append((_NUMBERS[code], now_at[given[0]], now_at[given[0]], places))
                places += 1
            elif code in _NUMBERS:
                one, other = now_at[given[0]], now_at[given[-1]]
                now_at[taken[0]] = taken[0]
                program.append((_NUMBERS[code], one, other, taken[0]))
            else:
                raise NotImplementedError(f"CasADi's operation {code} over all rows")
        self._places = places
        self._program = np.array(program, dtype=np.intp).reshape(-1, 4)
        self._given = np.array(inputs, dtype=np.intp).reshape(-1, 3)
        self._results = np.array(outputs, dtype=np.intp).reshape(-1, 4)

    def with_columns(self, result: int, columns: tuple[int, ...]) -> "AllRows":
        """The same with these columns alone of one result; what nothing else needs is left undone."""
        rows, count = self._shapes[result]
        if columns == tuple(range(count)):
            return self
        other = copy(self)
        other._shapes = [*self._shapes]
        other._shapes[result] = rows, len(columns)
        now_at = {column: place for place, column in enumerate(columns)}
        kept = [
            (which, row, now_at[column] if which == result else column, place)
            for which, row, column, place in self._results.tolist()
            if which != result or column in now_at
        ]
        needed = {place for *_, place in kept}
        program: list[list[int]] = []
        for step in reversed(self._program.tolist()):
            _, one, another, place = step
            if place in needed:
                program.append(step)
                needed.discard(place)
                needed |= {one, another}
        other._program = np.array(program[::-1], dtype=np.intp).reshape(-1, 4)
        other._results = np.array(kept, dtype=np.intp).reshape(-1, 4)
        return other

    def __call__(self, *arguments: Array) -> list[Array]:
        """The results, each (N, rows, columns)."""
        count = max(argument.shape[1] for argument in arguments if argument.ndim == 2)
        results = [np.zeros((count, *shape)) for shape in self._shapes]
        if (run := _compiled()) is not None:
            self._by_machine(run, count, arguments, results)
        else:
            self._by_numpy(count, arguments, results)
        return results

    def _by_machine(
        self, run: Callable[..., None], count: int, arguments: tuple[Array, ...], results: list[Array]
    ) -> None:
        # At the start of a cache line: where every access crosses two, it takes three times as long.
        room = np.empty(self._places * BLOCK + 8)
        work = room[-(room.ctypes.data // 8) % 8 :][: self._places * BLOCK].reshape((-1, BLOCK))
        for place, value in self._constants.items():
            work[place] = value
        values = [np.ascontiguousarray(argument, dtype=float) for argument in arguments]
        argument, component, given = self._given.T
        result, row, column, told = self._results.T
        # Numbers from one component to the next, and from one row of the recording to the next.
        across = np.array([value.shape[-1] if value.ndim == 2 else 1 for value in values])[argument]
        along = np.array([value.ndim - 1 for value in values])[argument]
        wide, size = np.array([(columns, rows * columns) for rows, columns in self._shapes])[result].T
        run(
            count,
            len(self._program),
            self._program.ctypes.data,
            work.ctypes.data,
            *_columns(given, _addresses(values)[argument] + 8 * component * across, along),
            *_columns(told, _addresses(results)[result] + 8 * (row * wide + column), size),
        )

    def _by_numpy(self, count: int, arguments: tuple[Array, ...], results: list[Array]) -> None:
        program: list[list[int]] = self._program.tolist()
        for first in range(0, count, MOST_ROWS):
            here = slice(first, first + MOST_ROWS)
            work: list[Array | float] = [0.0] * self._places
            for place, constant in self._constants.items():
                work[place] = constant
            for argument, component, place in self._given.tolist():
                value = arguments[argument][component]
                work[place] = value[here] if value.ndim else float(value)
            with np.errstate(all="ignore"):  # a run that leaves the numbers is seen by its size
                for number, one, other, place in program:
                    work[place] = _OPERATIONS[number][1](work[one], work[other])
            for result, row, column, place in self._results.tolist():
                results[result][here, row, column] = work[place]


def _addresses(arrays: list[Array]) -> NDArray[np.intp]:
    return np.array([array.ctypes.data for array in arrays], dtype=np.intp)


def _columns(*parts: NDArray[np.intp]) -> tuple[int, NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """How many columns, their places, their addresses, and how many numbers apart their rows are."""
    places, addresses, apart = (np.ascontiguousarray(part, dtype=np.intp) for part in parts)
    return places.size, places, addresses, apart


@cache
def _compiled() -> Callable[..., None] | None:
    source = files("host.compiled").joinpath("all_rows.c").read_text(encoding="utf-8")
    library = compiled(source, ctypes.CDLL, *EFFORTS)
    if library is None:
        return None
    size, pointer, numbers = ctypes.c_ssize_t, ctypes.c_void_p, np.ctypeslib.ndpointer(np.intp)
    columns: list[Any] = [size, numbers, numbers, numbers]
    library.all_rows.argtypes = [size, size, pointer, pointer, *columns, *columns]
    library.all_rows.restype = None
    run: Callable[..., None] = library.all_rows
    return run
