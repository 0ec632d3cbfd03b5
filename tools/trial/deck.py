"""Which recording hides how much: dealt like cards, so that every effect gets its turn."""

from collections.abc import Iterator
from itertools import islice
from typing import Literal, NamedTuple, TypeVar

import numpy as np

from tools.trial.fleet import Fleet, hideable
from tools.trial.hidden import STRANGERS

Case = Literal["none", "one", "two", "outside"]
PACK: tuple[Case, ...] = ("none",) * 4 + ("one",) * 8 + ("two",) * 5 + ("outside",) * 3


T = TypeVar("T")


class Card(NamedTuple):
    """What one recording is to hide."""

    case: Case
    names: tuple[str, ...]


def deal(seed: int, count: int, fleet: Fleet = "linear") -> list[Card]:
    """The first `count` cards of a seed; more cards begin with the same ones."""
    rng = np.random.default_rng([seed, 0])
    cases = _shuffled(rng, PACK)
    one = _shuffled(np.random.default_rng([seed, 1]), hideable(fleet))
    two = _shuffled(np.random.default_rng([seed, 2]), hideable(fleet))
    outside = _shuffled(np.random.default_rng([seed, 3]), tuple(STRANGERS))
    cards = []
    for case in islice(cases, count):
        names: tuple[str, ...] = ()
        if case == "one":
            names = (next(one),)
        elif case == "outside":
            names = (next(outside),)
        elif case == "two":
            first = next(two)
            names = (first, next(name for name in two if name != first))
        cards.append(Card(case, names))
    return cards


def _shuffled(rng: np.random.Generator, items: tuple[T, ...]) -> Iterator[T]:
    while True:
        yield from (items[index] for index in rng.permutation(len(items)))
