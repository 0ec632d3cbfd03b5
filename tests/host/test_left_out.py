"""Stretches that are left out as asked."""

import numpy as np
import pytest

from host.errors import RecordingError
from host.recordings.left_out import spans_in, without
from host.recordings.recording import Recording


def recording(name: str = "survey.csv", rows: int = 600) -> Recording:
    time = 0.5 * np.arange(rows)
    return Recording(
        name=name,
        sha256="0" * 64,
        time=time,
        depth=10.0 + np.sin(0.1 * time),
        pitch=0.1 * np.cos(0.1 * time),
        rudder=0.1 * np.sin(0.3 * time),
        speed=np.full(rows, np.nan),
        pitch_rate=np.full(rows, np.nan),
        step=0.5,
    )


def test_turns_are_left_out_and_told() -> None:
    pieces = without([recording()], spans_in("200-220.5, 60-80"))
    assert [(one.time[0], one.time[-1]) for one in pieces] == [(0.0, 59.5), (80.0, 199.5), (220.5, 299.5)]
    assert {one.notes for one in pieces} == {("left out as asked: 60 to 80 s, 200 to 220.5 s",)}


def test_scraps_between_two_stretches_go_with_them() -> None:
    pieces = without([recording()], spans_in("60-80,84-100"))
    assert [(one.time[0], one.time[-1]) for one in pieces] == [(0.0, 59.5), (100.0, 299.5)]


def test_nothing_asked_is_nothing_left_out() -> None:
    whole = [recording(), recording("other.csv")]
    assert without(whole, spans_in("")) is whole


@pytest.mark.parametrize("text", ["60", "60-x", "80-60", "-5-10", "60-80,", "60-80;90-95", "1e2-2e2"])
def test_what_is_no_stretch_is_told_in_one_line(text: str) -> None:
    with pytest.raises(RecordingError, match=r"^--leave-out .*START-END.* as 60-80,120-140$"):
        spans_in(text)


def test_seconds_of_several_files_are_ambiguous() -> None:
    with pytest.raises(RecordingError, match="takes one recording"):
        without([recording(), recording("other.csv")], [(60.0, 80.0)])


def test_a_file_of_which_nothing_is_left_is_refused() -> None:
    with pytest.raises(RecordingError, match=r"^survey\.csv: --leave-out leaves nothing of it$"):
        without([recording()], [(2.0, 298.0)])
