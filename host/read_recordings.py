"""Any recording to its stretches on the time grid: text, telemetry, dataflash, CAN logs, the journal."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from bridge.logs import LogReading, read_log
from firmware_model.sample import Sample
from host.align import Aligner
from host.csv_recording import read_csv_recording
from host.errors import RecordingError
from host.journal import JournalReading, read_journal
from host.recording import NEEDED, Array, Recording, file_sha256, split_at_gaps
from host.vehicle import Vehicle


def read_recordings(path: Path, vehicle: Vehicle, needs: tuple[str, ...] = NEEDED) -> list[Recording]:
    """Stretches of one file, cut at reboots and long gaps; `counts` of each say what was refused and why.

    needs  channels without which a stretch is of no use; the others may be missing altogether.

    Raises RecordingError or LogFormatError with one line when nothing usable is in it.
    """
    if path.is_dir():
        raise RecordingError(f"{path}: is a folder; name the recording inside it")
    if not path.exists():
        raise RecordingError(f"{path}: no such file")
    if path.stat().st_size == 0:
        raise RecordingError(f"{path}: is empty; nothing was recorded")
    suffix = path.suffix.lower()
    if suffix == ".csv":
        return read_csv_recording(path, vehicle.csv, needs)
    if suffix == ".jsonl":
        return _aligned(path, read_journal(path), vehicle, needs)
    return _aligned(path, read_log(path, vehicle.mavlink, vehicle.can), vehicle, needs)


def _aligned(
    path: Path, reading: LogReading | JournalReading, vehicle: Vehicle, needs: tuple[str, ...]
) -> list[Recording]:
    aligner = Aligner(vehicle.alignment)
    segments: dict[int, list[Sample]] = {}
    boots: dict[int, int] = {}
    seen: Counter[str] = Counter()
    for measurement in reading.measurements:
        seen[measurement.quantity.value] += 1
        segment = aligner.segment  # a push that starts a new segment returns the end of the old one
        segments.setdefault(segment, []).extend(aligner.push(measurement))
        boots[aligner.segment] = measurement.boot
    segments.setdefault(aligner.segment, []).extend(aligner.flush())
    digest, total = file_sha256(path), reading.counts + aligner.counts
    pieces = []
    for segment, samples in segments.items():
        if not samples:
            continue
        whole = _recording(path.name, digest, samples, vehicle.alignment.step, total, tuple(reading.notes))
        longest = max(1.0, 2.5 * whole.step)
        whole = replace(
            whole,
            rudder=_bridged(whole.rudder, round(longest / whole.step)),
            alarms=_alarms(reading, boots[segment], samples),
        )
        pieces += split_at_gaps(whole, longest, needs)
    if not pieces:
        lacking = [name for name in needs if not seen[name]]
        reason = f"no {' and no '.join(lacking)} in it" if lacking else "never all at once for 10 steps"
        raise RecordingError(
            f"{path}: {', '.join(needs)} are needed together: {reason}; "
            "check the vehicle file's channels (`--vehicle`)"
        )
    return pieces


def _alarms(reading: LogReading | JournalReading, boot: int, samples: list[Sample]) -> tuple[float, ...]:
    """When `mils run` found a mismatch in this stretch, s from its start."""
    events = reading.events if isinstance(reading, JournalReading) else ()
    marked = [e.get("t_us") for e in events if e.get("event") == "mismatch" and e.get("boot") == boot]
    first, last = samples[0].t_us, samples[-1].t_us
    return tuple(1e-6 * (t_us - first) for t_us in marked if isinstance(t_us, int) and first <= t_us <= last)


def _bridged(rudder: Array, longest: int) -> Array:
    """Losses of up to `longest` rows on a straight line: the plane turned on the way, nobody knows when."""
    rows, known = np.arange(rudder.size), np.isfinite(rudder)
    before = np.maximum.accumulate(np.where(known, rows, -1))
    after = np.minimum.accumulate(np.where(known, rows, rudder.size)[::-1])[::-1]
    is_short = (before >= 0) & (after < rudder.size) & (after - before <= longest + 1)
    share = (rows - before) / np.maximum(after - before, 1)
    line = (1.0 - share) * rudder[before] + share * rudder[np.minimum(after, rudder.size - 1)]
    return np.where(is_short & ~known, line, rudder)


def _recording(
    name: str, sha256: str, samples: list[Sample], step: float, counts: Counter[str], notes: tuple[str, ...]
) -> Recording:
    time = np.array([sample.t_us for sample in samples], dtype=float) * 1e-6
    return Recording(
        name=name,
        sha256=sha256,
        time=time - time[0],
        depth=np.array([sample.depth for sample in samples]),
        pitch=np.array([sample.pitch for sample in samples]),
        rudder=np.array([sample.rudder for sample in samples]),
        speed=np.array([sample.speed for sample in samples]),
        pitch_rate=np.array([sample.pitch_rate for sample in samples]),
        step=step,
        counts=counts,
        notes=notes,
    )
