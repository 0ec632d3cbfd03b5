"""Where a recording is at the surface: a hull that is partly out of the water moves by other physics.

Its buoyancy grows with its draught, its planes and propeller draw air, and it lies without thrust, its plane
at rest. None of this is in the equations of a dive, so such stretches are left out, and told.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from host.recordings.recording import Array, Recording

AFLOAT, LEFT = 0.5, 1.0  # m: depth of a vehicle at the surface, and by which it has left it
ABOVE = -0.5  # m: where depth is less than that, it is not counted from the surface
LONG_ENOUGH, MOSTLY = 15.0, 0.5  # s at the surface, and share of what is above `LEFT`
DIVES = 2.0  # m: of a vehicle that never goes deeper, and works its plane, depth may count from elsewhere
KEPT = 0.15  # m, within which half of all depths lie at the surface
SOON, LINGERS = 30.0, 0.85  # s above `LEFT` at an end, and the share at the surface: half by one that sinks
SMOOTHED = 5.0  # s, of which the median depth counts: a wave or a spike is no dive
STILL = 0.01  # rad (a unit of another actuator): a plane that moves no more than this is at rest
LONGEST_ASCENT = 60.0  # s, for which a vehicle floats up with its plane at rest before it is at the surface
LEAST_DIVE = 20.0  # s between two stretches at the surface, or else it belongs to them
LEAST_KEPT, LEAST_SHARE = 60.0, 0.5  # s and share under water, one of which a file must have to be cut


def under_water(recordings: list[Recording]) -> list[Recording]:
    """Of each file the stretches below the surface; a note says what was left out.

    A file that would be hardly anything without stays as it is: its depth may count from elsewhere.
    """
    pieces: list[Recording] = []
    for name in dict.fromkeys(recording.name for recording in recordings):
        pieces += _under_water([recording for recording in recordings if recording.name == name])
    return pieces


def _under_water(stretches: list[Recording]) -> list[Recording]:
    """Those of one file."""
    pieces: list[Recording] = []
    left_out: list[str] = []
    for recording in stretches:
        spans = _spans(recording)
        pieces += [recording.between(start, end) for start, end in spans]
        left_out += [f"{start:.0f} to {end:.0f} s" for start, end in _between(recording, spans)]
    before, after = (sum(each.duration for each in some) for some in (stretches, pieces))
    if not left_out or (after < LEAST_KEPT and after < LEAST_SHARE * before):
        return stretches
    note = f"at the surface, and left out: {', '.join(left_out)}"
    return [replace(piece, notes=(*piece.notes, note)) for piece in pieces]


def _spans(recording: Recording) -> list[tuple[float, float]]:
    """Where it is under water, s."""
    edges = np.flatnonzero(np.diff(_afloat(recording), prepend=True, append=True))
    time = np.append(recording.time, recording.time[-1] + recording.step)
    spans = [(float(time[first]), float(time[end])) for first, end in edges.reshape(-1, 2)]
    return [span for span in spans if span[1] - span[0] >= LEAST_DIVE or span == (time[0], time[-1])]


def _between(recording: Recording, spans: list[tuple[float, float]]) -> list[tuple[float, float]]:
    bounds = [float(recording.time[0]), *(edge for span in spans for edge in span)]
    bounds.append(float(recording.time[-1]) + recording.step)
    pairs = zip(bounds[::2], bounds[1::2], strict=True)
    return [(start, end) for start, end in pairs if end - start > recording.step]


def _afloat(recording: Recording) -> NDArray[np.bool_]:
    """Rows (N,) at the surface, or on the way up to it with the plane at rest."""
    afloat = np.zeros(recording.time.size, dtype=bool)
    depth = _smoothed(recording)
    if depth.size == 0 or depth.min() < ABOVE:
        return afloat
    shallow = np.diff(depth < LEFT, prepend=False, append=False)
    for first, end in np.flatnonzero(shallow).reshape(-1, 2):
        lasting, rudder = recording.intervals[first:end], recording.rudder[first:end]
        is_up, half = depth[first:end] < AFLOAT, MOSTLY * lasting.sum()
        is_at_rest = np.abs(rudder - np.median(rudder)) <= STILL
        if lasting[is_up & is_at_rest].sum() >= max(LONG_ENOUGH, half):
            afloat[_ascent(recording, int(first)) : end] = True
        elif depth.max() > DIVES and _is_left_at_last(depth, first, end, is_up, lasting):
            afloat[first:end] = True
    return afloat


def _is_left_at_last(depth: Array, first: int, end: int, is_up: NDArray[np.bool_], lasting: Array) -> bool:
    """Whether a hull that works its plane lies at the surface in these rows, or all but the last of them.

    Most missions begin or end so, and little is lost there: then a short while is enough.
    """
    is_an_end, share = first == 0 or end == depth.size, float(lasting[is_up].sum() / lasting.sum())
    lingers = is_an_end and share > LINGERS and float(lasting.sum()) < SOON
    keeps = lingers or _keeps(depth[first:end][is_up])
    return keeps and share >= MOSTLY and (is_an_end or lasting[is_up].sum() >= LONG_ENOUGH)


def _keeps(depth: Array) -> bool:
    """Whether a depth at the surface, m, hardly changes: that of a hull that dives by its plane does."""
    return depth.size > 0 and float(np.subtract(*np.percentile(depth, [75, 25]))) < KEPT


def _ascent(recording: Recording, first: int) -> int:
    """The row since which the plane is as it is in row `first`."""
    moved = np.abs(recording.rudder[:first] - recording.rudder[first]) > STILL
    early = recording.time[:first] < recording.time[first] - LONGEST_ASCENT
    return int(np.flatnonzero(moved | early)[-1]) + 1 if (moved | early).any() else 0


def _smoothed(recording: Recording) -> Array:
    """Running median of the depth (N,), m; empty where none is measured."""
    known = np.isfinite(recording.depth)
    if not known.any():
        return np.empty(0)
    depth = np.interp(recording.time, recording.time[known], recording.depth[known])
    rows = 2 * int(0.5 * SMOOTHED / recording.step) + 1
    return np.asarray(median_filter(depth, rows, mode="nearest"))
