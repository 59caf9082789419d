"""Ceres through pyceres with the same analytic Jacobian. Arguments: pose or all, then compiled or numpy.

One cost function per pose is how Ceres is meant to be used and what its documentation shows; one for all 56 is kinder
to Python, since the interpreter is then entered once per evaluation and not 56 times. `compiled` takes the derivative
from a numba kernel, the best that can be done from Python; `numpy` from vectorised numpy, as most users would write
it. Default tolerances, one thread (the interpreter lock allows no more), DENSE_NORMAL_CHOLESKY because it was faster
here than DENSE_QR with the same answer. Cost functions and problem are built beforehand: only `solve` is timed.
"""

import sys

import numpy as np
import pyceres
from job import jacobian, position
from mdh_kernel import all_poses, pose_free, slots
from protocol import full_vector, serve

WAY, KERNEL = sys.argv[1:]


class Compiled(pyceres.CostFunction):
    """Residual and Jacobian of some poses, written by a compiled kernel straight into Ceres' arrays."""

    def __init__(self, job, q, positions):
        pyceres.CostFunction.__init__(self)
        self.set_num_residuals(positions.size)
        self.set_parameter_block_sizes([len(job.free)])
        self.kernel = pose_free if q.ndim == 1 else all_poses
        self.fixed = (job.nominal, job.free, q, positions, 1 / job.sigma, slots(job.free))
        self.nothing = np.empty(3 * len(job.free))

    def Evaluate(self, parameters, residuals, jacobians):
        if jacobians is None:
            self.kernel(parameters[0], *self.fixed, False, residuals, self.nothing)
        else:
            self.kernel(parameters[0], *self.fixed, True, residuals, jacobians[0])
        return True


class Numpy(pyceres.CostFunction):
    """The same, from the vectorised numpy functions of `job`."""

    def __init__(self, job, q, positions):
        pyceres.CostFunction.__init__(self)
        self.set_num_residuals(positions.size)
        self.set_parameter_block_sizes([len(job.free)])
        self.job, self.q, self.positions = job, np.atleast_2d(q), np.atleast_2d(positions)
        self.x = job.nominal.copy()

    def Evaluate(self, parameters, residuals, jacobians):
        self.x[self.job.free] = parameters[0]
        residuals[:] = ((position(self.x, self.q) - self.positions) / self.job.sigma).ravel()
        if jacobians is not None:
            jacobians[0][:] = (jacobian(self.x, self.q)[:, :, self.job.free] / self.job.sigma).ravel()
        return True


def prepare(job):
    start = job.nominal[job.free]
    x = start.copy()
    cost = {"compiled": Compiled, "numpy": Numpy}[KERNEL]
    if WAY == "pose":
        costs = [cost(job, q, y) for q, y in zip(job.q, job.positions, strict=True)]
    else:
        costs = [cost(job, job.q, job.positions)]
    problem = pyceres.Problem()
    for one in costs:
        problem.add_residual_block(one, None, [x])
    options = pyceres.SolverOptions()
    options.linear_solver_type = pyceres.LinearSolverType.DENSE_NORMAL_CHOLESKY
    options.minimizer_progress_to_stdout = False
    options.logging_type = pyceres.LoggingType.SILENT
    options.num_threads = 1

    def solve():
        x[:] = start
        summary = pyceres.SolverSummary()
        pyceres.solve(options, problem, summary)
        return summary

    def answer(summary):
        if not summary.IsSolutionUsable():
            raise RuntimeError(summary.BriefReport())
        # Ceres counts the evaluation of the start as a successful step
        return {"parameters": full_vector(job, x), "iterations": summary.num_successful_steps - 1, "costs": len(costs)}

    return solve, answer


HOW = "a cost function per pose" if WAY == "pose" else "one cost function for all poses"
serve(
    prepare,
    f"{HOW}, analytic Jacobian ({KERNEL}), DENSE_NORMAL_CHOLESKY, default tolerances",
    ("pyceres", "numpy", "numba"),
)
