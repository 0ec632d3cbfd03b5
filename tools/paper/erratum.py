"""One error of the paper, with the computation that shows it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Erratum:
    """One misprint or slip.

    evidence  what the computation gave
    is_shown  whether the computation confirms it
    """

    where: str
    printed: str
    correct: str
    evidence: str
    is_shown: bool
