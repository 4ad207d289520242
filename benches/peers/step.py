"""What stands beside the step's bench: Pinocchio's kinematics of the same arm, and OSQP on a program of the same size.

    python3 benches/peers/step.py  from anywhere; needs a network for PyPI

Installs what it needs into target/peers. Both are called from Python, so the time of an
empty call of the same library is printed beside and is to be taken off.
"""

import time

from environment import ROOT, with_packages

NEEDS = ["pin==4.1.0", "osqp==1.1.3", "numpy==2.4.6", "scipy==1.17.1"]


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
    with_packages(NEEDS)
    pinocchio()
    osqp_program()
