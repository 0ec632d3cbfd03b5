"""`mils run` from its command line: logs, a live UDP link, signals, and what it says."""

import argparse
import re
import signal
import socket
import struct
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LinkError
from bridge.measurement import Quantity
from firmware_model.config import EstimatorConfig
from firmware_model.vertical_plane import VerticalPlaneEstimator
from host.errors import ConfigError, HostError
from host.live.journal import read_journal
from host.live.loop import Progress
from tools.commands import run as command

ROOT = Path(__file__).parents[2]
H = 0.1
VEHICLE = """
name = "test"
speed = 2.0
[journal]
folder = "journals"
[mavlink]
depth_source = "SCALED_PRESSURE2"
surface_pressure_hpa = 1013.25
rudder = [{ channel = 1, rad_per_us = 0.001 }]
"""


def frames(steps: int, rudder: bool = True) -> list[list[bytes]]:
    """What an autopilot with the linear vehicle behind it sends, ten times a second."""
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    w = q = theta = 0.0
    depth = 10.0
    out = []
    for k in range(steps):
        pulse = 1700 if (k // 17 + k // 41) % 2 else 1300
        delta = (pulse - 1500) * 0.001
        ms = 10_000 + 100 * k
        messages = [
            mav.attitude_encode(ms, 0.0, theta, 0.0, 0.0, q, 0.0),
            mav.scaled_pressure2_encode(ms, 1013.25 + depth * 1025 * 9.80665 / 100, 0.0, 0),
        ]
        if rudder:
            messages.append(mav.servo_output_raw_encode(1000 * ms, 0, pulse, *[0] * 7))
        if k % 10 == 0:
            messages.insert(0, mav.heartbeat_encode(dialect.MAV_TYPE_SUBMARINE, 3, 0, 0, 4))
        out.append([bytes(message.pack(mav)) for message in messages])
        w, q, theta, depth = (
            w + H * (-0.6 * w + 0.4 * delta),
            q + H * (-3.4 * q - 8.2 * theta - 3.9 * delta),
            theta + H * q,
            depth + H * (w - 2.0 * theta),
        )
    return out


def write_tlog(path: Path, instants: list[list[bytes]]) -> None:
    stamp = 1_700_000_000_000_000
    records = (
        struct.pack(">Q", stamp + 100_000 * k) + frame
        for k, instant in enumerate(instants)
        for frame in instant
    )
    path.write_bytes(b"".join(records))


@pytest.fixture
def vehicle(tmp_path: Path) -> Path:
    path = tmp_path / "vehicle.toml"
    path.write_text(VEHICLE)
    return path


def parse(*arguments: object) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    return parser.parse_args([str(argument) for argument in arguments])


def test_a_log_is_run_like_a_link(tmp_path: Path, vehicle: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "dive.tlog"
    write_tlog(log, frames(600))
    journal = tmp_path / "out" / "dive.jsonl"
    code = command.run(
        parse(vehicle, "--link", f"log:{log}", "--speed", "inf", "--journal", journal, "--no-state")
    )
    captured = capsys.readouterr()
    assert code == 0
    assert f"journal: {journal}" in captured.out
    assert "the log has ended" in captured.out
    assert re.search(r"a3 -8\.\d+\+-0\.\d+ 1/s\^2\n", captured.out)
    assert len(read_journal(journal).measurements) > 2000
    assert not list(tmp_path.glob("**/*.state.json"))


def test_a_quantity_that_never_came_is_named_with_what_to_check(
    tmp_path: Path, vehicle: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "dive.tlog"
    write_tlog(log, frames(50, rudder=False))
    code = command.run(parse(vehicle, "--link", f"log:{log}", "--speed", "inf", "--journal", tmp_path))
    error = capsys.readouterr().err
    assert code == 1
    assert "no rudder came, check [mavlink] rudder" in error
    assert "no depth" not in error


def test_nothing_at_all_is_said(tmp_path: Path, vehicle: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = command.run(
        parse(vehicle, "--link", "udp:127.0.0.1:0", "--duration", "0.3", "--journal", tmp_path, "--quiet")
    )
    assert code == 1
    assert "nothing usable came on udp:127.0.0.1:0" in capsys.readouterr().err


def test_bad_usage_and_links_that_do_not_open_are_errors(tmp_path: Path, vehicle: Path) -> None:
    for arguments, error, words in [
        (("--duration", "0"), ConfigError, "--duration must be above 0"),
        (("--duration", "nan"), ConfigError, "--duration must be above 0"),
        (("--speed", "0"), ConfigError, "command line: link.log_speed must be above 0"),
        (("--link", "nowhere"), ConfigError, "command line: link.url must be"),
        (("--link", "carrier:pigeon"), LinkError, "carrier:pigeon"),
        (("--link", "serial:/dev/none"), LinkError, "/dev/none"),
    ]:
        with pytest.raises(error, match=re.escape(words)):
            command.run(parse(vehicle, "--journal", tmp_path / "journals", *arguments))
    assert not (tmp_path / "journals").exists()


def test_a_port_in_use_is_an_error(tmp_path: Path, vehicle: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        with pytest.raises(LinkError, match=str(port)):
            command.run(parse(vehicle, "--link", f"udp:127.0.0.1:{port}", "--journal", tmp_path))


def test_a_journal_that_cannot_be_created_closes_the_link(tmp_path: Path, vehicle: Path) -> None:
    (tmp_path / "file").write_text("")
    for _ in range(2):
        with pytest.raises(HostError, match="journal cannot be created"):
            command.run(parse(vehicle, "--link", "udp:127.0.0.1:14999", "--journal", tmp_path / "file" / "x"))


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.mark.parametrize("name", ["SIGTERM", "SIGINT"])
def test_a_signal_ends_a_live_run_with_everything_kept(tmp_path: Path, vehicle: Path, name: str) -> None:
    port, journal = free_port(), tmp_path / "dive.jsonl"
    program = (
        "import argparse, sys\n"
        "from tools.commands import run\n"
        "parser = argparse.ArgumentParser()\n"
        "run.add_arguments(parser)\n"
        "sys.exit(run.run(parser.parse_args(sys.argv[1:])))\n"
    )
    arguments = [str(vehicle), "--link", f"udp:127.0.0.1:{port}", "--journal", str(journal)]
    process = subprocess.Popen(
        [sys.executable, "-c", program, *arguments],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 15
    while not journal.exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    answers = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle_socket:
        vehicle_socket.setblocking(False)
        for instant in frames(200):
            vehicle_socket.sendto(b"".join(instant), ("127.0.0.1", port))
            time.sleep(0.002)
        while len(read_journal(journal).measurements) < 790 and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(getattr(signal, name))
        out, err = process.communicate(timeout=10)
        for _ in range(1000):
            try:
                answers.append(vehicle_socket.recv(65535))
            except BlockingIOError:
                break
    assert process.returncode == 0, err
    assert f"stopped by {name}" in out
    assert "Traceback" not in err
    measurements = read_journal(journal).measurements
    counts = {quantity: sum(m.quantity is quantity for m in measurements) for quantity in Quantity}
    assert counts[Quantity.PITCH] == counts[Quantity.RUDDER] == 200
    assert counts[Quantity.DEPTH] >= 190
    assert (tmp_path / "journals" / "test.state.json").exists()
    # The vehicle was asked for its rates and given the estimates.
    mav = dialect.MAVLink(None)
    names = {m.get_type() for answer in answers for m in mav.parse_buffer(answer) or []}
    assert {"COMMAND_LONG", "NAMED_VALUE_FLOAT"} <= names


def progress(seconds: float) -> Progress:
    estimate = VerticalPlaneEstimator(EstimatorConfig(step=0.1, speed=2.0)).estimate()
    return Progress(
        seconds=seconds,
        measurements=Counter(),
        samples=Counter(UPDATED=7),
        refused=Counter(crc=2),
        estimate=estimate,
        never_heard=(),
        lost_lines=0,
    )


def test_progress_on_a_pipe_is_a_line_every_ten_seconds(capsys: pytest.CaptureFixture[str]) -> None:
    display = command._Display(is_quiet=False)
    for second in range(1, 31):
        display.show(progress(second))
    lines = capsys.readouterr().err.splitlines()
    assert [line.split()[0] for line in lines] == ["1", "11", "21"]
    assert "7 samples, 2 refused" in lines[0]


def test_progress_on_a_terminal_is_one_line_rewritten(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "60")
    display = command._Display(is_quiet=False)
    display.show(progress(1))
    display.say("link lost")
    display.show(progress(2))
    display.finish()
    error = capsys.readouterr().err
    assert error.count("\n") == 2
    assert error.count("\r\x1b[K") == 3
    assert all(len(line) < 60 for line in re.split(r"\r\x1b\[K|\n", error))


def test_quiet_silences_progress_and_not_what_went_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    display = command._Display(is_quiet=True)
    display.show(progress(1))
    display.say("link lost")
    assert capsys.readouterr().err == "link lost\n"
