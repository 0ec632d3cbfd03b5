"""Fits side by side on several cores: each worker keeps the recordings and its own functions."""

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from copy import copy
from multiprocessing.connection import wait
from types import TracebackType
from typing import Any

from host.diagnosis.fits.explanation import Explanation
from host.diagnosis.fits.fitter import Fitter

Task = tuple[Callable[..., Any], tuple[Any, ...]]
"""A function of a fitter and more, and what more it is given."""

_fitter: Fitter
_beside: dict[bytes, Fitter] = {}


class Workers:
    """Carries out tasks in order; one job does so here, more in processes of their own."""

    def __init__(self, fitter: Fitter, jobs: int) -> None:
        self.jobs = jobs
        self._fitter = fitter
        self._pool: ProcessPoolExecutor | None = None
        if jobs > 1:
            # Spawned, not forked: the progress display runs a thread, and forks do not survive threads.
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(jobs, context, _open, (fitter.recordings, fitter.base))

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
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def results(self, tasks: Iterable[Task], on_done: Callable[[int], None] = lambda _: None) -> list[Any]:
        """What each task returns, in order; `on_done` gets the number of each as it ends."""
        found = []
        if self._pool is None:
            for number, (function, arguments) in enumerate(tasks):
                found.append(function(self._fitter, *arguments))
                on_done(number)
            return found
        base = self._fitter.base.lean() if self._fitter.wander.any() else None
        waiting = [self._pool.submit(_call, *task, base) for task in tasks]
        for number, future in enumerate(waiting):
            found.append(future.result())
            on_done(number)
        return found


def _open(*arguments: Any) -> None:
    global _fitter
    leave_with_parent()
    _fitter = Fitter(*arguments)


def leave_with_parent() -> None:
    """Ends this worker when its parent is gone: it would wait for work for ever if that was killed."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            wait([parent.sentinel])
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _call(function: Callable[..., Any], arguments: tuple[Any, ...], base: Explanation | None) -> Any:
    result = function(_fitter if base is None else _fitter_beside(base), *arguments)
    return result.lean() if isinstance(result, Explanation) else result


def _fitter_beside(base: Explanation) -> Fitter:
    """A fitter is kept for all that drifts beside it: what drifts tells it apart."""
    key = base.fit.relative_wander.tobytes()
    if key not in _beside:
        _beside[key] = Fitter(_fitter.recordings, base)
    return _beside[key]
