#!/usr/bin/env python3
"""Makes the golden files of the kinematics with Pinocchio, which shares no code with ours.

    python3 -m venv /tmp/golden && /tmp/golden/bin/pip install pin==4.1.0
    /tmp/golden/bin/python tests/golden/make_kinematics.py

For each chain: 1,000 random postures within the joints' limits (a continuous joint within two turns), the pose of the
tip link in the base link, and the geometric Jacobian of the tip's origin (linear, then angular, in the base's axes).

A file: 8 bytes "PPKINE1\n", two little-endian u32 (joints n, rows), then rows of little-endian f64:
n joint positions in the order of the chain, 3 of the place (m), 9 of the rotation (by rows), 6 n of the Jacobian
(by rows).
"""

import struct
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pinocchio as pin

HERE = Path(__file__).parent
MODELS = HERE / "../../robot/models"
ROWS = 1000

# file, URDF, base link, tip link, independent joints from base to tip, seed
CHAINS = [
    ("ur5e", MODELS / "ur5e.urdf", "base_link", "tool0",
     ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"], 1),
    ("panda", MODELS / "panda.urdf", "panda_link0", "panda_link8", [f"panda_joint{i}" for i in range(1, 8)], 2),
    ("ur3e", HERE / "kinematics/ur3e.urdf", "base_link", "tool0",
     ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"], 3),
    ("xarm7", HERE / "kinematics/xarm7.urdf", "world", "link_eef", [f"joint{i}" for i in range(1, 8)], 4),
    ("gantry", HERE / "kinematics/gantry.urdf", "floor", "flange",
     ["lift", "trolley", "swing", "spin", "flange_joint"], 5),
    # Backwards through the camera's joints, then down the arm; it ends before the plunger, whose master, the trolley,
    # is above the carriage and so not on the way.
    ("gantry_from_camera", HERE / "kinematics/gantry.urdf", "camera", "wrist",
     ["camera_tilt", "camera_turn", "swing", "spin"], 6),
]


def mimics(urdf):
    """joint -> (master, multiplier, offset)"""
    found = {}
    for joint in ET.parse(urdf).getroot().findall("joint"):
        mimic = joint.find("mimic")
        if mimic is not None:
            found[joint.get("name")] = (
                mimic.get("joint"), float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0)))
    return found


def set_joint(model, q, name, value):
    joint = model.joints[model.getJointId(name)]
    if joint.nq == 2:  # continuous: cosine and sine
        q[joint.idx_q], q[joint.idx_q + 1] = np.cos(value), np.sin(value)
    else:
        q[joint.idx_q] = value


def relative_jacobian(model, data, base, tip):
    """Of the tip's origin as seen from the base link, in the base's axes: both may move in Pinocchio's root."""
    aligned = pin.LOCAL_WORLD_ALIGNED
    of_tip = pin.getFrameJacobian(model, data, tip, aligned)
    of_base = pin.getFrameJacobian(model, data, base, aligned)
    apart = data.oMf[tip].translation - data.oMf[base].translation
    carried = of_base[:3] + np.cross(of_base[3:].T, apart).T
    turn = data.oMf[base].rotation.T
    return np.vstack([turn @ (of_tip[:3] - carried), turn @ (of_tip[3:] - of_base[3:])])


def limits(model, name):
    joint = model.joints[model.getJointId(name)]
    if joint.nq == 2:
        return -4 * np.pi, 4 * np.pi
    return model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]


def rows(urdf, base_link, tip_link, joints, seed):
    # Mimic joints are followed here, by hand: Pinocchio gets every joint as if it moved by itself.
    model = pin.buildModelFromUrdf(str(urdf))
    data = model.createData()
    base, tip = model.getFrameId(base_link), model.getFrameId(tip_link)
    assert base < model.nframes and tip < model.nframes
    follow = mimics(urdf)
    rng = np.random.default_rng(seed)
    lower, upper = np.array([limits(model, name) for name in joints]).T
    for _ in range(ROWS):
        posture = rng.uniform(lower, upper)
        q = pin.neutral(model)
        value = dict(zip(joints, posture))
        for name in model.names[1:]:
            master, by, plus = follow.get(name, (name, 1.0, 0.0))
            set_joint(model, q, name, by * value.get(master, 0.0) + plus)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        full = relative_jacobian(model, data, base, tip)
        jacobian = np.zeros((6, len(joints)))
        for name in model.names[1:]:
            master, by, _ = follow.get(name, (name, 1.0, 0.0))
            if master in value:
                jacobian[:, joints.index(master)] += by * full[:, model.joints[model.getJointId(name)].idx_v]
        pose = data.oMf[base].inverse() * data.oMf[tip]
        yield np.concatenate([posture, pose.translation, pose.rotation.ravel(), jacobian.ravel()])


def main():
    for name, urdf, base_link, tip_link, joints, seed in CHAINS:
        table = np.array(list(rows(urdf, base_link, tip_link, joints, seed)), dtype="<f8")
        path = HERE / f"kinematics/{name}.bin"
        path.write_bytes(b"PPKINE1\n" + struct.pack("<II", len(joints), ROWS) + table.tobytes())
        print(f"{path.name}: {table.shape[0]} postures of {len(joints)} joints, {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
