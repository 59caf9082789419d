"""What the evidence of a joint estimate costs robocal: rank, combinations and covariance, leaving views out, memory. One process.

Argument: the job's file, and what: statistics, leave-one-out or solve. Prints one line of JSON.
"""

import json
import resource
import sys
import time

import numpy as np
from joint_worker import problem_of
from protocol import load

from robocal.calibrate.folds import leave_one_out
from robocal.estimate.identifiability import analyse
from robocal.estimate.least_squares import least_squares
from robocal.estimate.uncertainty import uncertainty


def peak() -> float:
    """The largest memory so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main():
    job, what = load(sys.argv[1]), sys.argv[2]
    made = problem_of(job)
    x = least_squares(made, max_iterations=1 if what == "solve" else 100).x
    work = {
        "statistics": lambda: (analyse(made, x), uncertainty(made, x)),
        "leave-one-out": lambda: leave_one_out(made, x, np.arange(made.configurations), "px"),
        "solve": lambda: least_squares(made),
    }[what]
    cold = peak()
    work()  # loads what it needs
    warm, start = peak(), time.process_time()
    work()
    print(json.dumps({"cpu_s": time.process_time() - start, "peak_MB": peak(), "more_MB": warm - cold}))


main()
