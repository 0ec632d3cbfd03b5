"""How often the states may start anew: a sensor that jumps without end must not hold up all else."""


class RestartBudget:
    """Allows `most` restarts at once, and one more for each `regain` s that go well."""

    def __init__(self, most: int, regain: float, step: float) -> None:
        self._most = most
        self._per_sample = step / regain
        self.reset()

    def reset(self) -> None:
        self._left = float(self._most)

    def pass_sample(self) -> None:
        """One step went well."""
        self._left = min(self._left + self._per_sample, float(self._most))

    def take(self) -> bool:
        """Whether one more restart is allowed; it is spent."""
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
