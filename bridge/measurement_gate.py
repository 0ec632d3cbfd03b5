"""The last check before a value becomes a measurement: finite, in range, in order."""

from collections import Counter
from math import isfinite, pi

from bridge.measurement import Measurement, Quantity

LARGEST = {
    Quantity.DEPTH: 12e3,
    Quantity.PITCH: pi,
    Quantity.RUDDER: 1e4,  # may be a battery's position or a pulse width
    Quantity.SPEED: 50.0,
    Quantity.PITCH_RATE: 50.0,
}
"""By quantity, in SI: larger values are no vehicle's, but a wrong unit or a corrupt field."""


class MeasurementGate:
    """Appends what passes and counts the rest by cause."""

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._latest: dict[tuple[Quantity, str], int] = {}

    def admit(
        self, out: list[Measurement], quantity: Quantity, value: float, t_us: int, source: str, boot: int
    ) -> None:
        if not isfinite(value):
            self._counts["refused.non_finite"] += 1
            return
        if abs(value) > LARGEST[quantity]:
            self._counts["refused.range"] += 1
            return
        latest = self._latest.get((quantity, source))
        if latest is not None and t_us <= latest:
            self._counts["refused.duplicate" if t_us == latest else "refused.backwards"] += 1
            return
        self._latest[quantity, source] = t_us
        out.append(Measurement(quantity=quantity, value=value, t_us=t_us, source=source, boot=boot))
