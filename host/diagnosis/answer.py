"""All that `mils diagnose` tells: the diagnosis, and what a model or a simulation lacks beside it."""

from dataclasses import dataclass, field
from typing import Any, Literal

from host.diagnosis.against.comparison import Comparison, as_json, sentences
from host.diagnosis.diagnose import Diagnosis
from host.diagnosis.separation import Separation
from host.recordings.recording import Recording


@dataclass(frozen=True, slots=True, kw_only=True)
class Against:
    """What was set against the recording.

    details        more for diagnosis.json
    recorded       a simulation's own run as the recording's sensors would see it; empty for a model
    is_understood  False where a simulation holds physics that the catalogue does not explain
    """

    kind: Literal["model", "simulation"]
    name: str
    comparison: Comparison
    details: dict[str, Any] = field(default_factory=dict)
    recorded: list[Recording] = field(default_factory=list)
    is_understood: bool = True

    @property
    def sentences(self) -> list[str]:
        """What differs, in words."""
        doubt = (
            "The simulation holds physics that the catalogue does not explain: what follows is part of it."
        )
        return [doubt] * (not self.is_understood) + sentences(self.comparison, self.kind)

    def as_json(self) -> dict[str, Any]:
        """The key "model" or "simulation" of diagnosis.json."""
        return {
            "file": self.name,
            **self.details,
            **as_json(self.comparison, self.kind),
            "sentences": self.sentences,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """The diagnosis and what belongs to it; without `against` the base was fitted to the recording.

    separations  how to tell each named effect from its twins
    """

    found: Diagnosis
    separations: list[Separation] = field(default_factory=list)
    against: Against | None = None

    def separating(self, name: str) -> list[Separation]:
        """Those of one effect."""
        return [one for one in self.separations if one.effect == name]
