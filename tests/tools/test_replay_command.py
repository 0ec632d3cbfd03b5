"""`mils replay`: what leaves on the link is what the log holds, when it is due."""

import argparse
import os
import shutil
import signal
import socket
import threading
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import can
import numpy as np
import pytest

from bridge.can_log import CanLog
from bridge.can_map import CanMap
from bridge.can_source import CanSource
from bridge.errors import BridgeError, LinkError, LogFormatError
from bridge.link import Packet
from bridge.links.can import CanLink
from bridge.logs import read_log
from bridge.mavlink_decoder import MavlinkDecoder
from bridge.mavlink_map import MavlinkMap, ServoTerm
from bridge.measurement import Quantity
from host.errors import ConfigError, RecordingError
from host.live.journal import Journal
from host.vehicle import default_vehicle, effective_table
from tools.commands import replay
from tools.log_frames import frames_of
from tools.sitl.recording import record, write_csv
from tools.sitl.scenario import parse

DATA = Path(__file__).parents[1] / "data"
TLOG = DATA / "ardusub" / "small.tlog"
MAVLINK = MavlinkMap(
    system_id=1, rudder=(ServoTerm(channel=1, rad_per_us=0.001),), surface_pressure_hpa=1013.25
)


def run(*words: str) -> int:
    parser = argparse.ArgumentParser()
    replay.add_arguments(parser)
    return replay.run(parser.parse_args(list(words)))


