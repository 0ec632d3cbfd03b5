"""Pacing, and the command line of the simulated vehicle."""

import argparse
import os
import signal
import socket
import threading
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from bridge.errors import LinkError
from host.errors import ConfigError
from tools.commands import sitl
from tools.sitl.recording import sail
from tools.sitl.scenario import load
from tools.sitl.schedule import Pace, Timetable
from tools.sitl.track import Track
from tools.sitl.voyage import sail_live


class Ticker:
    """A vehicle with something to do every 0.1 s, on a clock that only waiting moves."""

    def __init__(self, track: Track) -> None:
        self.track = track
        self.clock_s = 100.0
        self.sent: Counter[str] = Counter()
        self.heard: Counter[str] = Counter()
        self.next_s = 0.0
        self.log: list[tuple[float, float]] = []

    def emit(self, t_s: float) -> None:
        assert self.track.now.t_s >= t_s - 1e-9
        self.log.append((t_s, self.clock_s - 100.0))
        self.clock_s += 0.002  # work takes time
        self.next_s = len(self.log) * 0.1

    def listen(self, timeout_s: float) -> None:
        assert 0.0 <= timeout_s <= 0.2
        self.clock_s += timeout_s + 1e-6


@pytest.mark.parametrize("speed", [0.5, 1.0, 20.0])
def test_pace_does_not_drift(speed):
    track = Track(load("default"), 1)
    ticker = Ticker(track)
    sail_live(track, ticker, Pace(speed, lambda: ticker.clock_s), 30.0, lambda: False, lambda: None)
    assert len(ticker.log) == 301
    assert [wall * speed for _, wall in ticker.log] == pytest.approx(
        [t_s for t_s, _ in ticker.log], abs=0.005 * speed
    )


def test_stop_is_heard_at_once():
    track = Track(load("default"), 1)
    ticker = Ticker(track)
    sail_live(
        track, ticker, Pace(1.0, lambda: ticker.clock_s), 0.0, lambda: len(ticker.log) == 7, lambda: None
    )
    assert len(ticker.log) == 7


def test_track_interpolates_motion_and_holds_the_command():
    scenario = load("default")
    truth = sail(scenario, 1)
    track = Track(scenario, 1)
    track.advance(12.34)
    assert track.now.t_s == pytest.approx(12.34)
    assert track.value("depth", 12.335) == pytest.approx(
        (truth["depth_m"][1233] + truth["depth_m"][1234]) / 2
    )
    change = int(np.flatnonzero(np.diff(truth["rudder_rad"][:1234]))[-1]) + 1
    track = Track(scenario, 1)
    track.advance(change * 0.01)
    assert track.value("rudder", change * 0.01 - 0.001) == truth["rudder_rad"][change - 1]
    assert track.value("rudder", change * 0.01) == truth["rudder_rad"][change]


def test_timetable_keeps_to_multiples_of_its_interval():
    table = Timetable(10.0, 0.0, np.random.default_rng(1))
    due = []
    for _ in range(3):
        due.append(table.due_s)
        table.advance()
    assert due == pytest.approx([0.0, 0.1, 0.2])
    table.set_rate(4.0, 0.3)
    assert table.due_s == 0.5
    table.set_rate(0.0, 1.0)
    assert table.due_s == float("inf")
    table.set_rate(10.0, 7.0)
    assert table.due_s == pytest.approx(7.1)


def run(*words: str) -> int:
    parser = argparse.ArgumentParser()
    sitl.add_arguments(parser)
    return sitl.run(parser.parse_args(list(words)))


@pytest.fixture
def listener():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ground:
        ground.bind(("127.0.0.1", 0))
        ground.settimeout(2.0)
        yield ground


def test_recording_without_a_link(tmp_path: Path, capsys):
    record, truth = tmp_path / "rec.csv", tmp_path / "truth.csv"
    words = ("--link", "none", "--duration", "20", "--record", str(record), "--truth", str(truth))
    assert run(*words, "--seed", "5") == 0
    assert "default: 20 s simulated with seed 5" in capsys.readouterr().out
    first = record.read_text()
    assert first.startswith("time_s,depth_m,pitch_rad,rudder_rad,speed_mps,pitch_rate_radps\n")
    assert len(first.splitlines()) == len(truth.read_text().splitlines()) == 202
    assert run(*words, "--seed", "6", "--quiet") == 0
    assert capsys.readouterr().out == ""
    assert record.read_text() != first


