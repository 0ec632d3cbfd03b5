"""What pymavlink itself reads from a file, and small files written for tests."""

import struct
from collections import Counter
from pathlib import Path

from pymavlink import mavutil

DATA = Path(__file__).parent.parent / "data" / "ardusub"


def pymavlink_counts(path: Path) -> Counter[str]:
    log = mavutil.mavlink_connection(str(path))
    counts: Counter[str] = Counter()
    while (message := log.recv_msg()) is not None:
        counts[message.get_type()] += 1
    log.close()
    return counts


def record(stamp_us: int, frame: bytes) -> bytes:
    return struct.pack(">Q", stamp_us) + frame
