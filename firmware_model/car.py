"""Regression rows of the CAR model, from ring buffers of fixed size.

y(k) = sum_l -a_l y(k - l) + sum_l b_l delta(k - l) + v(k)      l over the output and the rudder lags
"""

import math

PITCH_LAGS = ((1, 2), (2,))
"""theta(k) = -alpha1 theta(k-1) - alpha2 theta(k-2) + alpha3 delta(k-2)"""

DEPTH_LAGS = ((1, 2, 3, 4), (2, 3, 4))
"""zeta(k) = -beta1 zeta(k-1) - ... - beta4 zeta(k-4) + beta5 delta(k-2) + ... + beta7 delta(k-4)"""


class Ring:
    """The last `size` values pushed; `ring[1]` is the newest. Values not yet pushed are NaN."""

    def __init__(self, size: int) -> None:
        self._values = [math.nan] * size
        self._head = 0

    def __getitem__(self, lag: int) -> float:
        return self._values[self._head - lag]

    def push(self, value: float) -> None:
        self._values[self._head] = value
        self._head = self._head + 1 if self._head + 1 < len(self._values) else 0

    def clear(self) -> None:
        for i in range(len(self._values)):
            self._values[i] = math.nan


class CarRow:
    """The regressor of the coming instant: [-y(k - l) ..., delta(k - l) ...].

    It holds past values only, so it stands before y(k) is measured. NaN marks what was not measured.
    """

    def __init__(self, output_lags: tuple[int, ...], rudder_lags: tuple[int, ...]) -> None:
        self._output_lags = output_lags
        self._rudder_lags = rudder_lags
        self._outputs = Ring(max(output_lags))
        self._rudders = Ring(max(rudder_lags))
        self.span = max(output_lags + rudder_lags)
        """Instants back to the oldest value in a row."""
        self.phi = [math.nan] * (len(output_lags) + len(rudder_lags))
        """The regressor (n); written in place by every push."""

    @property
    def is_complete(self) -> bool:
        """Whether every entry of the regressor was measured."""
        return all(math.isfinite(value) for value in self.phi)

    def push(self, output: float, rudder: float) -> None:
        """Takes the values of one instant, NaN where there is none, and forms the next regressor."""
        self._outputs.push(output)
        self._rudders.push(rudder)
        at = 0
        for lag in self._output_lags:
            self.phi[at] = -self._outputs[lag]
            at += 1
        for lag in self._rudder_lags:
            self.phi[at] = self._rudders[lag]
            at += 1

    def clear(self) -> None:
        """Forgets all values."""
        self._outputs.clear()
        self._rudders.clear()
        for i in range(len(self.phi)):
            self.phi[i] = math.nan
