"""Says once when a quantity that the estimator needs stops coming, and once when it is back."""

from bridge.measurement import Quantity

NEEDED = (Quantity.DEPTH, Quantity.PITCH, Quantity.RUDDER)


class SilenceWatch:
    """Times are of one monotonic clock, s; `limit` s without a quantity is a silence."""

    def __init__(self, limit: float, now: float) -> None:
        self._limit = limit
        self._last = dict.fromkeys(NEEDED, now)
        self._is_silent = dict.fromkeys(NEEDED, False)
        self.never_heard = list(NEEDED)

    def hear(self, quantity: Quantity, now: float) -> list[str]:
        """Takes note of a measurement; a sentence when it ends a silence."""
        if quantity not in self._last:
            return []
        if quantity in self.never_heard:
            self.never_heard.remove(quantity)
        silence = now - self._last[quantity]
        self._last[quantity] = now
        was_silent, self._is_silent[quantity] = self._is_silent[quantity], False
        return [f"{quantity} is back after {silence:.1f} s"] if was_silent else []

    def check(self, now: float) -> list[str]:
        """A sentence when a silence has begun; quantities that fall silent together share it."""
        silent = [
            quantity
            for quantity in NEEDED
            if now - self._last[quantity] > self._limit and not self._is_silent[quantity]
        ]
        if not silent:
            return []
        for quantity in silent:
            self._is_silent[quantity] = True
        return [f"no {', no '.join(silent)} for {self._limit:g} s"]
