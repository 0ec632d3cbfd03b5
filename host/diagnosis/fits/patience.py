"""How long a search may go on before it ends with the best that it has found.

What the catalogue holds is found within a minute or two. Physics that it lacks, and hulls that no free run
follows, are asked ever more; what a stage that begins late would add is rarely worth the wait.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from time import monotonic


class _Limit:
    """Until when a stage may begin, and whether one was to begin later."""

    def __init__(self, seconds: float) -> None:
        self.until, self.has_cut = monotonic() + seconds, False


_limit = _Limit(inf)


@contextmanager
def patience(seconds: float) -> Iterator[None]:
    """Within, no stage of a search begins after so long; without it all are asked."""
    global _limit
    before, _limit = _limit, _Limit(seconds)
    try:
        yield
    finally:
        _limit = before


def is_over() -> bool:
    """Whether the search is to end here with what it has."""
    _limit.has_cut |= monotonic() > _limit.until
    return _limit.has_cut


def was_cut() -> bool:
    """Whether a search has ended before it had asked all."""
    return _limit.has_cut
