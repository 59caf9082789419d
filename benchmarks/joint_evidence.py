"""What the evidence of a joint estimate costs robocal: rank, combinations and covariance, leaving views out, memory; and one fit of
the lengths alone, poses under priors, in a batch of `BATCH` draws. One process.

Argument: the job's file, and what: statistics, leave-one-out, solve, or of a batch likelihood, generalised (until a pass moves
nothing) or one-pass (one linearisation for all draws). Prints one line of JSON; `off_sigma` is the largest difference of a draw from
maximum likelihood of that draw alone.
"""

import json
import re
import resource
import sys
import time
from pathlib import Path

import numpy as np
from joint_worker import problem_of
from protocol import load

from robocal.cables.geometry import cable_robot
from robocal.estimate.generalised.solver import correlate_rows, generalised_least_squares
from robocal.estimate.identifiability import analyse
from robocal.estimate.least_squares import least_squares
from robocal.estimate.uncertainty import uncertainty
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet, Observations
from robocal.prove.folds import unseen
from robocal.prove.split import Split

BATCH, ALONE = 200, 5
PRIOR = [0.02] * 3 + [0.01] * 3  # of a pose: what the job draws its starts from


def peak() -> float:
    """The largest memory so far, MB: of this program, where the system tells it apart from the one that started it."""
    status = Path("/proc/self/status")
    if status.exists():
        return int(re.search(r"VmHWM:\s+(\d+)", status.read_text())[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def draws(job, readings):
    """The lengths of all poses read several times over, (B, poses, 8), and poses known to the prior."""
    poses = len(job.views)
    robot = cable_robot("eight cables", job.anchors, job.platform, free=("ax", "ay", "az", "l0"))
    lengths = Observations(
        "lengths", np.repeat(np.arange(poses), 8), readings.reshape(len(readings), -1, 1), np.full((8 * poses, 1), job.sigma),
        extra={"cable": np.tile(np.arange(8), poses)},
    )  # fmt: skip
    where = Configurations(tuple(map(str, range(poses))), start=job.views)
    return problem(robot, DataSet(where, (lengths,))).with_local_prior(sigma=PRIOR)


def likelihood(job, what):
    """CPU seconds of one draw of the batch, and how far the first few are from themselves alone."""
    rng = np.random.default_rng(0)
    readings = np.reshape(job.length, (1, -1, 8)) + rng.normal(scale=job.sigma, size=(BATCH, len(job.views), 8))
    made = draws(job, readings)
    start = np.repeat(made.start, BATCH, axis=0)
    common = correlate_rows(made)
    work = {
        "likelihood": lambda: least_squares(made, start),
        "generalised": lambda: generalised_least_squares(made, start),
        "one-pass": lambda: least_squares(common, start),
    }[what]
    work()
    began = time.process_time()
    x = work().x
    cpu = (time.process_time() - began) / BATCH
    alone = [least_squares(draws(job, readings[b : b + 1])).x[0] for b in range(ALONE)]
    sigma = np.sqrt(np.diag(generalised_least_squares(made, start).covariance[0]))
    off = (x[:ALONE] - np.array(alone))[:, made.index] / sigma
    return {"cpu_s": cpu, "off_sigma": float(np.abs(off).max())}


def main():
    job, what = load(sys.argv[1]), sys.argv[2]
    if what in ("likelihood", "generalised", "one-pass"):
        print(json.dumps(likelihood(job, what)))
        return
    made = problem_of(job)
    x = least_squares(made, max_iterations=1 if what == "solve" else 100).x
    one = np.eye(made.configurations, dtype=bool)
    rounds = Split(one, ~one, tuple(map(str, range(len(one)))), "leave-one-out")
    work = {
        "statistics": lambda: (analyse(made, x), uncertainty(made, x)),
        "leave-one-out": lambda: unseen(made, x, rounds, ("px",)),
        "solve": lambda: least_squares(made),
    }[what]
    cold = peak()
    work()  # loads what it needs
    warm, start = peak(), time.process_time()
    work()
    print(json.dumps({"cpu_s": time.process_time() - start, "peak_MB": peak(), "more_MB": warm - cold}))


main()