class Listener:
    """Gathers datagrams until they stop coming."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.link = f"udpout:127.0.0.1:{self.socket.getsockname()[1]}"
        self.data: list[bytes] = []
        self.done = threading.Event()
        self.thread = threading.Thread(target=self._gather)
        self.thread.start()

    def _gather(self) -> None:
        self.socket.settimeout(0.2)
        while True:
            try:
                self.data.append(self.socket.recv(65536))
            except TimeoutError:
                if self.done.is_set():
                    return

    def close(self) -> list[bytes]:
        self.done.set()
        self.thread.join()
        self.socket.close()
        return self.data


@pytest.fixture
def listener():
    listener = Listener()
    yield listener
    listener.close()


def sent_frames(path: Path, on_can: bool = False) -> list[tuple[float, Packet]]:
    return list(frames_of(path, replay._demonstration(), on_can, Counter()))


def decoded(packets: list[bytes], mapping: MavlinkMap = MAVLINK) -> dict[Quantity, list[tuple[int, float]]]:
    decoder = MavlinkDecoder(mapping)
    values: dict[Quantity, list[tuple[int, float]]] = {quantity: [] for quantity in Quantity}
    for data in packets:
        for item in decoder.feed(data, 0):
            values[item.quantity].append((item.t_us, item.value))
    return values


def test_tlog_frames_leave_byte_for_byte_with_their_timing():
    original, frames = TLOG.read_bytes(), sent_frames(TLOG)
    at = -1
    for _, packet in frames:
        stamped = packet.t_us.to_bytes(8, "big") + packet.data
        at = original.index(stamped, at + 1)
    assert len(frames) > 1000
    times = [due for due, _ in frames]
    assert times[0] == 0.0
    assert np.all(np.diff(times) >= 0)
    assert times[-1] == pytest.approx((frames[-1][1].t_us - frames[0][1].t_us) * 1e-6, abs=1.0)


def test_replayed_tlog_gives_the_measurements_of_the_log(listener):
    """Exact numbers of pitch and depth; a loopback loses nothing at 1000 datagrams a batch."""
    reading = read_log(TLOG, MAVLINK, CanMap())
    packets = [packet.data for _, packet in sent_frames(TLOG)]
    got = decoded(packets)
    expected = Counter(item.quantity for item in reading.measurements)
    for quantity in (Quantity.PITCH, Quantity.DEPTH):
        assert len(got[quantity]) == expected[quantity] > 0
    assert run(str(TLOG), "--link", listener.link, "--speed", "1e4", "--quiet") == 0
    assert b"".join(listener.close())[:2000] == b"".join(packets)[:2000]


def test_damaged_tlog_loses_only_its_damage(tmp_path):
    data = bytearray(TLOG.read_bytes())
    whole = len(sent_frames(TLOG))
    data[3000:3020] = b"some text in between"
    (tmp_path / "x.tlog").write_bytes(data[:-5])
    assert whole - 5 <= len(sent_frames(tmp_path / "x.tlog")) < whole


def test_absurd_stamps_do_not_stop_the_replay(tmp_path):
    frame = sent_frames(TLOG)[0][1].data
    stamps = [10**15, 10**15 + 100_000, 7, 2**63, 10**15 + 200_000, 10**15 + 300_000]
    (tmp_path / "x.tlog").write_bytes(b"".join(stamp.to_bytes(8, "big") + frame for stamp in stamps))
    times = [due for due, _ in sent_frames(tmp_path / "x.tlog")]
    assert times == pytest.approx([0.0, 0.1, 0.1, 0.1, 0.1, 0.2])


def simulated_csv(folder: Path, seconds: float = 20.0) -> Path:
    scenario = parse(f"duration_s = {seconds}\n[sensors.depth]\nnoise = 0.01\nloss = 0.1\n")
    write_csv(folder / "dive.csv", record(scenario, 1))
    return folder / "dive.csv"


def test_text_recording_becomes_frames_of_the_mapped_vehicle(tmp_path):
    path = simulated_csv(tmp_path)
    table = np.genfromtxt(path, delimiter=",", names=True)
    frames = sent_frames(path)
    got = decoded([packet.data for _, packet in frames], replace(MAVLINK, depth_source="SCALED_PRESSURE2"))
    known = np.isfinite(table["depth_m"])
    assert np.sum(~known) > 5
    assert [value for _, value in got[Quantity.DEPTH]] == pytest.approx(table["depth_m"][known], abs=0.003)
    assert [t_us for t_us, _ in got[Quantity.DEPTH]] == np.round(table["time_s"][known] * 1e6).tolist()
    assert [value for _, value in got[Quantity.PITCH]] == pytest.approx(table["pitch_rad"], abs=1e-6)
    assert [value for _, value in got[Quantity.RUDDER]] == pytest.approx(table["rudder_rad"], abs=1e-9)
    assert frames[-1][0] == pytest.approx(20.0)


def test_text_recording_becomes_can_frames(tmp_path):
    path = simulated_csv(tmp_path)
    table = np.genfromtxt(path, delimiter=",", names=True)
    with can.Bus(interface="virtual", channel="replay-csv") as ground:
        source = CanSource(CanLink(ground), CanMap())
        assert run(str(path), "--link", "can:virtual:replay-csv", "--speed", "inf", "--quiet") == 0
        got = [item for _ in range(5) for item in source.read(0.05)]
    pitch = [item.value for item in got if item.quantity is Quantity.PITCH]
    assert pitch == pytest.approx(table["pitch_rad"], abs=1e-6)
    assert {item.quantity for item in got} == set(Quantity)


def test_can_log_leaves_frame_for_frame():
    path = DATA / "can" / "nmea2000_bus.txt"
    packets = list(CanLog(path))
    with can.Bus(interface="virtual", channel="replay-can") as ground:
        assert run(str(path), "--link", "can:virtual:replay-can", "--speed", "1e6", "--quiet") == 0
        received = []
        while (frame := ground.recv(0.05)) is not None:
            received.append((frame.arbitration_id, bytes(frame.data)))
    assert received == [(packet.can_id, packet.data) for packet in packets]


def test_dataflash_log_and_journal_become_frames(tmp_path):
    log = DATA / "ardusub" / "small.BIN"
    reading = read_log(log, MAVLINK, CanMap())
    path = tmp_path / "dive.jsonl"
    vehicle = default_vehicle()
    journal = Journal(
        path, vehicle=vehicle.name, configuration=effective_table(vehicle), wall_s=time.time, warn=print
    )
    journal.measurements(reading.measurements)
    journal.close()
    expected = Counter(item.quantity for item in reading.measurements)
    for source in (log, path):
        frames = sent_frames(source)
        got = decoded([packet.data for _, packet in frames])
        assert len(got[Quantity.PITCH]) == expected[Quantity.PITCH] > 10


def test_other_medium_carries_the_measurements_of_a_tlog():
    packets = sent_frames(TLOG, on_can=True)
    assert all(packet.can_id is not None for _, packet in packets)
    expected = read_log(TLOG, MAVLINK, CanMap()).measurements
    assert sum(packet.can_id == 257 for _, packet in packets) == sum(
        item.quantity is Quantity.PITCH for item in expected
    )


class Recorder:
    """A link on a clock that only waiting moves."""

    def __init__(self) -> None:
        self.clock_s = 50.0
        self.sent: list[float] = []

    def read(self, timeout_s: float) -> list[Packet]:
        self.clock_s += timeout_s + 1e-6
        return []

    def write(self, packet: Packet) -> None:  # noqa: ARG002
        self.sent.append(self.clock_s - 50.0)

    def close(self) -> None:
        pass


@pytest.mark.parametrize("speed", [0.5, 1.0, 10.0])
def test_frames_leave_when_they_are_due(speed):
    link = Recorder()
    player = replay.Player(link, speed, lambda: link.clock_s, lambda: False)
    due = [0.0, 0.1, 0.1, 3.0, 10.0]
    player.play(iter([(t_s, Packet(t_us=0, data=b"x")) for t_s in due]), lambda: None)
    assert link.sent == pytest.approx([t_s / speed for t_s in due], abs=1e-3)
    assert (player.sent, player.t_s) == (5, 10.0)


def test_loop_begins_again_until_it_is_stopped(tmp_path, listener, capsys):
    path = simulated_csv(tmp_path, 2.0)
    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGTERM)).start()
    assert run(str(path), "--link", listener.link, "--speed", "40", "--loop") == 0
    beats = Counter(decoder_counts(listener.close()))["HEARTBEAT"]
    assert beats > 6  # three in one pass
    out = capsys.readouterr().out.splitlines()
    assert "40 times real time" in out[0]
    assert "sent" in out[-1]


def decoder_counts(packets: list[bytes]) -> Counter[str]:
    decoder = MavlinkDecoder(MAVLINK)
    for data in packets:
        decoder.feed(data, 0)
    return decoder.counts


def test_log_of_which_nothing_can_be_sent_is_a_no(tmp_path, capsys):
    """A bus map of one's own that has no room for what the log holds."""
    path = simulated_csv(tmp_path)
    (tmp_path / "own.dbc").write_text('VERSION ""\nBU_: A\nBO_ 5 X: 8 A\n SG_ v : 0|16@1+ (1,0) [0|0] "" A\n')
    (tmp_path / "v.toml").write_text(
        'name = "v"\nspeed = 2.0\n[can]\ndbc = "own.dbc"\n'
        '[[can.signals]]\nquantity = "depth"\nmessage = "X"\nsignal = "v"\nscale = 1e-9\n'
    )
    assert run(str(path), "--link", "can:virtual:none", "--vehicle", str(tmp_path / "v.toml")) == 1
    assert "nothing in it can be sent on can:virtual:none; refused.not_encodable" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "content", "error"),
    [
        ("x.tlog", None, OSError),
        ("x.tlog", b"", LogFormatError),
        ("x.tlog", b"this is no log at all" * 100, LogFormatError),
        ("x.BIN", b"garbage" * 100, LogFormatError),
        ("x.csv", b"a,b\n1,2\n", RecordingError),
        ("x.csv", b"\xff\xfe\x00", RecordingError),
        ("x.jsonl", b"{}\n", RecordingError),
        ("x.blf", b"garbage", LogFormatError),
        ("x.doc", b"hello", LogFormatError),
    ],
)
def test_unusable_log_is_refused_in_one_line(tmp_path, name, content, error):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(error) as caught:
        run(str(tmp_path / name), "--link", "udpout:127.0.0.1:9")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("--link", "udpout:127.0.0.1:9", "--speed", "0"), ConfigError),
        (("--link", "udpout:127.0.0.1:9", "--speed", "nan"), ConfigError),
        (("--link", f"log:{TLOG}"), LinkError),
        (("--link", "pigeon:1"), BridgeError),
        (("--link", "tcp:127.0.0.1:1"), LinkError),
        (("--link", "udpout:127.0.0.1:9", "--vehicle", "no_such.toml"), Exception),
    ],
)
def test_bad_usage_is_refused_in_one_line(tmp_path, words, error):
    shutil.copy(TLOG, tmp_path / "x.tlog")
    with pytest.raises(error) as caught:
        run(str(tmp_path / "x.tlog"), *words)
    assert "\n" not in str(caught.value)
