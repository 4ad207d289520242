"""The official RTDE Python client (vendored by PyPI's urinterface as third_party.rtde) records from the controller.

usage: rtde_record.py HOST FOLDER
"""

import csv
import os
import sys

from urinterface.robot_connection import RobotConnection

HOST, FOLDER = sys.argv[1], sys.argv[2]
FIELDS = {
    "timestamp": "DOUBLE",
    "target_q": "VECTOR6D",
    "target_qd": "VECTOR6D",
    "target_qdd": "VECTOR6D",
    "target_current": "VECTOR6D",
    "target_moment": "VECTOR6D",
    "actual_q": "VECTOR6D",
    "actual_qd": "VECTOR6D",
    "actual_current": "VECTOR6D",
    "joint_control_output": "VECTOR6D",
    "actual_TCP_pose": "VECTOR6D",
    "actual_TCP_speed": "VECTOR6D",
    "actual_TCP_force": "VECTOR6D",
    "target_TCP_pose": "VECTOR6D",
    "target_TCP_speed": "VECTOR6D",
    "actual_digital_input_bits": "UINT64",
    "joint_temperatures": "VECTOR6D",
    "actual_execution_time": "DOUBLE",
    "robot_mode": "INT32",
    "joint_mode": "VECTOR6INT32",
    "safety_mode": "INT32",
    "actual_tool_accelerometer": "VECTOR3D",
    "speed_scaling": "DOUBLE",
    "target_speed_fraction": "DOUBLE",
    "actual_momentum": "DOUBLE",
    "actual_main_voltage": "DOUBLE",
    "actual_robot_voltage": "DOUBLE",
    "actual_robot_current": "DOUBLE",
    "actual_joint_voltage": "VECTOR6D",
    "actual_digital_output_bits": "UINT64",
    "runtime_state": "UINT32",
    "joint_position_deviation_ratio": "DOUBLE",
}
assert len(FIELDS) == 32

recipe = os.path.join(FOLDER, "record_configuration.xml")
with open(recipe, "w") as file:
    rows = "".join(f'<field name="{name}" type="{kind}"/>' for name, kind in FIELDS.items())
    file.write(f'<?xml version="1.0"?><rtde_config><recipe key="out">{rows}</recipe></rtde_config>')
out = os.path.join(FOLDER, "robot_data.csv")

robot = RobotConnection(HOST)
robot.record_samples(config_file=recipe, filename=out, overwrite=True, frequency=125, samples=200)

with open(out) as file:
    table = list(csv.DictReader(file, delimiter=" "))
assert len(table) == 200, len(table)
stamps = [float(row["timestamp"]) for row in table]
gaps = [b - a for a, b in zip(stamps, stamps[1:])]
# A loaded machine may skip packages; none comes between the ticks of 125 Hz, and none twice.
assert all(gap > 0.0079 and abs(gap / 0.008 - round(gap / 0.008)) < 1e-3 for gap in gaps), min(gaps)
for row in table:
    assert row["robot_mode"] == "7" and row["safety_mode"] == "1" and row["joint_mode_0"] == "253"
    assert all(abs(float(row[f"actual_q_{i}"]) - float(row[f"target_q_{i}"])) < 1e-3 for i in range(6))
    # Gravity, in whatever direction the tool looks.
    assert abs(sum(float(row[f"actual_tool_accelerometer_{i}"]) ** 2 for i in range(3)) ** 0.5 - 9.81) < 0.02
    assert 0.0 <= float(row["joint_position_deviation_ratio"]) < 0.01
print(f"recorded {len(table)} rows, {sum(gap > 0.009 for gap in gaps)} gaps")
