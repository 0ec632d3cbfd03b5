"""Fits side by side on several cores: each worker keeps the recordings and its own functions."""

import multiprocessing
import os
import pickle
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from copy import copy
from multiprocessing.connection import wait
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Any

from host.compiled.side_by_side import on_cores
from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter

Task = tuple[Callable[..., Any], tuple[Any, ...]]
"""A function of a fitter and more, and what more it is given."""

FITTERS_KEPT = 3  # by a worker: a search goes back to the one before


class _Processes:
    """Processes for all workers of one diagnosis, and where these leave what a process is to open."""

    def __init__(self, pool: ProcessPoolExecutor, folder: Path) -> None:
        self.pool, self._folder, self._left = pool, folder, 0

    def left(self, fitter: Fitter) -> Path:
        """Once for all tasks: recordings of an hour take longer to send than a step of a fit."""
        self._left += 1
        place = self._folder / str(self._left)
        place.write_bytes(pickle.dumps((fitter.recordings, fitter.base)))
        return place


_processes: _Processes | None = None


@contextmanager
def sharing(jobs: int) -> Iterator[None]:
    """Within, all workers are the same `jobs` processes: what these have built once serves them all."""
    global _processes
    if jobs < 2 or _processes is not None:
        yield
        return
    # Spawned, not forked: the progress display runs a thread, and forks do not survive threads.
    context = multiprocessing.get_context("spawn")
    with TemporaryDirectory() as folder, on_cores(jobs):
        pool = ProcessPoolExecutor(jobs, context, initializer=leave_with_parent)
        _processes = _Processes(pool, Path(folder))
        try:
            yield
        finally:
            _processes = None
            pool.shutdown(cancel_futures=True)


class Workers:
    """Carries out tasks in order: here by one job or of a single task, else in processes."""

    def __init__(self, fitter: Fitter, jobs: int) -> None:
        self.jobs = jobs
        self._fitter = fitter
        self._open = ExitStack()
        self._open.enter_context(sharing(jobs))
        self._place: Path | None = None

    def beside(self, fitter: Fitter) -> "Workers":
        """The same workers for another fitter of the same recordings, beside whose sets something drifts."""
        other = copy(self)
        other._fitter = fitter
        return other

    def __enter__(self) -> "Workers":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.close()

    def results(self, tasks: Iterable[Task], on_done: Callable[[int], None] = lambda _: None) -> list[Any]:
        """What each task returns, in order; `on_done` gets the number of each as it ends."""
        tasks, found = list(tasks), []
        if self.jobs < 2 or _processes is None or len(tasks) < 2:
            for number, (function, arguments) in enumerate(tasks):
                found.append(function(self._fitter, *arguments))
                on_done(number)
            return found
        if self._place is None:
            self._place = _processes.left(self._fitter)
        base = self._fitter.base.lean() if self._fitter.wander.any() else None
        waiting = [_processes.pool.submit(_call, self._place, *task, base) for task in tasks]
        for number, future in enumerate(waiting):
            found.append(future.result())
            on_done(number)
        return found


def leave_with_parent() -> None:
    """Ends this worker when its parent is gone: it would wait for work for ever if that was killed."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            wait([parent.sentinel])
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


_opened: dict[Path, Fitter] = {}
_beside: dict[tuple[Path, bytes], Fitter] = {}


def _call(
    place: Path, function: Callable[..., Any], arguments: tuple[Any, ...], base: Explanation | None
) -> Any:
    fitter = _fitter_at(place) if base is None else _fitter_beside(place, base)
    result = function(fitter, *arguments)
    return result.lean() if isinstance(result, Explanation) else result


def _fitter_at(place: Path) -> Fitter:
    fitter = _opened.pop(place, None) or Fitter(*pickle.loads(place.read_bytes()))
    _opened[place] = fitter  # the last that was used goes last
    for old in list(_opened)[:-FITTERS_KEPT]:
        del _opened[old]
        for key in [key for key in _beside if key[0] == old]:
            del _beside[key]
    return fitter


def _fitter_beside(place: Path, base: Explanation) -> Fitter:
    """A fitter is kept for all that drifts beside it: what drifts tells it apart."""
    key = place, base.fit.relative_wander.tobytes()
    if key not in _beside:
        _beside[key] = Fitter(_fitter_at(place).recordings, base)
    return _beside[key]
