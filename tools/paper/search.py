"""Which input would give the estimates that the paper prints? It states neither amplitude nor initial state.

Linear least squares does not see amplitude and prior apart: only amplitude^2 * p0 matters. So one number is
searched for each kind of record, by the exact solution of the recursion at the printed times.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import pi

import numpy as np

from host.recordings.recording import Array
from tools.paper.printed import Estimates, correct_truth, printed_estimates
from tools.paper.regression import respond, rows_of, weighted_fit
from tools.paper.rudder import H, sine
from tools.paper.table import Table

FORGETTING = {"alpha": 1.0, "beta": 0.97}
DURATION = 200.0  # s
PULSE_AT, PULSE_FOR = 120.0, 1.0  # s


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One candidate: what was fed in, and seconds per unit of the tables' t."""

    kind: str
    amplitude: float
    extra: float
    rudder: Array
    output: Array
    second: float = 1.0


Kind = Callable[[str, float], Iterator[Record]]


def from_rest(channel: str, amplitude: float) -> Iterator[Record]:
    """The sine of Figure 1, started at rest."""
    rudder = sine(amplitude, DURATION)
    yield _record("sine from rest", channel, amplitude, rudder)


def cosine(channel: str, amplitude: float) -> Iterator[Record]:
    rudder = sine(amplitude, DURATION, pi / 2.0)
    yield _record("cosine from rest (a step at t = 0)", channel, amplitude, rudder)


def settled(channel: str, amplitude: float) -> Iterator[Record]:
    record = _record("settled sine, its transient over", channel, amplitude, sine(amplitude, 2 * DURATION))
    half = slice(round(DURATION / H), None)
    # The rudder's periods fit the record, so that it begins at the phase of Figure 1.
    yield Record(
        kind=record.kind,
        amplitude=amplitude,
        extra=0.0,
        rudder=record.rudder[half],
        output=record.output[half] - record.output[half][0] * (channel == "beta"),
    )


def in_samples(channel: str, amplitude: float) -> Iterator[Record]:
    rudder = sine(amplitude, DURATION)
    one = _record("sine from rest, t counts samples", channel, amplitude, rudder)
    yield Record(
        kind=one.kind, amplitude=amplitude, extra=0.0, rudder=one.rudder, output=one.output, second=H
    )


def noisy(channel: str, amplitude: float) -> Iterator[Record]:
    rudder = sine(amplitude, DURATION)
    unit = np.random.default_rng(0).standard_normal(rudder.size)
    for sigma in np.geomspace(1e-6, 1e-3, 7):
        output = respond(getattr(correct_truth(), channel), rudder, sigma * unit)
        yield Record(
            kind="sine from rest, white noise v1 (extra: its deviation)",
            amplitude=amplitude,
            extra=float(sigma),
            rudder=rudder,
            output=output,
        )


def pulsed(channel: str, amplitude: float) -> Iterator[Record]:
    """A hypothesis, nothing that the paper says: something moved the rudder between 100 and 140 s."""
    t = np.arange(round(2 * DURATION / H) + 1) * H - DURATION
    base, half = sine(amplitude, 2 * DURATION), slice(round(DURATION / H), None)
    for size in np.geomspace(1e-3, 1e1, 7):
        rudder = base + size * ((t >= PULSE_AT) & (t < PULSE_AT + PULSE_FOR))
        yield Record(
            kind=f"settled sine, a rudder pulse of {PULSE_FOR:.0f} s at {PULSE_AT:.0f} s (extra: its size)",
            amplitude=amplitude,
            extra=float(size),
            rudder=rudder[half],
            output=respond(getattr(correct_truth(), channel), rudder)[half],
        )


KINDS: dict[str, tuple[Kind, ...]] = {
    "alpha": (from_rest, settled, cosine, in_samples, noisy, pulsed),
    "beta": (from_rest, settled, cosine),
}


def _record(kind: str, channel: str, amplitude: float, rudder: Array) -> Record:
    output = respond(getattr(correct_truth(), channel), rudder)
    return Record(kind=kind, amplitude=amplitude, extra=0.0, rudder=rudder, output=output)


def estimates_of(channel: str, record: Record, block: Estimates) -> Array:
    """What RLS or MILS arrives at, at the times of one block of the tables: (K, n)."""
    rows = rows_of(channel, record.output, record.rudder)
    found = []
    for t in block.times:
        count = int(np.searchsorted(rows.k, round(t * record.second / H), side="right"))
        found.append(weighted_fit(rows.first(count), block.p, FORGETTING[channel]))
    return np.array(found)


def distance(channel: str, record: Record) -> float:
    """Mean distance from the printed estimates, % of the parameters' norm.

    Table 3, p = 8 is left out: it prints the estimates of p = 5 again.
    """
    norm = float(np.linalg.norm(getattr(correct_truth(), channel)))
    gaps = [
        np.linalg.norm(estimates_of(channel, record, block) - block.values, axis=1)
        for block in printed_estimates(channel)
        if not (channel == "alpha" and block.p == 8)
    ]
    return 100.0 * float(np.mean(gaps)) / norm


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """Distances of one kind over the amplitudes (the best of its extras), and its best record."""

    kind: str
    amplitudes: Array
    distances: Array
    best: Record
    distance: float


def search(channel: str, amplitudes: Array, on_step: Callable[[], None] = lambda: None) -> list[Search]:
    """One search for each kind of record, "sine from rest" first."""
    found = []
    for kind in KINDS[channel]:
        best, lowest, curve = None, np.inf, []
        for amplitude in amplitudes:
            of_amplitude = np.inf
            for record in kind(channel, float(amplitude)):
                off = distance(channel, record)
                of_amplitude = min(of_amplitude, off)
                if off < lowest:
                    best, lowest = record, off
            curve.append(of_amplitude)
        assert best is not None
        found.append(
            Search(
                kind=best.kind, amplitudes=amplitudes, distances=np.array(curve), best=best, distance=lowest
            )
        )
        on_step()
    return found


def search_table(searches: dict[str, list[Search]]) -> Table:
    """Best match of every kind of record, for both channels."""
    rows = [
        (
            "2 and 3 (pitch)" if channel == "alpha" else "4 and 5 (depth)",
            one.kind,
            one.best.amplitude,
            one.best.extra if one.best.extra > 0.0 else None,
            one.distance,
        )
        for channel, each in searches.items()
        for one in each
    ]
    return Table(
        name="input_search",
        title="Which input gives the printed estimates?",
        columns=(
            "Tables",
            "record fed in",
            "best amplitude",
            "extra",
            "mean distance from printed estimates, %",
        ),
        rows=rows,
        formats=("", "", ".3g", ".1e", ".1f"),
        note="Amplitude in the unit of the rudder, p0 = 10⁶. Distance in % of the parameters' norm.",
    )
