"""robocal on the same job, through the same Problem and Levenberg-Marquardt that every calibration takes."""

from protocol import full_vector, serve

from robocal.arms.conventions import chain
from robocal.estimate.least_squares import least_squares
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet, Observations


def prepare(job):
    rows = [dict(zip(("alpha", "a", "theta", "d"), job.nominal[4 * i : 4 * i + 4], strict=True)) for i in range(5)]
    arm = chain("five axes", "mdh", rows, tool=(*job.nominal[20:23], 0, 0, 0))
    m = len(job.q)
    seen = Observations("position", _range(m), job.positions, job.sigma * _ones((m, 3)))
    data = DataSet(Configurations(tuple(map(str, range(m))), job.q), (seen,))
    made = problem(arm, data, free=[str(job.names[i]) for i in job.free])
    order = [made.table.index[str(job.names[i])] for i in job.free]

    def solve():
        return least_squares(made)

    def answer(solution):
        return {"parameters": full_vector(job, solution.x[0, order]), "iterations": int(solution.iterations[0])}

    return solve, answer


def _range(m):
    import numpy as np

    return np.arange(m)


def _ones(shape):
    import numpy as np

    return np.ones(shape)


if __name__ == "__main__":
    serve(prepare, "Problem and lock-step Levenberg-Marquardt, default tolerances", ("robocal", "numpy", "numba"))
