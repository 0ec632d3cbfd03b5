"""Which parameters may be relied on, with hysteresis."""

from collections.abc import Sequence


class Validity:
    """A parameter becomes valid below one relative standard deviation and invalid above a higher one."""

    def __init__(self, names: Sequence[str], valid_below: float, invalid_above: float) -> None:
        self._valid_below = valid_below
        self._invalid_above = invalid_above
        self.valid = dict.fromkeys(names, False)

    def reset(self) -> None:
        for name in self.valid:
            self.valid[name] = False

    def check(self, name: str, value: float, std: float, is_possible: bool) -> None:
        """Decides about one parameter; one that is not possible is never valid, NaN neither."""
        limit = self._invalid_above if self.valid[name] else self._valid_below
        self.valid[name] = is_possible and std < limit * abs(value)

    def restore(self, names: Sequence[str]) -> None:
        """Goes on with these names valid."""
        for name in self.valid:
            self.valid[name] = name in names

    def state(self) -> list[str]:
        return [name for name, is_valid in self.valid.items() if is_valid]
