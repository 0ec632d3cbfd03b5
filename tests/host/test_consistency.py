"""Depth positive up, pitch nose down, other units: one line says so before physics is named for it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from host.diagnosis.diagnose import diagnose
from host.errors import RecordingError
from host.identification.identify import identify
from host.recordings.consistency import check_signs, depth_by_pitch, units_note
from host.recordings.recording import Recording
from host.vehicle import default_vehicle
from tests.diagnosis.hidden_dive import hidden_dive, slowing


def rising(recording: Recording) -> Recording:
    return replace(recording, depth=-recording.depth)


def nose_down(recording: Recording) -> Recording:
    return replace(recording, pitch=-recording.pitch)


@pytest.mark.parametrize("turned", [rising, nose_down])
@pytest.mark.parametrize("dive", [hidden_dive(duration=60.0), slowing(0.05)])
def test_one_wrong_sign_is_told(turned: Callable[[Recording], Recording], dive: Recording) -> None:
    check_signs([dive])
    assert depth_by_pitch([dive])[0] > 0.9
    with pytest.raises(RecordingError, match=r"the vehicle sinks where its nose is up .*sign = -1") as told:
        check_signs([turned(dive)])
    assert "\n" not in str(told.value)


def test_a_speed_astern_is_told() -> None:
    dive = slowing(0.05)
    with pytest.raises(RecordingError, match=r"the measured speed is negative .*\[csv.speed\]"):
        check_signs([replace(dive, speed=-dive.speed)])


def test_bench_commands_stop_there() -> None:
    wrong = [rising(hidden_dive(duration=60.0))]
    for command in (lambda: diagnose(wrong), lambda: identify(wrong, default_vehicle())):
        with pytest.raises(RecordingError, match="nose is up"):
            command()


def test_gaps_and_recordings_that_say_nothing_are_no_wrong_signs() -> None:
    dive = hidden_dive(duration=60.0)
    holes = np.random.default_rng(2).random(dive.time.size) < 0.5
    holed = replace(
        dive, depth=np.where(holes, np.nan, dive.depth), pitch=np.where(holes, dive.pitch, np.nan)
    )
    assert depth_by_pitch([holed])[0] > 0.9
    level = replace(dive, pitch=np.zeros_like(dive.pitch))
    silent = replace(dive, pitch=np.full_like(dive.pitch, np.nan))
    for nothing in (level, silent, dive.between(0.0, 4.0)):
        assert depth_by_pitch([nothing]) == (0.0, 0.0)
    assert depth_by_pitch([silent, dive]) == pytest.approx(depth_by_pitch([dive]))


def test_a_plane_that_is_mounted_the_other_way_is_noted() -> None:
    dive = hidden_dive(duration=60.0)
    there, back = (
        identify([dive], default_vehicle()),
        identify([replace(dive, rudder=-dive.rudder)], default_vehicle()),
    )
    assert not any("against the convention" in note for note in there.notes)
    assert any("b2 > 0), against the convention" in note for note in back.notes)


def test_depth_in_feet_and_speed_in_knots_are_noted_where_the_speed_is_measured() -> None:
    dive = slowing(0.05)
    feet, knots = replace(dive, depth=dive.depth / 0.3048), replace(dive, speed=dive.speed * 0.5144)
    assert units_note([dive]) is None
    assert units_note([replace(feet, speed=np.full_like(dive.speed, np.nan))]) is None
    assert "depth changes 5.7 times as fast" in (units_note([feet]) or "")
    assert "depth changes 3.4 times as fast" in (units_note([knots]) or "")
    found = identify([feet], default_vehicle())
    assert any("in another unit" in note for note in found.notes)