def test_live_run_sends_records_and_reports(tmp_path: Path, capsys, listener):
    record, truth = tmp_path / "rec.csv", tmp_path / "truth.csv"
    port = listener.getsockname()[1]
    words = ("--link", f"udpout:127.0.0.1:{port}", "--speed", "50", "--duration", "6")
    assert run(*words, "--record", str(record), "--truth", str(truth)) == 0
    parser = mavlink.MAVLink(None)
    got: Counter[str] = Counter()
    listener.setblocking(False)
    try:
        while True:
            got.update(message.get_type() for message in parser.parse_buffer(listener.recv(65536)))
    except BlockingIOError:
        pass
    assert got["ATTITUDE"] == got["SCALED_PRESSURE2"] == 61
    out = capsys.readouterr().out
    assert "Ctrl-C stops" in out.splitlines()[0]
    assert f"t     6.0 s  depth {sail_depth():6.2f} m" in out.splitlines()[-1]
    assert f"sent {got.total()}" in out
    measured = np.genfromtxt(record, delimiter=",", names=True)
    assert len(truth.read_text().splitlines()) == 1 + 61
    measured = measured[np.isfinite(measured["depth_m"])]  # the speed comes at other times too
    true = np.genfromtxt(truth, delimiter=",", names=True, usecols=range(11))
    assert np.std(measured["depth_m"] - true["depth_m"]) == pytest.approx(0.01, rel=0.3)
    assert np.array_equal(measured["rudder_rad"], true["rudder_rad"])


def sail_depth() -> float:
    return float(sail(load("default"), 1)["depth_m"][600])


def test_live_run_on_a_virtual_bus(capsys):
    assert run("--link", "can:virtual:sitl-command", "--speed", "100", "--duration", "10") == 0
    assert "sent 505" in capsys.readouterr().out


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_stops_cleanly_and_keeps_the_record(tmp_path: Path, listener, number):
    port = listener.getsockname()[1]
    before = signal.getsignal(number)
    timer = threading.Timer(0.4, os.kill, (os.getpid(), number))
    timer.start()
    record = tmp_path / "rec.csv"
    assert (
        run("--link", f"udpout:127.0.0.1:{port}", "--duration", "0", "--record", str(record), "--quiet") == 0
    )
    assert 3 <= len(record.read_text().splitlines()) <= 50
    assert signal.getsignal(number) is before


@pytest.mark.parametrize(
    ("words", "error", "says"),
    [
        (("--scenario", "no_such"), ConfigError, "no_such cannot be read"),
        (("--speed", "0"), ConfigError, "--speed must be a number > 0"),
        (("--speed", "inf"), ConfigError, "--speed must be a number > 0"),
        (("--duration", "-1"), ConfigError, "--duration must be a number >= 0"),
        (("--seed", "-1"), ConfigError, "--seed must be >= 0"),
        (("--link", "none"), ConfigError, "--record or --truth"),
        (("--link", "none", "--duration", "0", "--record", "x.csv"), ConfigError, "duration_s must be > 0"),
        (("--link", "pigeon:1"), LinkError, "link must begin with"),
        (("--link", "can:socketcan:no_such9"), LinkError, "cannot be opened"),
        (("--link", "serial:/dev/no_such_tty:57600"), LinkError, "opened: No such file or directory;"),
    ],
)
def test_bad_usage_is_one_line(words, error, says):
    with pytest.raises(error, match=says) as caught:
        run(*words)
    assert "\n" not in str(caught.value)


def test_record_that_cannot_be_written_is_an_os_error():
    with pytest.raises(OSError, match="No such file or directory"):
        run("--link", "none", "--record", "/no/such/folder/rec.csv", "--duration", "5")
