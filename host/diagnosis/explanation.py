"""What one fit of a diagnosis is."""

from dataclasses import dataclass, replace

from host.fit import Fit

Names = frozenset[str]


@dataclass(frozen=True, slots=True)
class Explanation:
    """A set of effects, fitted jointly with the base."""

    names: Names
    fit: Fit
    bic: float

    def lean(self) -> "Explanation":
        """Without the sensitivities of every row: those of a whole search fill the memory."""
        return replace(self, fit=replace(self.fit, scores=[]))
