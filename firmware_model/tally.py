"""What became of the samples."""

from collections.abc import Mapping
from typing import Any

from firmware_model.state import count_of, require
from firmware_model.status import Status

REFUSALS = {
    Status.REFUSED_NON_FINITE: "non_finite",
    Status.REFUSED_STALE: "stale",
    Status.REFUSED_OFF_GRID: "off_grid",
    Status.REFUSED_OUTLIER: "outlier",
    Status.FAULT_NUMERICAL: "numerical",
}
"""The statuses that are counted, and the causes they are counted under."""


class Tally:
    """Counts samples accepted, samples learnt from, and refusals by cause; keeps the last status."""

    def __init__(self) -> None:
        self.refused = dict.fromkeys(REFUSALS.values(), 0)
        self.reset()

    def reset(self) -> None:
        self.samples = 0
        self.updates = 0
        self.status = Status.WAITING
        for cause in self.refused:
            self.refused[cause] = 0

    def note(self, status: Status) -> None:
        """Takes the result of one update."""
        if status in REFUSALS:
            self.refused[REFUSALS[status]] += 1
        self.status = status

    def state(self) -> dict[str, Any]:
        return {"samples": self.samples, "updates": self.updates, "refused": dict(self.refused)}

    def read(self, state: Mapping[str, Any]) -> "Tally":
        """A tally as saved. Raises ValueError if it does not fit."""
        require(isinstance(state.get("refused"), dict), "state.refused must be a dict", state.get("refused"))
        saved = Tally()
        saved.samples = count_of(state, "samples")
        saved.updates = count_of(state, "updates")
        for cause in saved.refused:
            saved.refused[cause] = count_of(state["refused"], cause)
        return saved

    def restore(self, saved: "Tally") -> None:
        """Goes on from a tally that `read` gave."""
        self.reset()
        self.samples = saved.samples
        self.updates = saved.updates
        self.refused.update(saved.refused)
