"""A CasADi function evaluated at all rows at once.

CasADi's own evaluation goes through the function's instructions once for every row; here each instruction
is carried out on many rows, where no row needs the one before: compiled where the computer has a C compiler,
else by NumPy, which takes several times longer and differs by rounding.
"""

import ctypes
import itertools
import threading
from collections.abc import Callable
from copy import copy
from functools import cache
from importlib.resources import files
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from host.compiled.machine_code import compiled
from host.compiled.program import PRODUCT_PLUS, Program, laid_out
from host.recordings.recording import Array

MOST_ROWS = 4096  # at once by NumPy: the intermediate results of more would not stay in a cache
BLOCK = 64  # rows at once where it is compiled, as in all_rows.c
# As wide as this computer can, if the compiler knows how.
EFFORTS = (("-O3", "-fopenmp-simd", "-march=native"), ("-O3", "-fopenmp-simd"), ("-O3",))

_OPERATIONS: tuple[tuple[tuple[int, ...], Callable[..., Any]], ...] = (
    ((ca.OP_ASSIGN,), lambda x, _: x),
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
    ((), lambda x, y, z: x * y + z),
    ((), lambda x, y, z: x * y - z),
    ((), lambda x, y, z: z - x * y),
)
"""CasADi's codes and the operation, in the order of all_rows.c."""
_NUMBERS = {code: number for number, (codes, _) in enumerate(_OPERATIONS) for code in codes}


class AllRows:
    """An SX function of vectors, each (k, N) with a column a row or (k,) the same at all N rows.

    NotImplementedError for an operation of CasADi that is not in the table above.
    """

    def __init__(self, function: ca.Function) -> None:
        self._shapes = [function.sparsity_out(k).shape for k in range(function.n_out())]
        entries = [
            list(zip(*function.sparsity_out(k).get_triplet(), strict=True)) for k in range(function.n_out())
        ]
        program = Program()
        # CasADi uses a place again once it is free; here every value has a number of its own.
        now_at = [0] * function.sz_w()
        values = itertools.count()
        for step in range(function.n_instructions()):
            code, taken = function.instruction_id(step), function.instruction_output(step)
            given = [] if code == ca.OP_CONST else function.instruction_input(step)
            if code == ca.OP_OUTPUT:
                program.results.append((taken[0], *entries[taken[0]][taken[1]], now_at[given[0]]))
                continue
            value = next(values)
            if code == ca.OP_CONST:
                program.constants[value] = function.instruction_constant(step)
            elif code == ca.OP_INPUT:
                program.given.append((given[0], given[1], value))
            elif code in _NUMBERS:
                one, other = now_at[given[0]], now_at[given[-1]]
                program.steps.append((_NUMBERS[code], one, other, other, value))
            else:
                raise NotImplementedError(f"CasADi's operation {code} over all rows")
            now_at[taken[0]] = value
        program.results.sort()
        self._laid = laid_out(program)

    @property
    def entries(self) -> NDArray[np.intp]:
        """(result, row, column, place) of all that is not always zero, result after result."""
        return self._laid.results

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
            for which, row, column, place in self._laid.results.tolist()
            if which != result or column in now_at
        ]
        other._laid = self._laid.of_results(kept)
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
        result, row, column, told = self._laid.results.T
        wide, size = np.array([(columns, rows * columns) for rows, columns in self._shapes])[result].T
        written = _addresses(results)[result] + 8 * (row * wide + column)
        kept = [np.ascontiguousarray(each, dtype=np.intp) for each in (told, written, size)]
        run(count, ctypes.byref(self.part(arguments)), len(told), *(each.ctypes.data for each in kept))

    def part(self, arguments: tuple[Array, ...], number: int = 0) -> "Part":
        """The program with these arguments, as all_rows.c is given it; those at once have a number each."""
        laid = self._laid
        work = _room(number, laid.places)
        places, constants = laid.constants
        work[places] = constants[:, None]
        values = [np.ascontiguousarray(argument, dtype=float) for argument in arguments]
        argument, component, given = laid.given.T
        # Numbers from one component to the next, and from one row of the recording to the next.
        across = np.array([value.shape[-1] if value.ndim == 2 else 1 for value in values])[argument]
        along = np.array([value.ndim - 1 for value in values])[argument]
        read = _addresses(values)[argument] + 8 * component * across
        kept = [np.ascontiguousarray(each, dtype=np.intp) for each in (given, read, along)]
        steps, (first, *rest) = laid.steps, (each.ctypes.data for each in kept)
        part = Part(len(steps), steps.ctypes.data, work.ctypes.data, len(given), first, *rest)
        part.keeps = laid, work, values, kept
        return part

    def _by_numpy(self, count: int, arguments: tuple[Array, ...], results: list[Array]) -> None:
        laid = self._laid
        program: list[list[int]] = laid.steps.tolist()
        for first in range(0, count, MOST_ROWS):
            here = slice(first, first + MOST_ROWS)
            work: list[Array | float] = [0.0] * laid.places
            for place, constant in zip(*laid.constants, strict=True):
                work[place] = constant
            for argument, component, place in laid.given.tolist():
                value = arguments[argument][component]
                work[place] = value[here] if value.ndim else float(value)
            with np.errstate(all="ignore"):  # a run that leaves the numbers is seen by its size
                for number, *operands, place in program:
                    taken = operands[: 2 if number < PRODUCT_PLUS else 3]
                    work[place] = _OPERATIONS[number][1](*(work[one] for one in taken))
            for result, row, column, place in laid.results.tolist():
                results[result][here, row, column] = work[place]


_rooms = threading.local()


def _room(number: int, places: int) -> Array:
    """Room to work in, (places, BLOCK), the same again as long as it is large enough: it is in a cache."""
    kept: dict[int, Array] = _rooms.__dict__.setdefault("kept", {})
    if number not in kept or len(kept[number]) < places:
        # At the start of a cache line: where every access crosses two, it takes three times as long.
        room = np.empty(places * BLOCK + 8)
        kept[number] = room[-(room.ctypes.data // 8) % 8 :][: places * BLOCK].reshape((-1, BLOCK))
    return kept[number]


def _addresses(arrays: list[Array]) -> NDArray[np.intp]:
    return np.array([array.ctypes.data for array in arrays], dtype=np.intp)


class Part(ctypes.Structure):
    """Part of all_rows.c; `keeps` what it points to."""

    _fields_ = (
        ("steps", ctypes.c_ssize_t),
        ("program", ctypes.c_void_p),
        ("work", ctypes.c_void_p),
        ("givens", ctypes.c_ssize_t),
        ("given", ctypes.c_void_p),
        ("from", ctypes.c_void_p),
        ("apart", ctypes.c_void_p),
    )
    keeps: tuple[Any, ...]


def library_of(*names: str) -> ctypes.CDLL | None:
    """These files of C, one after the other; None where the computer has no compiler."""
    source = "".join(files("host.compiled").joinpath(name).read_text(encoding="utf-8") for name in names)
    return compiled(source, ctypes.CDLL, *EFFORTS)


@cache
def _compiled() -> Callable[..., None] | None:
    library = library_of("all_rows.c")
    if library is None:
        return None
    size, pointer = ctypes.c_ssize_t, ctypes.c_void_p
    library.all_rows.argtypes = [size, pointer, size, pointer, pointer, pointer]
    library.all_rows.restype = None
    run: Callable[..., None] = library.all_rows
    return run
