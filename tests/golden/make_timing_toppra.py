"""How long the motions of make_timing.py take where only speed and acceleration count: tests/golden/timing_toppra.json.

    pip install toppra==0.6.10 numpy
    python tests/golden/make_timing_toppra.py > tests/golden/timing_toppra.json

toppra knows no jerk. The path's own speed and acceleration are limits of one more joint, the distance itself. toppra
keeps the limits between two places of its grid as a first-order guess of them, so what it finds falls with the grid's
step; the grids halve until the last two agree to AGREE.
"""

import json
import sys
import types
from importlib.metadata import version

import numpy as np
import toppra as ta
import toppra.algorithm as algo
import toppra.constraint as constraint

# The problems alone: their solver is not needed here.
sys.modules.setdefault("casadi", types.ModuleType("casadi"))
from make_timing import PROBLEMS, TAU  # noqa: E402

GRIDS = [1000, 2000, 4000, 8000, 16000]
AGREE = 3e-4


def joint(terms, slope, s, order):
    q = [slope * s, slope + 0 * s, 0 * s][order]
    for t in terms:
        k = TAU / t["wave"]
        x = k * s + t["phase"]
        q = q + t["swing"] * [np.sin(x), k * np.cos(x), -(k**2) * np.sin(x)][order]
    return q


class Path(ta.interpolator.AbstractGeometricPath):
    """The distance itself, then the joints."""

    def __init__(self, problem):
        self.problem = problem

    @property
    def dof(self):
        return len(self.problem["joints"]) + 1

    @property
    def path_interval(self):
        return np.array([0.0, self.problem["length"]])

    def __call__(self, places, order=0):
        s = np.atleast_1d(np.asarray(places, float))
        rows = [joint([], 1.0, s, order)]
        rows += [joint(j["terms"], j["slope"], s, order) for j in self.problem["joints"]]
        table = np.array(rows).T
        return table[0] if np.ndim(places) == 0 else table


def duration(problem, cells):
    joints = len(problem["joints"])
    most = lambda own, each: np.outer(np.array([own] + [each] * joints), [-1.0, 1.0])
    limits = [
        constraint.JointVelocityConstraint(most(problem["speed"][0], problem["velocity"])),
        constraint.JointAccelerationConstraint(most(problem["speed"][1], problem["acceleration"])),
    ]
    places = np.linspace(0.0, problem["length"], cells + 1)
    found = algo.TOPPRA(limits, Path(problem), gridpoints=places, solver_wrapper="seidel")
    _, speeds, _ = found.compute_parameterization(0.0, 0.0)
    return float(np.sum(2.0 * np.diff(places) / (speeds[1:] + speeds[:-1])))


def main():
    ta.setup_logging("ERROR")
    solved = []
    for problem in PROBLEMS:
        found = [duration(problem, GRIDS[0])]
        for cells in GRIDS[1:]:
            found.append(duration(problem, cells))
            if abs(found[-1] / found[-2] - 1.0) < AGREE:
                break
        print(f"{problem['name']}: {found}", file=sys.stderr)
        assert abs(found[-1] / found[-2] - 1.0) < AGREE
        solved.append({"name": problem["name"], "cells": GRIDS[len(found) - 1], "duration_s": found[-1]})
    made_by = f"tests/golden/make_timing_toppra.py, toppra {version('toppra')}"
    json.dump({"made_by": made_by, "problems": solved}, sys.stdout, indent=1)


if __name__ == "__main__":
    main()
