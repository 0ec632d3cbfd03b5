"""Writes dronecan_golden.json with the vendor's library: `pip install dronecan`, then run this file.

Each entry: identifier and frames of one broadcast of node 42 with transfer id 5, made by pydronecan 1.0.
"""

import json
from math import cos, sin
from pathlib import Path

import dronecan
from dronecan.transport import Frame, Transfer


def frames(message: object) -> dict[str, object]:
    transfer = Transfer(payload=message, source_node_id=42, transfer_id=5, transfer_priority=16)
    made: list[Frame] = transfer.to_frames()
    return {"can_id": made[0].message_id, "frames": [bytes(frame.bytes).hex() for frame in made]}


def main() -> None:
    half_pitch = 0.5 * -0.3
    solution = dronecan.uavcan.equipment.ahrs.Solution()
    solution.timestamp.usec = 123_456_789
    solution.orientation_xyzw = [0.0, sin(half_pitch), 0.0, cos(half_pitch)]
    solution.orientation_covariance = [0.25, 0.5, 0.75]
    solution.angular_velocity = [0.0, 0.125, 0.0]
    solution.linear_acceleration = [0.0, 0.0, -9.8]
    status = dronecan.uavcan.equipment.actuator.Status()
    status.actuator_id = 3
    status.position = -0.25
    pressure = dronecan.uavcan.equipment.air_data.StaticPressure()
    pressure.static_pressure = 201_325.0
    golden = {"1000": frames(solution), "1011": frames(status), "1028": frames(pressure)}
    Path(__file__).with_name("dronecan_golden.json").write_text(json.dumps(golden, indent=1) + "\n")


if __name__ == "__main__":
    main()
