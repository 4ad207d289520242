"""What stands beside the step's bench: Pinocchio's kinematics of the same arm, and OSQP on a program of the same size.

    python teach-replay/benches/peers_step.py

Installs what it needs (pin 4.1.0, osqp 1.1.3) into target/peers once. Both are called from Python, so the time of an
empty call of the same library is printed beside and is to be taken off.
"""

import pathlib
import subprocess
import sys
import time
import venv

ROOT = pathlib.Path(__file__).resolve().parents[2]
HOME = ROOT / "target" / "peers"
NEEDS = ["pin==4.1.0", "osqp==1.1.3", "numpy", "scipy"]


def in_own_environment():
    """Starts itself again with the environment's Python, made when it is not there."""
    python = HOME / "bin" / "python"
    if pathlib.Path(sys.prefix) == HOME:
        return
    if not python.exists():
        venv.create(HOME, with_pip=True)
        subprocess.check_call([python, "-m", "pip", "install", "-q", *NEEDS])
    sys.exit(subprocess.call([python, __file__]))


def percentiles(name, call, count=20_000):
    """Times every call by itself."""
    for _ in range(200):
        call()
    took = []
    for _ in range(count):
        began = time.perf_counter_ns()
        call()
        took.append(time.perf_counter_ns() - began)
    took.sort()
    at = lambda part: took[int((count - 1) * part)] * 1e-3
    print(f"{name}: p50 {at(0.5):.2f} us, p99 {at(0.99):.2f}, p99.9 {at(0.999):.2f}")


def pinocchio():
    import numpy
    import pinocchio

    model = pinocchio.buildModelFromUrdf(str(ROOT / "robot" / "models" / "ur5e.urdf"))
    data, frame = model.createData(), model.getFrameId("tool0")
    q = numpy.array([0.3, -0.8, 1.1, -1.6, 0.9, 1.4])
    percentiles("pinocchio, an empty call", lambda: model.getFrameId)
    percentiles("pinocchio, a call that does next to nothing", lambda: model.getFrameId("tool0"))

    def both():
        pinocchio.computeJointJacobians(model, data, q)
        pinocchio.getFrameJacobian(model, data, frame, pinocchio.LOCAL_WORLD_ALIGNED)

    percentiles("pinocchio, forward and Jacobian, 6 joints", both)


def osqp_program():
    import numpy
    import osqp
    from scipy import sparse

    for joints in (6, 7):
        random = numpy.random.default_rng(joints)
        n = joints + 1
        hessian = sparse.diags([1e-2] * joints + [1.0], format="csc")
        gradient = numpy.array([0.0] * joints + [-2.0])
        way = random.uniform(-1, 1, (6, joints))
        goal = random.uniform(-0.2, 0.2, joints)
        rows = sparse.csc_matrix(numpy.vstack([numpy.hstack([way, -(way @ goal)[:, None]]), numpy.eye(n)]))
        low = numpy.array([0.0] * 6 + [-0.15] * joints + [0.0])
        high = numpy.array([0.0] * 6 + [0.15] * joints + [1.0])
        solver = osqp.OSQP()
        solver.setup(hessian, gradient, rows, low, high, verbose=False, eps_abs=1e-6, eps_rel=1e-6, adaptive_rho_interval=25)
        percentiles(f"osqp, {joints} joints, warm, 1e-6", solver.solve, 5_000)


if __name__ == "__main__":
    in_own_environment()
    pinocchio()
    osqp_program()
