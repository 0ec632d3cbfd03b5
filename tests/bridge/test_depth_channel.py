"""Depth from pressure or height: source, surface, repeats, range, steps."""

from collections import Counter
from math import inf, nan

import pytest

from bridge.depth_channel import DepthChannel
from bridge.mavlink_map import MavlinkMap

S = 1_000_000


def channel(**settings: object) -> tuple[DepthChannel, Counter[str], list[str]]:
    counts: Counter[str] = Counter()
    notes: list[str] = []
    settings = {"depth_source": "SCALED_PRESSURE2", "surface_pressure_hpa": 1013.25, **settings}
    return DepthChannel(MavlinkMap(**settings), counts, notes), counts, notes  # type: ignore[arg-type]


def test_depth_is_pressure_over_density_and_gravity() -> None:
    depth, _, _ = channel(water_density=1000.0, gravity=9.81)
    assert depth.from_pressure("SCALED_PRESSURE2", 1013.25 + 981.0, 0, 0) == pytest.approx(10.0)


def test_height_is_up_and_depth_is_down() -> None:
    depth, _, _ = channel(depth_source="VFR_HUD")
    assert depth.from_height("VFR_HUD", -4.0, 0, 0) == 4.0


def test_first_sample_in_air_is_the_surface_and_stays_it() -> None:
    depth, counts, notes = channel(surface_pressure_hpa=None)
    assert depth.from_pressure("SCALED_PRESSURE2", 980.0, 0, 0) == 0.0
    assert depth.from_pressure("SCALED_PRESSURE2", 1080.0, S, 1) == pytest.approx(0.995, abs=0.001)
    assert counts["note.surface_from_first_sample"] == 1
    assert len(notes) == 1


def test_first_sample_under_water_is_not_called_the_surface() -> None:
    depth, counts, _ = channel(surface_pressure_hpa=None)
    assert depth.from_pressure("SCALED_PRESSURE2", 2018.0, 0, 0) == pytest.approx(10.0, abs=0.01)
    assert counts["note.surface_standard"] == 1


def test_repeats_within_the_hold_are_dropped_and_a_resting_sensor_is_not() -> None:
    depth, counts, _ = channel(repeat_hold_s=0.15)
    kept = [
        t_us
        for t_us in range(0, S, 20_000)  # 50 Hz, value constant
        if depth.from_pressure("SCALED_PRESSURE2", 1100.0, t_us, 0) is not None
    ]
    assert kept == list(range(0, S, 160_000))
    assert counts["refused.repeat"] == 50 - len(kept)


def test_new_value_within_the_hold_is_kept() -> None:
    depth, counts, _ = channel()
    assert depth.from_pressure("SCALED_PRESSURE2", 1100.0, 0, 0) is not None
    assert depth.from_pressure("SCALED_PRESSURE2", 1100.1, 20_000, 0) is not None
    assert not counts


@pytest.mark.parametrize(
    ("hpa", "cause"),
    [(nan, "non_finite"), (inf, "non_finite"), (0.0, "range"), (-5.0, "range"), (1e9, "range")],
)
def test_nonsense_pressure_is_refused_by_cause(hpa: float, cause: str) -> None:
    depth, counts, _ = channel()
    assert depth.from_pressure("SCALED_PRESSURE2", hpa, 0, 0) is None
    assert counts == {f"refused.{cause}": 1}


def test_auto_prefers_the_outer_pressure_after_listening() -> None:
    depth, counts, notes = channel(depth_source="auto")
    for k in range(8):
        t_us = k * S // 2
        depth.from_height("VFR_HUD", -1.0, t_us, 0)
        depth.from_pressure("SCALED_PRESSURE", 1000.0 + k, t_us, 0)
        depth.from_pressure("SCALED_PRESSURE2", 1100.0 + k, t_us, 0)
        depth.from_pressure("SCALED_PRESSURE3", 0.0, t_us, 0)  # hijacked by a temperature sensor
    assert depth.source == "SCALED_PRESSURE2"
    assert counts["note.depth_source.SCALED_PRESSURE2"] == 1
    assert "SCALED_PRESSURE, VFR_HUD" in notes[0]
    assert counts["refused.depth_undecided"] > 0


def test_auto_takes_a_height_when_there_is_no_pressure() -> None:
    depth, _, _ = channel(depth_source="auto")
    values = [depth.from_height("AHRS2", -2.0, k * S, 0) for k in range(5)]
    assert values == [None, None, None, 2.0, 2.0]


def test_jump_no_vehicle_makes_is_kept_and_flagged() -> None:
    depth, counts, _ = channel(depth_source="VFR_HUD")
    for k, up in enumerate([-0.2, -0.1, 0.8, 0.7]):  # the barometer is zeroed again at the surface
        assert depth.from_height("VFR_HUD", up, 100_000 * k, 0) == -up
    assert counts == {"note.depth_step": 1}


def test_depth_after_a_restart_is_not_a_step() -> None:
    depth, counts, _ = channel(depth_source="VFR_HUD")
    depth.from_height("VFR_HUD", -10.0, 0, 0)
    depth.from_height("VFR_HUD", 0.0, 100_000, 1)
    assert not counts
