"""The fastest motion along made-up paths, found by another road than ours: tests/golden/timing.json.

    pip install casadi==3.8.2 numpy
    python tests/golden/make_timing.py > tests/golden/timing.json

Ours works over the distance along the path with b = speed^2; this works over time: the jerk along the path is constant
over each of INTERVALS equal intervals, place, speed and acceleration are integrated exactly, the limits are asked at
both ends and in the middle of every interval, and IPOPT looks for the shortest time. The path's joints are sums of
sines, derived by hand:

    q(s) = slope s + sum of swing sin(2 pi s / wave + phase)
"""

import json
import sys

import casadi as ca
import numpy as np

INTERVALS = 500
TAU = 2 * np.pi


def joint(slope, *terms):
    return {"slope": slope, "terms": [{"swing": a, "wave": w, "phase": p} for a, w, p in terms]}


def problem(name, length, speed, velocity, acceleration, jerk, *joints):
    """speed: highest speed, acceleration and jerk along the path; the others are every joint's limits."""
    return {
        "name": name, "length": length, "speed": speed, "velocity": velocity,
        "acceleration": acceleration, "jerk": jerk, "joints": list(joints),
    }


PROBLEMS = [
    problem("straight, path's limits only", 0.2, [0.02, 0.2, 4.0], 10, 1e3, 1e5, joint(1.0)),
    problem("straight, one joint's limits", 0.2, [1.0, 50.0, 5e3], 0.5, 4.0, 60.0, joint(2.0)),
    problem("one joint that sways", 0.2, [0.1, 2.0, 40.0], 1.0, 2.0, 30.0, joint(2.0, (0.02, 0.08, 0.3))),
    problem("two joints", 0.2, [0.2, 3.0, 60.0], 0.4, 2.0, 30.0,
            joint(2.0, (0.01, 0.06, 0.0)), joint(-1.0, (0.02, 0.1, 1.0))),
    problem("three joints, sharp", 0.2, [0.2, 5.0, 100.0], 0.8, 5.0, 60.0,
            joint(2.0), joint(0.0, (0.02, 0.05, 0.0)), joint(-1.0, (0.01, 0.08, 1.57))),
    problem("three joints, jerk nearly alone", 0.2, [0.3, 50.0, 1e4], 5.0, 50.0, 25.0,
            joint(1.5, (0.01, 0.1, 0.5)), joint(-2.0, (0.01, 0.07, 2.0)), joint(0.5, (0.02, 0.15, 0.0))),
    problem("a joint that turns round", 0.3, [0.15, 2.0, 50.0], 0.6, 2.5, 40.0,
            joint(0.0, (0.05, 0.25, 0.0)), joint(1.0, (0.005, 0.05, 0.7))),
    problem("a leg at 20 mm/s", 0.25, [0.02, 0.2, 4.0], 1.5, 5.0, 100.0,
            joint(3.0, (0.01, 0.1, 0.0)), joint(-2.0, (0.01, 0.06, 1.0)), joint(1.0, (0.02, 0.2, 2.0))),
]


def derivatives(j, s):
    d = [j["slope"], 0.0, 0.0]
    for t in j["terms"]:
        k = TAU / t["wave"]
        x = k * s + t["phase"]
        d[0] = d[0] + t["swing"] * k * ca.cos(x)
        d[1] = d[1] - t["swing"] * k**2 * ca.sin(x)
        d[2] = d[2] - t["swing"] * k**3 * ca.cos(x)
    return d


def solve(p, intervals=INTERVALS):
    opti = ca.Opti()
    L = p["length"]
    vmax, amax, jmax = p["speed"]
    # Scaled: places by L, speeds by vmax, accelerations by amax, jerks by jmax.
    s, v, a, j = (opti.variable(n) for n in (intervals + 1, intervals + 1, intervals + 1, intervals))
    T = opti.variable()
    h = T / intervals
    S, V, A, J = s * L, v * vmax, a * amax, j * jmax
    s0, v0, a0 = S[:-1], V[:-1], A[:-1]

    def after(t):
        return (s0 + t * v0 + t**2 / 2 * a0 + t**3 / 6 * J, v0 + t * a0 + t**2 / 2 * J, a0 + t * J)

    s1, v1, a1 = after(h)
    opti.subject_to((S[1:] - s1) / L == 0)
    opti.subject_to((V[1:] - v1) / vmax == 0)
    opti.subject_to((A[1:] - a1) / amax == 0)
    opti.subject_to(s[0] == 0)
    opti.subject_to(s[-1] == 1)
    for x in (v, a):
        opti.subject_to(x[0] == 0)
        opti.subject_to(x[-1] == 0)
    opti.subject_to(opti.bounded(0, v, 1))
    opti.subject_to(opti.bounded(-1, a, 1))
    opti.subject_to(opti.bounded(-1, j, 1))
    for q in p["joints"]:
        for part in (0.0, 0.5, 1.0):
            sp, vp, ap = after(part * h)
            d1, d2, d3 = derivatives(q, sp)
            one = lambda x, limit: opti.subject_to(opti.bounded(-1, x / limit, 1))
            one(d1 * vp, p["velocity"])
            one(d1 * ap + d2 * vp**2, p["acceleration"])
            one(d1 * J + 3 * d2 * vp * ap + d3 * vp**3, p["jerk"])
    # From rest to rest, slowly.
    t = np.linspace(0, 1, intervals + 1)
    guess = 3.0 * L / vmax
    opti.set_initial(T, guess)
    opti.set_initial(s, 10 * t**3 - 15 * t**4 + 6 * t**5)
    opti.set_initial(v, L / guess / vmax * (30 * t**2 - 60 * t**3 + 30 * t**4))
    opti.set_initial(a, L / guess**2 / amax * (60 * t - 180 * t**2 + 120 * t**3))
    opti.subject_to(T >= 1e-3)
    opti.minimize(T)
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes", "max_iter": 3000, "tol": 1e-8})
    return float(opti.solve().value(T))


def main():
    solved = []
    for p in PROBLEMS:
        coarse, fine = solve(p, INTERVALS // 2), solve(p)
        print(f"{p['name']}: {coarse:.5f} s with half the intervals, {fine:.5f} s", file=sys.stderr)
        solved.append({**p, "duration_s": fine, "duration_with_half_the_intervals_s": coarse})
    json.dump({"made_by": "tests/golden/make_timing.py", "intervals": INTERVALS, "problems": solved}, sys.stdout, indent=1)


if __name__ == "__main__":
    main()
