"""The status of a sender, and that nobody reading it stops nothing."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tools.sitl.recording import record, write_csv
from tools.sitl.scenario import parse
from tools.status_line import StatusLine

ROOT = Path(__file__).parents[2]


def test_without_a_terminal_only_the_first_and_the_last_line_are_said(
    capsys: pytest.CaptureFixture[str],
) -> None:
    status = StatusLine(lambda: "t 1 s", is_quiet=False)
    status.begin("starting")
    for _ in range(3):
        status.tell()
    status.finish()
    assert capsys.readouterr().out == "starting\nt 1 s\n"


def test_quiet_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    status = StatusLine(lambda: "t 1 s", is_quiet=True)
    status.begin("starting")
    status.finish()
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("command", ["sitl", "replay"])
def test_a_reader_that_has_gone_does_not_stop_the_frames(tmp_path: Path, command: str) -> None:
    sent = tmp_path / "sent.csv"
    words = ["sitl", "--duration", "2", "--speed", "50", "--record", str(sent)]
    if command == "replay":
        write_csv(sent, record(parse("duration_s = 2.0"), 1))
        words = ["replay", str(sent), "--speed", "50"]
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "tools.cli", *words, "--link", "udpout:127.0.0.1:9"],
        cwd=ROOT,
        stdout=writer,
        stderr=subprocess.PIPE,
        text=True,
        timeout=60,
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, "")
    assert len(sent.read_text().splitlines()) > 20
