"""robocal on the same job, through the same Problem and Levenberg-Marquardt that every calibration takes."""

import numpy as np
from protocol import full_vector, serve

from robocal.arms.conventions import chain
from robocal.estimate.least_squares import least_squares
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet, Observations


def arm_of(nominal):
    """The arm of the job: five modified-DH joints and a tool point."""
    rows = [dict(zip(("alpha", "a", "theta", "d"), nominal[4 * i : 4 * i + 4], strict=True)) for i in range(5)]
    return chain("five axes", "mdh", rows, tool=(*nominal[20:23], 0, 0, 0))


def problem_of(nominal, names, free, q, positions, sigma):
    """The least-squares problem; positions (m, 3), or (B, m, 3) for a batch."""
    m = len(q)
    seen = Observations("position", np.arange(m), positions, np.full((m, 3), float(sigma)))
    data = DataSet(Configurations(tuple(map(str, range(m))), q), (seen,))
    return problem(arm_of(nominal), data, free=[str(names[i]) for i in free])


def prepare(job):
    made = problem_of(job.nominal, job.names, job.free, job.q, job.positions, job.sigma)
    order = [made.table.index[str(job.names[i])] for i in job.free]

    def solve():
        return least_squares(made)

    def answer(solution):
        return {"parameters": full_vector(job, solution.x[0, order]), "iterations": int(solution.iterations[0])}

    return solve, answer


if __name__ == "__main__":
    serve(prepare, "Problem and lock-step Levenberg-Marquardt, default tolerances", ("robocal", "numpy", "numba"))
