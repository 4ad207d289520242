"""OpenIGTLink as PyPI's pyigtl speaks it.

    igtl.py send           serves on a free port (printed), and sends what its standard output then says, line by line
    igtl.py receive PORT   takes the pictures P1 to P4 from 127.0.0.1:PORT, and says what came, line by line
"""

import hashlib
import json
import sys
import time

import numpy
import pyigtl


def described(message):
    """A picture, as both sides can say it."""
    matrix = message.ijk_to_world_matrix
    return {
        "device": message.device_name,
        "number": message.message_id,
        "stamp_s": message.timestamp,
        "size": list(message.image.shape)[::-1],
        "spacing_mm": [float(numpy.linalg.norm(matrix[:3, axis])) for axis in (0, 1)],
        "origin_mm": [round(float(x), 6) for x in matrix[:3, 3]],
        "pixels_sha256": hashlib.sha256(message.image.tobytes()).hexdigest(),
    }


def picture(n):
    rows, columns = 480 - n, 640 - 3 * n
    pixels = numpy.random.default_rng(n).integers(0, 256, (1, rows, columns), dtype=numpy.uint8)
    message = pyigtl.ImageMessage(
        pixels,
        ijk_to_world_matrix=numpy.diag([0.0625, 0.125, 1.0, 1.0]),
        timestamp=100.0 + n / 8,
        device_name="Probe",
    )
    # Both headers: the second carries a number and words.
    message.header_version = 1 + n % 2
    message.message_id = n if n % 2 else 0
    if n % 2:
        message.metadata = {"Depth": "70 mm"}
    return message


def send():
    server = pyigtl.OpenIGTLinkServer(port=0)
    print(server.server_address[1], flush=True)
    while not server.is_connected():
        time.sleep(0.01)
    for n in range(1, 7):
        server.send_message(pyigtl.TransformMessage(numpy.eye(4), device_name="Tracker"), wait=True)
        server.send_message(pyigtl.StringMessage("frozen: no", device_name="Machine"), wait=True)
        message = picture(n)
        server.send_message(message, wait=True)
        print(json.dumps(described(message)), flush=True)
    # Until the other side has had enough.
    sys.stdin.read()


def receive(port):
    client = pyigtl.OpenIGTLinkClient("127.0.0.1", port)
    for n in range(1, 5):
        message = client.wait_for_message(f"P{n}", timeout=60)
        assert message is not None, f"P{n} did not come"
        print(json.dumps(described(message)), flush=True)
    client.stop()


if sys.argv[1] == "send":
    send()
else:
    receive(int(sys.argv[2]))
