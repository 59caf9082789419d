"""scipy.optimize.least_squares with the analytic Jacobian. Arguments: lm or trf, then compiled or numpy.

Default tolerances, `x_scale="jac"` because radians and metres are mixed. With `compiled` residual and Jacobian are
numba kernels, so what is timed is scipy's own work and not a slow model; with `numpy` they are the vectorised
functions of `job`.
"""

import sys

import numpy as np
from job import jacobian, position
from mdh_kernel import all_poses, slots
from protocol import full_vector, serve
from scipy.optimize import least_squares

METHOD, KERNEL = sys.argv[1:]


def compiled(job):
    """Residual and Jacobian as functions of the free values, from the kernel."""
    slot, weight, rows, n = slots(job.free), 1 / job.sigma, job.positions.size, len(job.free)
    fixed = (job.nominal, job.free, job.q, job.positions, weight, slot)
    nothing = np.empty(3 * n)

    def residual(values):
        out = np.empty(rows)
        all_poses(values, *fixed, False, out, nothing)
        return out

    def derivative(values):
        out = np.empty(rows * n)
        all_poses(values, *fixed, True, np.empty(rows), out)
        return out.reshape(rows, n)

    return residual, derivative


def vectorised(job):
    """The same in numpy."""
    x = job.nominal.copy()

    def residual(values):
        x[job.free] = values
        return ((position(x, job.q) - job.positions) / job.sigma).ravel()

    def derivative(values):
        x[job.free] = values
        return (jacobian(x, job.q)[:, :, job.free] / job.sigma).reshape(-1, len(job.free))

    return residual, derivative


def prepare(job):
    residual, derivative = {"compiled": compiled, "numpy": vectorised}[KERNEL](job)
    start = job.nominal[job.free]

    def solve():
        return least_squares(residual, start, jac=derivative, method=METHOD, x_scale="jac")

    def answer(result):
        return {"parameters": full_vector(job, result.x), "iterations": int(result.njev or result.nfev)}

    return solve, answer


HOW = f"least_squares(method={METHOD!r}, x_scale='jac'), analytic Jacobian ({KERNEL}), default tolerances"
serve(prepare, HOW, ("scipy", "numpy", "numba"))
