"""Instructions on numbered values, each worked out once, and where in a table they find room."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

ADD, SUB, MUL = 1, 2, 3  # the operations of host.compiled.all_rows that are made one
PRODUCT_PLUS, PRODUCT_MINUS, MINUS_PRODUCT = 29, 30, 31  # x y + z, x y - z, z - x y

Step = tuple[int, int, int, int, int]
"""An operation, its operands, which it may have fewer of, and the value."""


@dataclass(frozen=True, slots=True)
class Program:
    """What is worked out of what is given.

    constants  by value
    given      (argument, component, value)
    steps      in order
    results    (result, row, column, value), sorted
    """

    constants: dict[int, float] = field(default_factory=dict)
    given: list[tuple[int, int, int]] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list)
    results: list[tuple[int, int, int, int]] = field(default_factory=list)


class Laid(NamedTuple):
    """A program on places of a table; intermediate values share theirs.

    constants  their places, and they
    given      (n, 3) argument, component, place
    steps      (n, 5) operation, operands, place
    results    (n, 4) result, row, column, place
    """

    places: int
    constants: tuple[NDArray[np.intp], NDArray[np.float64]]
    given: NDArray[np.intp]
    steps: NDArray[np.int32]
    results: NDArray[np.intp]

    def of_results(self, results: Sequence[tuple[int, ...]]) -> "Laid":
        """The same for these results; what nothing of them needs is left undone."""
        needed = {place for *_, place in results}
        steps: list[list[int]] = []
        for step in reversed(self.steps.tolist()):
            if step[-1] in needed:
                steps.append(step)
                needed.discard(step[-1])
                needed.update(step[1:-1])
        kept = np.array(steps[::-1], dtype=np.int32).reshape(-1, 5)
        return self._replace(steps=kept, results=_table(results, 4))


def laid_out(program: Program) -> Laid:
    """With products and the sums that alone take them as one; few places, so that these stay in a cache."""
    steps = _fused(program)
    place_of = {value: place for place, value in enumerate(program.constants)}
    for *_, value in program.given:
        place_of[value] = len(place_of)
    places = len(place_of)
    last = {operand: number for number, step in enumerate(steps) for operand in step[1:-1]}
    last |= {value: len(steps) for *_, value in program.results} | dict.fromkeys(place_of, len(steps))
    free: list[int] = []
    laid = []
    for number, (operation, *operands, value) in enumerate(steps):
        taken = [place_of[operand] for operand in operands]
        free += {place_of[operand] for operand in operands if last[operand] == number}
        if not free:
            free.append(places)
            places += 1
        place_of[value] = free.pop()
        laid.append((operation, *taken, place_of[value]))
    return Laid(
        places=places,
        constants=(
            np.array([place_of[value] for value in program.constants], dtype=np.intp),
            np.array([*program.constants.values()], dtype=float),
        ),
        given=_table([(*rest, place_of[value]) for *rest, value in program.given], 3),
        steps=np.array(laid, dtype=np.int32).reshape(-1, 5),
        results=_table([(*rest, place_of[value]) for *rest, value in program.results], 4),
    )


def _fused(program: Program) -> list[Step]:
    used = Counter(value for *_, value in program.results)
    for _, *operands, _ in program.steps:
        used.update({*operands})  # of a square, say, one
    products = {step[-1]: step for step in program.steps if step[0] == MUL and used[step[-1]] == 1}
    steps: list[Step] = []
    gone: set[int] = set()
    for operation, one, other, last, value in program.steps:
        is_sum = operation in (ADD, SUB) and one != other
        if is_sum and one in products:
            _, x, y, *_ = products[one]
            gone.add(one)
            steps.append((PRODUCT_PLUS if operation == ADD else PRODUCT_MINUS, x, y, other, value))
        elif is_sum and other in products:
            _, x, y, *_ = products[other]
            gone.add(other)
            steps.append((PRODUCT_PLUS if operation == ADD else MINUS_PRODUCT, x, y, one, value))
        else:
            steps.append((operation, one, other, last, value))
    return [step for step in steps if step[-1] not in gone]


def _table(rows: Sequence[tuple[int, ...]], columns: int) -> NDArray[np.intp]:
    return np.array(rows, dtype=np.intp).reshape(-1, columns)
