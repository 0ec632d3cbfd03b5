"""A CAN bus, or a recording of one, as measurements."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from bridge.can_decoder import CanDecoder
from bridge.can_encoder import CanEncoder
from bridge.can_log import CanLog
from bridge.can_map import CanMap
from bridge.link import Link
from bridge.measurement import Measurement


class CanSource:
    """Implements `bridge.source.Source` on any link of CAN frames."""

    def __init__(self, link: Link, can_map: CanMap) -> None:
        # A CAN link counts the frames that it refuses itself; one table shows them all.
        counts = getattr(link, "counts", None)
        self.counts: Counter[str] = counts if isinstance(counts, Counter) else Counter()
        self.notes: list[str] = []
        self._link = link
        self._publishes = can_map.publishes
        self._decoder = CanDecoder(can_map, self.counts)
        self._encoder = CanEncoder(can_map, self.counts)

    def read(self, timeout_s: float) -> list[Measurement]:
        return self._decoder.feed(self._link.read(timeout_s))

    def publish(self, t_us: int, values: Mapping[str, float]) -> None:
        if self._publishes:
            for packet in self._encoder.encode_estimates(t_us, values):
                self._link.write(packet)

    def warn(self, t_us: int, notice: str, values: Mapping[str, float]) -> None:  # noqa: ARG002
        """The MISMATCH frame of the default DBC; a bus has no text."""
        if self._publishes:
            for packet in self._encoder.encode_warning(t_us, values):
                self._link.write(packet)

    def close(self) -> None:
        self._link.close()


def read_can_log(path: Path, can_map: CanMap) -> tuple[list[Measurement], Counter[str], list[str]]:
    """All measurements of a recording, what was seen and refused by cause, and warnings in sentences.

    Raises LogFormatError when the file holds no CAN frame, BridgeError when the map does not fit its DBC.
    """
    decoder = CanDecoder(can_map)
    log = CanLog(path)
    measurements = decoder.feed(log)
    return measurements, decoder.counts + log.counts, list(log.warnings)
