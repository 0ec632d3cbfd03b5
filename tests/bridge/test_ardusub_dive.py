"""A dive of the real ArduSub firmware in simulation against the simulator's own depth and pitch.

Why these numbers: over the whole dive the simulated barometer is 10,042.5 Pa/m times the true depth, which is
1024 kg/m3, plus 101,315 Pa, which is the standard atmosphere to 0.1 hPa. Barometer 1 is the one to use: the
simulator adds 10 cm of wander to the second. Motors 5-8 are the vertical ones of the vectored 6-DOF frame.

The truth is taken at the times the recorder gave it. The pitch error grows with the pitch rate as a constant
offset of some 10 ms would; where that comes from is not known, and nothing is shifted to remove it.
"""

from math import degrees, sqrt

import numpy as np
import pytest
from tlog_files import DATA
from vehicle_frames import of

from bridge.can_map import CanMap
from bridge.logs import LogReading, read_log
from bridge.mavlink_map import MavlinkMap, ServoTerm
from bridge.measurement import Quantity

MAPPING = MavlinkMap(
    system_id=1,
    depth_source="SCALED_PRESSURE",
    water_density=1024.0,
    surface_pressure_hpa=1013.25,
    rudder=(
        *(ServoTerm(channel=channel, rad_per_us=6.25e-4) for channel in (5, 6)),
        *(ServoTerm(channel=channel, rad_per_us=-6.25e-4) for channel in (7, 8)),
    ),
    speed_source="LOCAL_POSITION_NED",
)
TRUTH = np.genfromtxt(DATA / "dive_truth.csv", delimiter=",", names=True)


@pytest.fixture(scope="module", params=["dive.tlog", "dive.BIN"])
def dive(request: pytest.FixtureRequest) -> LogReading:
    return read_log(DATA / request.param, MAPPING, CanMap())


def rms_error(dive: LogReading, quantity: Quantity, truth: np.ndarray) -> float:
    channel = of(dive.measurements, quantity)
    times = np.array([item.t_us * 1e-6 for item in channel])
    inside = (TRUTH["time_boot_s"] > times[0]) & (TRUTH["time_boot_s"] < times[-1])
    assert inside.sum() > 200
    values = np.interp(TRUTH["time_boot_s"][inside], times, [item.value for item in channel])
    return sqrt(np.mean((values - truth[inside]) ** 2))


def test_depth_from_pressure_is_within_5_cm_of_the_simulator(dive: LogReading) -> None:
    assert rms_error(dive, Quantity.DEPTH, TRUTH["depth_m"]) < 0.05


def test_pitch_is_within_a_fifth_of_a_degree_of_the_simulator(dive: LogReading) -> None:
    assert degrees(rms_error(dive, Quantity.PITCH, TRUTH["pitch_rad"])) < 0.2


def test_repeated_pressures_are_dropped(dive: LogReading) -> None:
    """The simulated sensor gives 10 values a second, sent up to 50 times a second."""
    depth = of(dive.measurements, Quantity.DEPTH)
    seconds = (depth[-1].t_us - depth[0].t_us) * 1e-6
    assert len(depth) / seconds == pytest.approx(10.0, rel=0.02)


def test_positive_thruster_mix_pitches_the_nose_down(dive: LogReading) -> None:
    """Least squares of q' on q, sin(theta) and the mix, half a second smoothed: the mix enters negatively."""
    grid = np.arange(TRUTH["time_boot_s"][0] + 1, TRUTH["time_boot_s"][-1] - 1, 0.05)
    pitch = np.interp(grid, TRUTH["time_boot_s"], TRUTH["pitch_rad"])
    smooth = np.convolve(pitch, np.hanning(13) / np.hanning(13).sum(), "same")
    rate = np.gradient(smooth, grid)
    acceleration = np.gradient(rate, grid)
    channel = of(dive.measurements, Quantity.RUDDER)
    mix = np.interp(grid, [item.t_us * 1e-6 for item in channel], [item.value for item in channel])
    rows = np.column_stack([rate, np.sin(smooth), mix, np.ones_like(grid)])[10:-10]
    coefficients, *_ = np.linalg.lstsq(rows, acceleration[10:-10], rcond=None)
    assert coefficients[2] < -0.3
    assert np.std(mix) > 0.01
