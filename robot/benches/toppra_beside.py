"""How long toppra takes for the points on standard input (a row of joints each, 0.5 mm apart), velocity 1.5 and
acceleration 5 for every joint. It knows no jerk, so its motion is quicker than one that keeps it."""

import sys
import time
from importlib.metadata import version

import numpy as np
import toppra as ta
import toppra.algorithm as algo
import toppra.constraint as constraint

STEP = 0.0005

ta.setup_logging("ERROR")
points = np.loadtxt(sys.stdin)
grid = STEP * np.arange(len(points))
joints = points.shape[1]
both = lambda most: np.outer(np.full(joints, most), [-1.0, 1.0])
for count in (1000, len(points)):
    took = []
    for _ in range(5):
        start = time.perf_counter()
        path = ta.SplineInterpolator(grid, points)
        limits = [constraint.JointVelocityConstraint(both(1.5)), constraint.JointAccelerationConstraint(both(5.0))]
        places = np.linspace(0, path.duration, count)
        found = algo.TOPPRA(limits, path, gridpoints=places, parametrizer="ParametrizeConstAccel")
        trajectory = found.compute_trajectory()
        took.append(time.perf_counter() - start)
    print(
        f"toppra {version('toppra')}, {count} grid points: {np.median(took) * 1e3:.1f} ms (median of 5), "
        f"the motion takes {trajectory.duration:.3f} s without a jerk limit",
        file=sys.stderr,
    )
