"""Ceres through pyceres on the joint jobs: a cost function per marker that a view sees and one for the lengths of a view, their
residuals and Jacobians compiled. Argument: dense or sparse Schur; Ceres chooses what it eliminates, pyceres has no say in it."""

import sys

import numpy as np
import pyceres
from joint_kernel import eye_prior, length, sight
from protocol import serve

NOTHING = np.empty(64)


class Sight(pyceres.CostFunction):
    def __init__(self, corners, uv, sigma):
        pyceres.CostFunction.__init__(self)
        self.set_num_residuals(8)
        self.set_parameter_block_sizes([6, 6, 6, 8])
        self.fixed = (corners, uv, sigma)

    def Evaluate(self, parameters, residuals, jacobians):
        parts = [NOTHING] * 4 if jacobians is None else [NOTHING if j is None else j for j in jacobians]
        sight(*parameters, *self.fixed, residuals, *parts)
        return True


class Lengths(pyceres.CostFunction):
    def __init__(self, tips, values, sigma):
        pyceres.CostFunction.__init__(self)
        self.set_num_residuals(8)
        self.set_parameter_block_sizes([6] + [4] * 8)
        self.tips, self.values, self.sigma = tips, values, sigma

    def Evaluate(self, parameters, residuals, jacobians):
        if jacobians is not None:
            for j in jacobians[1:]:
                j[:] = 0.0
        for i in range(8):
            by_view = NOTHING[:6] if jacobians is None else jacobians[0][6 * i : 6 * i + 6]
            by_cable = NOTHING[:4] if jacobians is None else jacobians[1 + i][4 * i : 4 * i + 4]
            length(
                parameters[0],
                parameters[1 + i],
                self.tips[i],
                self.values[i],
                self.sigma,
                residuals[i : i + 1],
                by_view,
                by_cable,
            )
        return True


class Prior(pyceres.CostFunction):
    """An eye's (root), or a list of numbers each with its own sigma."""

    def __init__(self, mean, root, numbers):
        pyceres.CostFunction.__init__(self)
        self.set_num_residuals(len(mean))
        self.set_parameter_block_sizes([len(mean)])
        self.mean, self.root, self.numbers = mean, root, numbers

    def Evaluate(self, parameters, residuals, jacobians):
        if self.numbers:
            r, j = self.root @ (parameters[0] - self.mean), self.root
        else:
            r, j = eye_prior(parameters[0], self.mean, self.root)
        residuals[:] = r
        if jacobians is not None:
            jacobians[0][:] = j.ravel()
        return True


def prepare(job):
    start = [np.array(v, dtype=float) for v in (job.views, job.markers, job.eye, job.lens[:8])]
    start.append(np.column_stack([job.anchors, np.zeros(8)]))
    now = [v.copy() for v in start]
    views, markers, eye, lens, cables = now
    corners = np.ascontiguousarray(job.corners, dtype=float).ravel()
    uv = np.ascontiguousarray(job.uv, dtype=float).reshape(len(job.view), 8)
    lengths, tips = np.array(job.length, dtype=float).reshape(-1, 8), np.array(job.platform, dtype=float)
    root = np.linalg.inv(np.linalg.cholesky(job.eye_covariance))
    problem, costs = pyceres.Problem(), []

    def loss():
        return pyceres.HuberLoss(float(job.tuning)) if str(job.loss) == "huber" else None

    def add(cost, blocks, by=None):
        costs.append(cost)
        problem.add_residual_block(cost, by, blocks)

    for s, (v, m) in enumerate(zip(job.view, job.marker, strict=True)):
        add(Sight(corners, uv[s], float(job.corner)), [views[v], eye, markers[m], lens], loss())
    for v in range(len(views)):
        add(Lengths(tips, lengths[v], float(job.sigma)), [views[v], *cables], loss())
    add(Prior(start[2], root, False), [eye])
    add(Prior(start[3], np.diag(1 / np.asarray(job.lens_prior, float)), True), [lens])
    if 0 in job.marker:
        problem.set_parameter_block_constant(markers[0])
    options = pyceres.SolverOptions()
    kind = pyceres.LinearSolverType
    options.linear_solver_type = kind.DENSE_SCHUR if SOLVER == "dense" else kind.SPARSE_SCHUR
    options.num_threads, options.max_num_iterations = 1, 200
    options.function_tolerance, options.gradient_tolerance, options.parameter_tolerance = 1e-10, 1e-16, 1e-16
    options.minimizer_progress_to_stdout = False
    options.logging_type = pyceres.LoggingType.SILENT

    def solve():
        for a, b in zip(now, start, strict=True):
            a[:] = b
        summary = pyceres.SolverSummary()
        pyceres.solve(options, problem, summary)
        return summary

    def answer(summary):
        return {
            "cost": summary.final_cost,
            "iterations": summary.num_successful_steps - 1,
            "corners": 4 * len(job.view),
        }

    return solve, answer


if __name__ == "__main__":
    SOLVER = sys.argv[1]
    serve(prepare, f"a cost function per marker seen, compiled, {SOLVER} Schur", ("pyceres", "numpy", "numba"))
