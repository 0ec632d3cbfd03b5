"""The same work for many, on several cores of one process: compiled parts let go of Python's lock."""

import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

_helpers: tuple[ThreadPoolExecutor, int] | None = None
"""Threads beside the main one, and how many."""


@contextmanager
def on_cores(count: int) -> Iterator[None]:
    """Within, the main thread of this process has `count` cores for itself."""
    global _helpers
    if count < 2:
        yield
        return
    before = _helpers
    with ThreadPoolExecutor(count - 1) as helpers:
        _helpers = helpers, count - 1
        try:
            yield
        finally:
            _helpers = before


def side_by_side(function: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """What the function returns of each, in order; to the last bit the same on however many cores."""
    if _helpers is None or len(items) < 2 or threading.current_thread() is not threading.main_thread():
        return [function(item) for item in items]
    found: dict[int, R] = {}
    left = deque(enumerate(items))

    def work() -> None:
        while left:
            try:
                number, item = left.popleft()
            except IndexError:  # another was quicker
                return
            found[number] = function(item)

    # What NumPy is to do about errors goes with the context.
    helpers, count = _helpers
    helping = [helpers.submit(copy_context().run, work) for _ in range(count)]
    work()
    for one in helping:
        if not one.cancel():  # one that is busy with work around this would be waited for
            one.result()
    return [found[number] for number in range(len(items))]
