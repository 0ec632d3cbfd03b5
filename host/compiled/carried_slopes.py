"""Sensitivities carried through a recording: S' = F_x (S - K dh) + F_p, dh = h_x S + h_p, row after row.

The slopes of a block of rows are evaluated at once, and used while they are in a cache: compiled where the
computer has a C compiler, else by NumPy, which takes several times longer and differs by rounding.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from host.compiled.all_rows import AllRows, Part, library_of
from host.recordings.recording import Array

WIDE = 8  # numbers that a computer may add at once


class Passage(NamedTuple):
    """A run through N rows, and where its sensitivities begin.

    states   (nx, N) that were seen
    within   (substeps, nx, N) states from which the sub-steps begin
    drive    (m, N)
    start    (nx, columns) S at the first row; the first columns are those of the parameters
    present  (2, N) 1 where measured, else 0
    gains    (2 nx, N), column-major nx x 2, by which measurements corrected the state; None in a free run
    """

    states: Array
    within: Array
    parameters: Array
    drive: Array
    start: Array
    present: Array
    gains: Array | None = None


class CarriedSlopes:
    """How what two sensors see of a run goes with its parameters and its start.

    output   (x, p, drive) -> h_x (2, nx), h_p (2, parameters)
    substep  (x, p, drive, number) -> F_x (nx, nx), F_p (nx, parameters)
    """

    def __init__(self, output: AllRows, substep: AllRows) -> None:
        self._output, self._substep = output, substep

    def __call__(self, run: Passage) -> Array:
        """dh (2, columns, N), 0 where nothing was measured."""
        carry = _compiled()
        return self._by_numpy(run) if carry is None else self._by_machine(carry, run)

    def _by_machine(self, carry: Callable[..., None], run: Passage) -> Array:
        _, within, parameters, drive, start, present, gains = run
        (substeps, nx, rows), columns = within.shape, start.shape[1]
        output = self._output.part((run.states, parameters, drive))
        parts = [
            self._substep.part((begun, parameters, drive, np.array([float(k)])), 1 + k)
            for k, begun in enumerate(within)
        ]
        wide = -(-columns // WIDE) * WIDE
        S, room, seen = np.zeros((2, nx, wide)), np.empty((2, wide)), np.empty((2, columns, rows))
        S[0, :, :columns] = start
        kept = [None if each is None else np.ascontiguousarray(each, float) for each in (gains, present)]
        carry(
            rows,
            substeps,
            ctypes.byref(output),
            ctypes.byref(_Slopes.of(self._output)),
            (Part * substeps)(*parts),
            ctypes.byref(_Slopes.of(self._substep)),
            nx,
            columns,
            wide,
            *(None if each is None else each.ctypes.data for each in (*kept, S, room, seen)),
        )
        return seen

    def _by_numpy(self, run: Passage) -> Array:
        states, within, parameters, drive, start, present, gains = run
        substeps, nx, rows = within.shape
        hx, hp = self._output(states, parameters, drive)
        number = np.tile(np.arange(float(substeps)), rows)[None]
        begun = within.transpose(1, 2, 0).reshape((nx, -1))
        Fx, Fp = self._substep(begun, parameters, np.repeat(drive, substeps, axis=1), number)
        if gains is not None:  # a measurement corrects the state before the first sub-step
            first = slice(0, None, substeps)
            FK = Fx[first] @ gains.T.reshape((rows, 2, nx)).transpose(0, 2, 1)
            Fx[first] -= FK @ hx
            Fp[first] -= FK @ hp
        S = np.empty((rows * substeps, *start.shape))
        S[0] = start
        S[1:, :, : Fp.shape[2]], S[1:, :, Fp.shape[2] :] = Fp[:-1], 0.0
        for slope, now, following in zip(Fx, S, S[1:], strict=False):
            following += slope.dot(now)
        seen = hx @ S[::substeps]
        seen[:, :, : hp.shape[2]] += hp
        return np.asarray(seen.transpose(1, 2, 0) * present[:, None, :])


class _Slopes(ctypes.Structure):
    """Slopes of carried_slopes.c; `keeps` what it points to."""

    _fields_ = (("count", ctypes.c_ssize_t), ("by_state", ctypes.c_ssize_t), ("entries", ctypes.c_void_p))
    keeps: NDArray[np.intp]

    @classmethod
    def of(cls, function: AllRows) -> "_Slopes":
        entries = function.entries
        slopes = cls(len(entries), int(np.sum(entries[:, 0] == 0)), entries.ctypes.data)
        slopes.keeps = entries
        return slopes


@cache
def _compiled() -> Callable[..., None] | None:
    library = library_of("all_rows.c", "carried_slopes.c")
    if library is None:
        return None
    size, pointer = ctypes.c_ssize_t, ctypes.c_void_p
    library.carried_slopes.argtypes = [size, size, *[pointer] * 4, *[size] * 3, *[pointer] * 5]
    library.carried_slopes.restype = None
    run: Callable[..., None] = library.carried_slopes
    return run
