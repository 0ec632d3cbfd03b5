"""What a log holds, for people."""

import sys
from pathlib import Path

import pytest

from tools import log_counts

DATA = Path(__file__).parents[1] / "data"
EXAMPLES = Path(log_counts.__file__).parent / "examples"


def counted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *words: object
) -> tuple[int, str]:
    monkeypatch.setattr(sys, "argv", ["log_counts", *map(str, words)])
    code = log_counts.main()
    captured = capsys.readouterr()
    return code, captured.out + captured.err


def test_can_frames_are_counted_without_a_vehicle_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "bus.log"
    log.write_text("(1.0) can0 09F11223#0011\n(1.1) can0 09F11223#0012\n(1.2) can0 123#00\nnoise\n")
    code, text = counted(monkeypatch, capsys, log)
    assert code == 0
    assert "3 messages" in text
    assert "  09F11223 (PGN 127250) 2" in text
    assert "  123 1" in text
    assert "  refused.line 1" in text
    assert "note: what the frames mean: --vehicle" in text
    _, named = counted(monkeypatch, capsys, log, "--vehicle", EXAMPLES / "nmea2000.toml")
    assert "  NMEA2000 127250 2" in named


def test_mavlink_is_counted_by_message(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, text = counted(monkeypatch, capsys, DATA / "ardusub" / "small.tlog")
    assert code == 0
    assert "-> pitch from ATTITUDE, boot 0" in text


@pytest.mark.parametrize("name", ["none.log", "none.tlog", "none.xyz"])
def test_a_log_that_cannot_be_read_is_one_line(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, text = counted(monkeypatch, capsys, tmp_path / name)
    assert code == 2
    assert text.count("\n") == 1
    assert name in text
