"""What one fit of a diagnosis is."""

from dataclasses import dataclass, replace

from host.likelihood.fit import Fit
from host.noise.whiteness import is_even, is_white

Names = frozenset[str]
COLOUR = 0.05  # autocorrelation that the shape of a spectrum leaves: no sea has one peak of second order


@dataclass(frozen=True, slots=True)
class Explanation:
    """A set of effects, fitted jointly with the base."""

    names: Names
    fit: Fit
    bic: float

    @property
    def leaves_white(self) -> bool:
        """Whether its innovations are white, fast and slow; among waves, as white as those leave them."""
        slack = COLOUR if self.fit.waves.any() else 0.0
        return all(is_white(e, slack=slack) and is_even(e, slack) for e in self.fit.whitened)

    def lean(self) -> "Explanation":
        """Without the sensitivities of every row: those of a whole search fill the memory."""
        return replace(self, fit=replace(self.fit, scores=[]))
