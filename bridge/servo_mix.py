"""The rudder as a linear mix of output channels, both ways."""

from collections import Counter
from collections.abc import Mapping

from bridge.mavlink_map import ServoTerm

_PULSE_US = (500.0, 2500.0)  # 0 and 65535 say "this output is off"


class ServoMix:
    """rudder = sum over the terms of rad_per_us * (pulse - trim_us)."""

    def __init__(self, terms: tuple[ServoTerm, ...], counts: Counter[str]) -> None:
        self._terms = terms
        self._counts = counts
        self._pulses: dict[int, float] = {}

    def rudder(self, pulses: Mapping[int, float]) -> float | None:
        """Rudder (rad) after these pulses (us by channel), or None.

        Channels above 16 come in messages of their own: a value is given with the message that carries the
        first term's channel, and uses the latest of the others.
        """
        if not self._terms or self._terms[0].channel not in pulses:
            self._pulses.update(pulses)
            return None
        self._pulses.update(pulses)
        total = 0.0
        for term in self._terms:
            pulse = self._pulses.get(term.channel, 0.0)
            if not _PULSE_US[0] <= pulse <= _PULSE_US[1]:
                self._counts["refused.servo_off"] += 1
                return None
            total += term.rad_per_us * (pulse - term.trim_us)
        return total


def pulses_for(rudder: float, terms: tuple[ServoTerm, ...]) -> dict[int, int]:
    """The smallest deflections (whole us by channel) whose mix is `rudder` (rad)."""
    gain = sum(term.rad_per_us**2 for term in terms)
    low, high = _PULSE_US
    return {
        term.channel: round(min(max(term.trim_us + rudder * term.rad_per_us / gain, low), high))
        for term in terms
    }
