"""The journal keeps everything: killed processes, full disks, taken names."""

import json
import math
import resource
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.measurement import Measurement, Quantity
from host.errors import HostError, RecordingError
from host.live.journal import Journal, read_journal

ROOT = Path(__file__).parents[2]


def measurement(k: int) -> Measurement:
    quantity = list(Quantity)[k % 5]
    return Measurement(quantity=quantity, value=math.sin(k), t_us=k * 20_000, source="ATTITUDE", boot=k // 50)


def open_journal(place: Path, warnings: list[str] | None = None) -> Journal:
    return Journal(
        place,
        vehicle="Lauv 1/ü",
        configuration={"alignment": {"step": 0.1}},
        wall_s=lambda: 1_700_000_000.0,
        warn=(warnings if warnings is not None else []).append,
    )


def test_a_journal_reads_back_what_was_written(tmp_path: Path) -> None:
    journal = open_journal(tmp_path / "new" / "folder")
    sent = [measurement(k) for k in range(100)]
    journal.measurements(sent[:60])
    journal.estimate(7, {"a1": -0.6, "a1_std": math.inf, "status": "UPDATED"})
    journal.event("reboot", "the clock started anew")
    journal.measurements(sent[60:])
    journal.measurements([])
    journal.close()
    journal.close()
    assert journal.path.name == "Lauv_1_ü-20231114-221320.jsonl"
    reading = read_journal(journal.path)
    assert list(reading.measurements) == sent
    assert reading.estimates == ({"estimate": {"a1": -0.6, "a1_std": None, "status": "UPDATED"}, "t_us": 7},)
    assert [event["event"] for event in reading.events] == ["reboot"]
    assert reading.header["vehicle"] == "Lauv 1/ü"
    assert reading.header["configuration"] == {"alignment": {"step": 0.1}}
    assert reading.header["started"] == "2023-11-14T22:13:20.000+00:00"
    assert reading.counts == {"measurement": 100, "estimate": 1, "event": 1}
    assert reading.notes == ()
    for line in journal.path.read_text().splitlines():
        json.loads(line, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


def test_a_taken_name_gets_a_counter(tmp_path: Path) -> None:
    place = tmp_path / "dive.jsonl"
    paths = [open_journal(place).path.name for _ in range(3)]
    assert paths == ["dive.jsonl", "dive-2.jsonl", "dive-3.jsonl"]


def test_a_place_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(HostError, match="journal cannot be created") as error:
        open_journal(tmp_path / "file" / "below")
    assert "\n" not in str(error.value)


def test_a_killed_writer_loses_nothing_it_reported(tmp_path: Path) -> None:
    program = f"""
import sys
sys.path[:0] = [{str(ROOT)!r}, {str(Path(__file__).parent)!r}]
from pathlib import Path
from test_journal import measurement, open_journal
journal = open_journal(Path({str(tmp_path)!r}) / "dive.jsonl")
for k in range(10**9):
    journal.measurements([measurement(k)])
    print(k, flush=True)
"""
    writer = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert writer.stdout is not None
    for line in writer.stdout:
        if int(line) >= 500:
            break
    writer.send_signal(signal.SIGKILL)
    reported = [*(int(line) for line in writer.stdout if line.endswith("\n")), 500][-2:]
    assert writer.wait() == -signal.SIGKILL
    reading = read_journal(tmp_path / "dive.jsonl")
    assert list(reading.measurements) == [measurement(k) for k in range(len(reading.measurements))]
    assert len(reading.measurements) > max(reported)


@contextmanager
def file_size_limit(size: int) -> Iterator[None]:
    """Stands for a full disk: a write is cut short at `size` bytes, and the next one fails."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_full_disk_is_said_once_and_writing_goes_on_when_there_is_room(tmp_path: Path) -> None:
    warnings: list[str] = []
    journal = open_journal(tmp_path, warnings)
    journal.measurements([measurement(0)])
    size = journal.path.stat().st_size
    with file_size_limit(size + 150):
        for k in range(1, 10):
            journal.measurements([measurement(k)])
    assert len(warnings) == 1
    assert "File too large" in warnings[0]
    journal.measurements([measurement(10)])
    journal.close()
    reading = read_journal(journal.path)
    kept = [m.t_us // 20_000 for m in reading.measurements]
    assert kept == [0, 1, 10]
    assert journal.lost == 8
    assert reading.counts["damaged"] == 1
    assert reading.notes == ("1 damaged lines were left out",)


def test_a_disk_full_from_the_start_is_an_error(tmp_path: Path) -> None:
    with file_size_limit(50), pytest.raises(HostError, match="cannot be written"):
        open_journal(tmp_path)


def test_a_lost_medium_is_said_when_it_is_synced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    warnings: list[str] = []
    journal = open_journal(tmp_path, warnings)

    def broken(_: int) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr("host.live.journal.os.fsync", broken)
    journal.sync()
    journal.sync()
    assert len(warnings) == 1
    assert "Input/output error" in warnings[0]


@given(data=st.data())
def test_a_journal_cut_anywhere_gives_every_whole_line(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    journal = open_journal(tmp_path_factory.mktemp("cut"))
    header = journal.path.stat().st_size
    sent = [measurement(k) for k in range(20)]
    journal.measurements(sent)
    journal.close()
    whole = journal.path.read_bytes()
    cut = data.draw(st.integers(header, len(whole)))
    journal.path.write_bytes(whole[:cut])
    reading = read_journal(journal.path)
    complete = whole[:cut].count(b"\n") - 1
    # A line that lacks nothing but its end is whole too.
    assert len(reading.measurements) - complete in (0, 1)
    assert list(reading.measurements) == sent[: len(reading.measurements)]
    is_cut = whole[:cut].split(b"\n")[-1] != b"" and len(reading.measurements) == complete
    assert reading.notes == (
        ("the last line is cut: the program was stopped while writing it",) if is_cut else ()
    )


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\xff\xfe\x00garbage" * 100,
        b"time_s,depth_m\n0,1\n",
        b"[]\n",
        b'{"journal": 99}\n',
        b"[" * 100_000,
    ],
)
def test_what_is_no_journal_is_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "dive.jsonl"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="journal") as error:
        read_journal(path)
    assert "\n" not in str(error.value)


def test_a_missing_journal_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="No such file"):
        read_journal(tmp_path / "none.jsonl")


@pytest.mark.parametrize(
    "line",
    [
        b'{"measurement":"height","value":1,"t_us":1,"boot":0}',
        b'{"measurement":"depth","value":"x","t_us":1,"boot":0}',
        b'{"measurement":"depth","value":null,"t_us":1,"boot":0}',
        b'{"measurement":"depth","value":NaN,"t_us":1,"boot":0}',
        b'{"measurement":"depth","value":1' + b"0" * 400 + b',"t_us":1,"boot":0}',
        b'{"measurement":"depth","value":1,"t_us":1.5,"boot":0}',
        b'{"measurement":"depth","value":1,"t_us":1}',
        b"\x00" * 64,
        b"3",
    ],
)
def test_a_damaged_line_is_counted_and_the_rest_is_read(tmp_path: Path, line: bytes) -> None:
    journal = open_journal(tmp_path)
    journal.measurements([measurement(0)])
    with journal.path.open("ab") as file:
        file.write(line + b"\n")
    journal.measurements([measurement(1)])
    journal.close()
    reading = read_journal(journal.path)
    assert list(reading.measurements) == [measurement(0), measurement(1)]
    assert reading.counts["damaged"] == 1
