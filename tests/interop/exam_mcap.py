"""Reads an exam file with the mcap package of PyPI and every message with its own schema, then with Rerun.

usage: exam_mcap.py EXAM EXPECTED.json

EXPECTED.json says what the writer knows: counts per topic, the first tick, the first B-scan, attachments. Nothing of
probepath is used here, so agreement means that the file says what it claims to strangers.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def check(got, wanted, what):
    if got != wanted:
        sys.exit(f"{what}: {got!r} instead of {wanted!r}")


def pose(message):
    return [message.x_m, message.y_m, message.z_m, message.qx, message.qy, message.qz, message.qw]


def main(exam, expected):
    expected = json.loads(Path(expected).read_text())
    counts, seen = Counter(), {}
    with open(exam, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        check(reader.get_header().profile, "probepath", "profile")
        attachments = {a.name: hashlib.sha256(a.data).hexdigest() for a in reader.iter_attachments()}
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
        for schema, channel, _, message in reader.iter_decoded_messages(log_time_order=False):
            counts[channel.topic] += 1
            seen.setdefault(channel.topic, (schema.name, message))
    check(dict(counts), expected["counts"], "messages per topic")
    check({topic: name for topic, (name, _) in seen.items()}, expected["schemas"], "schemas")
    check(attachments, expected["attachments"], "attachments (SHA-256)")
    check(metadata["probepath.exam"]["study_code"], expected["study_code"], "study code")

    tick, wanted = seen["/tick"][1], expected["tick"]
    for field in ("tick", "stamp_ns", "stay", "guiding", "phase", "safety", "freedrive", "age_ns"):
        check(getattr(tick, field), wanted[field], field)
    for field in ("command", "position", "velocity", "commanded"):
        check(list(getattr(tick, field)), wanted[field], field)
    check([tick.wrench.force_x_n, tick.wrench.force_y_n, tick.wrench.force_z_n], wanted["force_n"], "force")
    check(pose(tick.world_from_probe), wanted["world_from_probe"], "world_from_probe")

    bscan, wanted = seen["/bscan"][1], expected["bscan"]
    for field in ("number", "formed_ns", "arrived_ns", "width", "height", "depth_m", "spacing_x_m", "spacing_y_m"):
        check(getattr(bscan, field), wanted[field], field)
    check(pose(bscan.world_from_image), wanted["world_from_image"], "world_from_image")
    image = seen["/bscan/image"][1]
    check((image.encoding, image.step), ("mono8", image.width), "encoding and step")
    check(hashlib.sha256(image.data).hexdigest(), wanted["pixels_sha256"], "pixels (SHA-256)")
    states = seen["/joint_states"][1]
    check([joint.name for joint in states.joints], expected["joint_names"], "joint names")
    rerun(exam)
    print("agreed:", dict(counts))


def rerun(exam):
    """`rerun mcap check` and `convert`, where rerun-sdk is installed beside this Python."""
    program = shutil.which("rerun", path=str(Path(sys.executable).parent))
    if program is None:
        print("skipped: rerun (rerun-sdk is not installed beside this Python)")
        return
    recording = Path(exam).with_suffix(".rrd")
    # A home of its own, so that its question about usage data is answered with no, and nobody's settings are touched.
    home = dict(os.environ, HOME=tempfile.mkdtemp())
    subprocess.run([program, "analytics", "disable"], capture_output=True, env=home, check=True)
    for arguments in (["check", exam], ["convert", exam, "-o", str(recording)]):
        done = subprocess.run([program, "mcap", *arguments], capture_output=True, text=True, env=home)
        if done.returncode or "PROBLEM" in done.stdout + done.stderr:
            sys.exit(f"rerun mcap {arguments[0]}: {done.stdout}{done.stderr}")
        print(f"rerun mcap {arguments[0]}: {(done.stdout + done.stderr).strip()}")


if __name__ == "__main__":
    main(*sys.argv[1:])
