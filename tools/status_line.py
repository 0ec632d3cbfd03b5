"""What a long-running sender says: a line a second on a terminal, else only the last one."""

import sys
import time
from collections.abc import Callable

_PERIOD_S = 1.0


class StatusLine:
    """Asks `line` for the text when it is due. A reader that has gone away silences it and stops nothing."""

    def __init__(self, line: Callable[[], str], is_quiet: bool) -> None:
        self._line = line
        self._is_quiet = is_quiet
        self._is_terminal = sys.stdout.isatty()
        self._next = time.monotonic()

    def begin(self, text: str) -> None:
        self._write(f"{text}\n")

    def tell(self) -> None:
        """Rewrites the line in place once it is a second old; may be called often."""
        if self._is_terminal and time.monotonic() >= self._next:
            self._next += _PERIOD_S
            self._write(f"\r{self._line()}\033[K")

    def finish(self) -> None:
        self._write(f"\r{self._line()}\033[K\n" if self._is_terminal else f"{self._line()}\n")

    def _write(self, text: str) -> None:
        if self._is_quiet:
            return
        try:
            sys.stdout.write(text)
            sys.stdout.flush()
        except OSError:
            self._is_quiet = True
            sys.stdout = None  # or the interpreter tries again at its end
