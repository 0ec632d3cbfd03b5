"""Measurements to CAN frames by the vehicle's map; estimates to the ESTIMATE frames of the default DBC."""

from collections import Counter
from collections.abc import Mapping

from bridge.can_dbc import DbcDialect
from bridge.can_decoder import dialect_of
from bridge.can_map import CanMap, CanSignal
from bridge.link import Packet
from bridge.measurement import Measurement, Quantity


class CanEncoder:
    """Inverse of CanDecoder.

    A message that carries several quantities is sent when all of them are there, so that no value is made up.
    counts  takes "refused.not_encodable" and "refused.not_mapped"
    """

    def __init__(self, can_map: CanMap, counts: Counter[str] | None = None) -> None:
        self.counts: Counter[str] = Counter() if counts is None else counts
        self._map = can_map
        self._dialect = dialect_of(can_map, self.counts)
        self._estimates = DbcDialect(None, (), self.counts)
        self._signal_of: dict[Quantity, CanSignal] = {}
        for signal in can_map.table():
            name = "depth" if signal.quantity == "pressure" else signal.quantity
            self._signal_of.setdefault(Quantity(name), signal)
        self._pending: dict[tuple[object, ...], dict[str, float]] = {}

    def encode(self, measurement: Measurement) -> list[Packet]:
        """The frames that this measurement completes, stamped with its time."""
        signal = self._signal_of.get(measurement.quantity)
        if signal is None:
            self.counts["refused.not_mapped"] += 1
            return []
        # Pages of a multiplexed message are messages of their own.
        page = (signal.message, signal.only)
        fields = self._pending.setdefault(page, {})
        fields[signal.signal] = self._map.from_quantity(signal, measurement.value)
        together = [other for other in self._signal_of.values() if (other.message, other.only) == page]
        if any(other.signal not in fields for other in together):
            return []
        del self._pending[page]
        for other in together:
            fields |= {only.signal: only.value for only in other.only}
            if other.time is not None:
                period_us = self._dialect.clock_period_us(other.message, other.time)
                t_us = measurement.t_us
                fields[other.time] = (t_us if period_us is None else t_us % period_us) * 1e-6
        try:
            return self._dialect.encode(signal.message, fields, measurement.t_us)
        except ValueError:
            self.counts["refused.not_encodable"] += 1
            return []

    def encode_estimates(self, t_us: int, values: Mapping[str, float]) -> list[Packet]:
        """ESTIMATE frames of those `values` that the default DBC has: a1, a1_std, ... u0, u0_std, status."""
        try:
            return self._estimates.encode_estimates(t_us, values)
        except ValueError:
            self.counts["refused.not_encodable"] += 1
            return []

    def encode_warning(self, t_us: int, values: Mapping[str, float]) -> list[Packet]:
        """The MISMATCH frame of the default DBC with these `values`: mismatch, mism_ratio."""
        try:
            return self._estimates.encode_stamped("MISMATCH", values, t_us)
        except ValueError:
            self.counts["refused.not_encodable"] += 1
            return []
