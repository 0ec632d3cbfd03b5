"""Progress of a long command: a bar for each stage on a terminal, a line for each stage on a pipe."""

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

Stage = Callable[[str, int], AbstractContextManager[Callable[[], None]]]
"""stage(name, steps) is entered for the time of the stage and gives the function that counts a step."""


@contextmanager
def stages(quiet: bool) -> Iterator[Stage]:
    """Opens the display; nothing is shown when quiet."""
    is_live = not quiet and sys.stderr.isatty()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), disable=not is_live) as progress:

        @contextmanager
        def stage(name: str, steps: int) -> Iterator[Callable[[], None]]:
            if not quiet and not is_live:
                print(name, file=sys.stderr, flush=True)
            task = progress.add_task(name, total=steps)
            yield lambda: progress.advance(task)
            progress.update(task, completed=steps)

        yield stage
