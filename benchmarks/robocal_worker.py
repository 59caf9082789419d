"""robocal on the same job, through the same Problem and Levenberg-Marquardt that every calibration takes.

Argument: none for one calibration, folds for five-fold cross-validation of the same parameters, identify for the whole
procedure with five folds.
"""

import sys
from dataclasses import replace

import numpy as np
from protocol import full_vector, serve

from robocal.arms.conventions import chain
from robocal.estimate.least_squares import least_squares
from robocal.fit.options import Options
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet, Observations
from robocal.prove.folds import unseen
from robocal.prove.identify import identify
from robocal.prove.split import Split

FOLDS = 5


def arm_of(nominal):
    """The arm of the job: five modified-DH joints and a tool point."""
    rows = [dict(zip(("alpha", "a", "theta", "d"), nominal[4 * i : 4 * i + 4], strict=True)) for i in range(5)]
    return chain("five axes", "mdh", rows, tool=(*nominal[20:23], 0, 0, 0))


def data_of(q, positions, sigma):
    """Positions (m, 3), or (B, m, 3) for a batch, seen in base coordinates."""
    m = len(q)
    seen = Observations("position", np.arange(m), positions, np.full((m, 3), float(sigma)))
    return DataSet(Configurations(tuple(map(str, range(m))), q), (seen,))


def problem_of(nominal, names, free, q, positions, sigma):
    """The least-squares problem; positions (m, 3), or (B, m, 3) for a batch."""
    return problem(arm_of(nominal), data_of(q, positions, sigma), free=[str(names[i]) for i in free])


def prepare(job):
    made = problem_of(job.nominal, job.names, job.free, job.q, job.positions, job.sigma)
    order = [made.table.index[str(job.names[i])] for i in job.free]

    def solve():
        return least_squares(made)

    def answer(solution):
        return {"parameters": full_vector(job, solution.x[0, order]), "iterations": int(solution.iterations[0])}

    return solve, answer


def folds_of(m):
    """FIGAROH's folds: a permutation with its default seed, cut into five."""
    held = np.zeros((FOLDS, m), dtype=bool)
    for k, part in enumerate(np.array_split(np.random.default_rng(0).permutation(m), FOLDS)):
        held[k, part] = True
    return Split(held, ~held, tuple(map(str, range(FOLDS))), "5 folds")


def rms(errors, split):
    """Mean over folds of the rms of all coordinates, in mm; errors (m,) are lengths in m."""
    return 1e3 * float(np.mean([np.sqrt(np.mean(errors[held] ** 2) / 3) for held in split.held_out]))


def prepare_folds(job):
    made = problem_of(job.nominal, job.names, job.free, job.q, job.positions, job.sigma)
    split = folds_of(len(job.q))

    def solve():
        # From the nominal values to the fit of everything, and from there to every fold.
        return unseen(made, least_squares(made).x, split, ("m",))

    return solve, lambda found: {"k_fold_rms_mm": rms(found.value["m"], split)}


def prepare_identify(job):
    arm, data = arm_of(job.nominal), data_of(job.q, job.positions, job.sigma)
    # All that the table has: which 19 can be seen is for the identification to find.
    arm = replace(arm, table=arm.table.with_free([str(n) for n in job.names]))
    options = Options(folds=FOLDS)

    def solve():
        return identify(arm, data, options)

    return solve, lambda found: {"k_fold_rms_mm": 1e3 * found.stages[0].k_fold.rms / np.sqrt(3)}


WAYS = {
    "": (prepare, "Problem and lock-step Levenberg-Marquardt, default tolerances"),
    "folds": (prepare_folds, "the job's 19 parameters, five folds as one batch"),
    "identify": (prepare_identify, "start, noise, selection among all parameters, five folds, verdict, covariance"),
}

if __name__ == "__main__":
    way, how = WAYS[sys.argv[1] if len(sys.argv) > 1 else ""]
    serve(way, how, ("robocal", "numpy", "numba"))
