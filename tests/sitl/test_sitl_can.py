"""The simulated vehicle on a CAN bus, judged by cantools."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import can
import cantools
import numpy as np
import pytest

from tools.sitl.can_vehicle import CanVehicle, load_dbc, open_bus
from tools.sitl.errors import TransportError
from tools.sitl.recording import record
from tools.sitl.scenario import Can, Scenario, load
from tools.sitl.sensors import Channel, Sensors
from tools.sitl.track import Track

DEFAULT_DBC = Path(__file__).parents[2] / "bridge" / "default.dbc"
OWN_DBC = """VERSION ""
BU_: A
BO_ 2566834709 NAV: 8 A
 SG_ keel : 0|16@1+ (0.01,0) [0|600] "m" A
 SG_ trim : 16|16@1- (0.0001,0) [-3|3] "rad" A
 SG_ clock : 32|8@1+ (0.1,0) [0|25.5] "s" A
 SG_ spare : 40|8@1+ (1,0) [0|255] "" A
"""


def frames(scenario: Scenario, dbc: Path, until_s: float) -> tuple[CanVehicle, list[can.Message]]:
    """What a listener on the bus receives."""
    channel = f"sitl-{id(scenario)}"
    with can.Bus(interface="virtual", channel=channel) as listener, open_bus(f"can:virtual:{channel}") as bus:
        track = Track(scenario, 1)
        vehicle = CanVehicle(scenario, 1, track, bus, dbc)
        while vehicle.next_s < until_s - 1e-6:
            due = vehicle.next_s
            track.advance(due)
            vehicle.emit(due)
        received = []
        while (frame := listener.recv(0.0)) is not None:
            received.append(frame)
        listener.send(can.Message(arbitration_id=0x1B1, is_extended_id=False, data=bytes(8)))
        vehicle.listen(0.5)
    return vehicle, received


def test_default_bus_carries_every_channel_with_the_clock():
    scenario = load("linear_noise_free")
    vehicle, received = frames(scenario, DEFAULT_DBC, 20.0)
    database = cantools.database.load_file(DEFAULT_DBC)
    table = record(replace(scenario, duration_s=20.0), 1)
    for name, column, tolerance in (
        ("depth", "depth_m", 1e-4),
        ("pitch", "pitch_rad", 1e-6),
        ("rudder", "rudder_rad", 1e-6),
        ("speed", "speed_mps", 1e-4),
        ("pitch_rate", "pitch_rate_radps", 1e-6),
    ):
        message = database.get_message_by_name(name.upper())
        values = [message.decode(f.data) for f in received if f.arbitration_id == message.frame_id]
        assert [v["time"] for v in values] == pytest.approx(np.arange(200) * 0.1, abs=1e-4)
        assert [v[name] for v in values] == pytest.approx(table[column][:200], abs=tolerance)
    assert vehicle.sent == Counter(DEPTH=200, PITCH=200, RUDDER=200, SPEED=200, PITCH_RATE=200)
    assert vehicle.heard == {"1B1": 1}


def test_any_dbc_serves_by_the_names_of_its_signals(tmp_path):
    (tmp_path / "own.dbc").write_text(OWN_DBC)
    scenario = replace(load("linear_noise_free"), can=Can(depth="keel", pitch="trim", time="clock"))
    _, received = frames(scenario, tmp_path / "own.dbc", 60.0)
    assert len(received) == 600
    assert all(frame.is_extended_id for frame in received)
    values = [
        load_dbc(tmp_path / "own.dbc").decode_message(2566834709 & 0x1FFFFFFF, f.data) for f in received
    ]
    assert {v["spare"] for v in values} == {0}
    clock = [v["clock"] for v in values]
    assert max(clock) == 25.5  # then the 8-bit clock starts again
    assert np.flatnonzero(np.diff(clock) < 0).tolist() == [255, 511]


def test_lost_and_unencodable_samples_are_not_sent():
    sensors = Sensors(depth=Channel(loss=0.5), pitch=Channel(nan=0.25), rudder=Channel(rate_hz=5.0))
    vehicle, _ = frames(replace(load("default"), sensors=sensors), DEFAULT_DBC, 60.0)
    assert vehicle.sent["DEPTH"] == pytest.approx(300, abs=60)
    assert vehicle.sent["PITCH"] + vehicle.sent["unencodable"] == 600
    assert vehicle.sent["unencodable"] == pytest.approx(150, abs=45)
    assert vehicle.sent["RUDDER"] == 300


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("can:", "can:INTERFACE:CHANNEL"),
        ("can:virtual", "can:INTERFACE:CHANNEL"),
        ("can:carrier_pigeon:1", "cannot be opened"),
        ("can:socketcan:no_such_can9", "cannot be opened: .*; `mils doctor`"),
        ("can:socketcand:127.0.0.1", "must be can:socketcand:HOST:PORT:CHANNEL"),
        ("can:udp_multicast:1.2.3.4:43200", "cannot be opened"),
    ],
)
def test_bus_that_does_not_exist_is_refused_in_one_line(url, says):
    with pytest.raises(TransportError, match=says) as caught:
        open_bus(url)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [None, "", "hello", OWN_DBC])
def test_unusable_dbc_is_refused_in_one_line(tmp_path, content):
    path = tmp_path / "x.dbc"
    if content is not None:
        path.write_text(content)
    scenario = load("default")
    with (
        can.Bus(interface="virtual", channel="x") as bus,
        pytest.raises(TransportError, match=r"x\.dbc") as caught,
    ):
        CanVehicle(scenario, 1, Track(scenario, 1), bus, path)
    assert "\n" not in str(caught.value)
