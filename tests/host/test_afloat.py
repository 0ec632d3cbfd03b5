"""What is at the surface is left out, and nothing else."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from host.recordings.afloat import under_water
from host.recordings.read import read_recordings
from host.recordings.recording import Array, Recording
from host.vehicle import default_vehicle, read_vehicle

STEP = 0.2  # s


def flown(rows: int) -> Array:
    return 0.1 * np.sin(0.3 * np.arange(rows))


DATA = Path(__file__).parent.parent / "data"
EXAMPLES = Path(__file__).parents[2] / "tools" / "examples"


def recording(depth: Array, rudder: Array | None = None, start: float = 0.0, name: str = "dive") -> Recording:
    nothing = np.full(depth.size, np.nan)
    return Recording(
        name=name,
        sha256="",
        time=start + STEP * np.arange(depth.size),
        depth=depth + 0.02 * np.random.default_rng(0).standard_normal(depth.size),
        pitch=0.1 * np.sin(np.arange(depth.size)),
        rudder=flown(depth.size) * (depth > 0.6) if rudder is None else rudder,
        speed=nothing,
        pitch_rate=nothing,
        step=STEP,
    )


def legs(*of: tuple[float, float]) -> Array:
    """Depth at these levels, m, each kept for so many seconds, with ramps of 0.5 m/s between."""
    parts = [np.full(round(of[0][1] / STEP), of[0][0])]
    for (before, _), (level, length) in pairwise(of):
        parts.append(np.linspace(before, level, max(2, round(abs(level - before) / 0.5 / STEP))))
        parts.append(np.full(round(length / STEP), level))
    return np.concatenate(parts)


def spans(pieces: list[Recording]) -> list[tuple[float, float]]:
    return [(float(piece.time[0]), float(piece.time[-1])) for piece in pieces]


def test_a_mission_is_cut_to_its_dives() -> None:
    mission = recording(legs((0.1, 60.0), (6.0, 120.0), (0.1, 40.0), (4.0, 100.0), (0.2, 60.0)))
    first, second = under_water([mission])
    assert first.time[0] == pytest.approx(62.0, abs=1.0)
    assert first.time[-1] == pytest.approx(202.0, abs=1.5)
    assert second.time[0] == pytest.approx(246.0, abs=2.0)
    assert min(piece.depth.min() for piece in (first, second)) > 0.8
    assert first.notes == second.notes
    assert first.notes[0].startswith("at the surface, and left out: 0 to 62 s, ")


def test_floating_up_with_the_plane_at_rest_belongs_to_the_surface() -> None:
    depth = legs((3.0, 120.0), (0.1, 60.0))
    rudder = np.where(STEP * np.arange(depth.size) < 110.0, 0.1 * np.sin(np.arange(depth.size)), 0.02)
    (dive,) = under_water([recording(depth, rudder)])
    assert dive.time[-1] == pytest.approx(110.0, abs=1.0)


def test_a_plane_always_at_rest_costs_a_minute_of_the_ascent_at_most() -> None:
    depth = legs((30.0, 60.0), (10.0, 100.0), (0.1, 60.0))
    (dive,) = under_water([recording(depth, np.zeros(depth.size))])
    assert dive.time[-1] == pytest.approx(60.0 + 40.0 + 100.0 + 18.0 - 60.0, abs=2.0)


@pytest.mark.parametrize(
    "depth",
    [
        legs((3.0, 60.0), (0.3, 8.0), (3.0, 100.0)),
        legs((0.8, 200.0), (2.0, 50.0)),
        legs((0.8, 100.0), (0.3, 30.0), (0.8, 100.0), (3.0, 100.0)),
        legs((0.1, 100.0), (-0.7, 60.0), (4.0, 100.0)),
        np.full(1000, 0.1),
        np.full(1000, np.nan),
    ],
    ids=[
        "a short visit",
        "a shallow leg",
        "waves above one",
        "depth from elsewhere",
        "never under water",
        "no depth",
    ],
)
def test_what_is_no_surface_stays(depth: Array) -> None:
    whole = recording(depth)
    (same,) = under_water([whole])
    assert same is whole


def test_a_plane_that_works_at_depth_zero_is_no_surface() -> None:
    """As in simulations that begin there."""
    depth = legs((0.1, 60.0), (4.0, 120.0))
    wave = np.where(depth < 1.0, 0.3 * np.sin(0.1 * np.arange(depth.size)), 0.0)
    whole = recording(depth + wave, flown(depth.size))
    assert under_water([whole]) == [whole]
    assert len(under_water([recording(depth)])[0].time) < depth.size


@pytest.mark.parametrize("seconds", [8.0, 60.0])
def test_a_mission_that_begins_and_ends_at_the_surface_with_its_plane_at_work_is_cut(seconds: float) -> None:
    depth = legs((0.1, seconds), (4.0, 120.0), (0.2, seconds))
    (dive,) = under_water([recording(depth, flown(depth.size))])
    assert dive.depth.min() > 0.8
    assert "at the surface, and left out" in dive.notes[-1]
    shallow = recording(legs((0.1, seconds), (1.5, 120.0)), flown(legs((0.1, seconds), (1.5, 120.0)).size))
    assert under_water([shallow]) == [shallow]


@pytest.mark.parametrize(
    ("lingering", "leaving", "is_cut"), [(14.0, 1.5, True), (14.0, 14.0, False), (60.0, 1.5, False)]
)
def test_a_hull_that_leaves_the_surface_at_last_has_been_there_till_then(
    lingering: float, leaving: float, is_cut: bool
) -> None:
    """Not one that sinks evenly, nor one that is so shallow for long: its depth may count from elsewhere."""
    slowly = np.linspace(0.05, 0.48, round(lingering / STEP))
    depth = np.concatenate(
        [slowly, np.linspace(0.48, 1.0, round(leaving / STEP)), legs((1.0, 0.0), (9.0, 120.0))]
    )
    (dive,) = under_water([recording(depth, flown(depth.size))])
    assert (dive.duration < depth.size * STEP - 10.0) == is_cut


@pytest.mark.parametrize(("seconds", "is_cut"), [(8.0, False), (40.0, True)])
def test_between_two_dives_a_short_time_near_the_surface_is_no_reason_to_cut(
    seconds: float, is_cut: bool
) -> None:
    depth = legs((4.0, 100.0), (0.2, seconds), (4.0, 100.0))
    assert (len(under_water([recording(depth, flown(depth.size))])) > 1) == is_cut


def test_spikes_and_losses_at_the_surface_are_no_dive() -> None:
    depth = legs((0.1, 60.0), (5.0, 120.0))
    depth[50:53] = 80.0
    depth[100:140] = np.nan
    (dive,) = under_water([recording(depth)])
    assert dive.time[0] > 60.0


def test_of_a_file_in_stretches_those_at_the_surface_go() -> None:
    stretches = [
        recording(np.full(200, 0.1)),
        recording(np.full(1000, 5.0), start=100.0),
        recording(np.full(300, 5.0), name="other", start=0.0),
    ]
    dive, other = under_water(stretches)
    assert spans([dive])[0] == (100.0, pytest.approx(100.0 + 999 * STEP))
    assert dive.notes == ("at the surface, and left out: 0 to 40 s",)
    assert other.notes == ()


def test_a_real_glider_is_cut_where_it_calls_home() -> None:
    vehicle = read_vehicle(EXAMPLES / "slocum.toml")
    (dive,) = under_water(read_recordings(DATA / "slocum" / "comet-2016-174-05-008.csv", vehicle))
    assert spans([dive])[0] == (pytest.approx(54.0, abs=1.0), pytest.approx(722.0, abs=10.0))
    assert dive.notes[-1] == "at the surface, and left out: 726 to 1014 s"


@pytest.mark.parametrize("path", sorted((DATA / "simulators").glob("*.csv")), ids=lambda path: path.stem)
def test_simulators_that_never_surface_stay_whole(path: Path) -> None:
    recordings = read_recordings(path, default_vehicle())
    assert [a is b for a, b in zip(under_water(recordings), recordings, strict=True)] == [True]
