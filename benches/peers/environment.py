"""What the scripts here share: an environment of their own in target/peers, and the least time of a few runs."""

import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
VENV = ROOT / "target" / "peers"


def with_packages(needs):
    """Goes on in the environment, with these packages of PyPI; the script begins again there if it is not in it yet."""
    if Path(sys.prefix).resolve() == VENV.resolve():
        return
    python = VENV / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(VENV)], check=True)
    subprocess.run([str(python), "-m", "pip", "install", "-q", *needs], check=True)
    os.execv(str(python), [str(python), *sys.argv])


def least(work, times=5):
    """Seconds by the clock, processor seconds (which do not count what else the computer does), and the answer."""
    seconds, worked, answer = [], [], None
    for _ in range(times):
        start, begun = time.perf_counter(), time.process_time()
        answer = work()
        seconds.append(time.perf_counter() - start)
        worked.append(time.process_time() - begun)
    return min(seconds), min(worked), answer
