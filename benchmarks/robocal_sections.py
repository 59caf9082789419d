"""robocal's own sections: the batch, forward kinematics with Jacobian, cost against size, compilation, start-up.

Each function returns rows of plain numbers. Times are medians of several runs; CPU time counts all threads.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import replace

import job as jobs
import numpy as np
from robocal_worker import arm_of, problem_of

from robocal.arms.conventions import chain
from robocal.estimate.identifiability import analyse
from robocal.estimate.least_squares import least_squares
from robocal.measure.base import problem, synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.prove.folds import unseen
from robocal.prove.split import leave_one_out_rounds

BATCH = 10_000
SIZES = (100, 1_000, 10_000, 100_000, 1_000_000)


def _times(call, runs=5):
    """Median wall and CPU seconds after one warm-up."""
    call()
    wall, cpu = [], []
    for _ in range(runs):
        a, b = time.perf_counter(), time.process_time()
        call()
        wall.append(time.perf_counter() - a)
        cpu.append(time.process_time() - b)
    return statistics.median(wall), statistics.median(cpu)


def batch():
    """10 000 Monte Carlo calibrations of the 56-pose job, each with its own noise, through one Problem."""
    instance = jobs.make(0)
    clean = jobs.position(instance.true, instance.q)
    noisy = clean + np.random.default_rng(1).normal(scale=jobs.SIGMA, size=(BATCH, *clean.shape))
    made = problem_of(jobs.nominal(), jobs.NAMES, jobs.FREE, instance.q, noisy, jobs.SIGMA)
    start = np.repeat(made.start, BATCH, axis=0)
    solution = least_squares(made, start)
    wall, cpu = _times(lambda: least_squares(made, start), runs=3)
    spread = solution.x[:, made.index].std(axis=0)
    lin = made.linearize(solution.x[:1])
    predicted = np.sqrt(np.diag(np.linalg.inv(lin.j.T @ lin.j)))
    return [
        {
            "calibrations": BATCH,
            "cpu_us_each": cpu / BATCH * 1e6,
            "wall_us_each": wall / BATCH * 1e6,
            "iterations_max": int(solution.iterations.max()),
            "spread_over_predicted_min": float((spread / predicted).min()),
            "spread_over_predicted_max": float((spread / predicted).max()),
        }
    ]


def forward_kinematics():
    """Pose and Jacobian by all 20 model and 6 tool parameters, and by the joints, for 10^6 configurations."""
    arm = arm_of(jobs.nominal())
    low, high = jobs.LIMITS.T
    q = np.random.default_rng(0).uniform(low, high, (1_000_000, jobs.JOINTS))
    names = [n for n in arm.table.names if not n.startswith("base") and not n.endswith("gain")]
    rows = []
    for what, call in (
        ("pose", lambda: arm.pose(q)),
        ("pose and joint Jacobian (6 x 5)", lambda: arm.jacobian(q)),
        (f"pose and parameter Jacobian (6 x {len(names)})", lambda: arm.parameter_jacobian(q, names)),
    ):
        wall, cpu = _times(call, runs=3)
        rows.append({"what": what, "poses": len(q), "wall_s": wall, "cpu_s": cpu})
    rows.append(
        {"what": "peak memory of this process", "gib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20}
    )
    return rows


def scaling():
    """One calibration against the number of poses and of parameters."""
    rows = []
    for poses in SIZES:
        instance = jobs.make(0, poses)
        made = problem_of(jobs.nominal(), jobs.NAMES, jobs.FREE, instance.q, instance.positions, jobs.SIGMA)
        wall, cpu = _times(lambda made=made: least_squares(made), runs=3)
        rows.append({"poses": poses, "parameters": made.n, "wall_ms": wall * 1e3, "cpu_us_per_pose": cpu / poses * 1e6})
    instance = jobs.make(0, 1000)
    for count in (1, 3, 6, 12, 19):
        made = problem_of(jobs.nominal(), jobs.NAMES, jobs.FREE[:count], instance.q, instance.positions, jobs.SIGMA)
        wall, cpu = _times(lambda made=made: least_squares(made), runs=5)
        rows.append({"poses": 1000, "parameters": count, "wall_ms": wall * 1e3, "cpu_us_per_pose": cpu / 1000 * 1e6})
    return rows


def left_out():
    """The call that leaves each of 150 poses out once, and the problem: an arm of eleven axes, tracker and target free, what is seen."""
    names = [{"alpha": (-1) ** i * np.pi / 2 if i else 0.0, "d": 0.3 * (i % 2 == 0), "a": 0.05} for i in range(11)]
    arm = chain("eleven axes", "mdh", names, tool=(0.02, 0.01, 0.1, 0, 0, 0))
    arm = replace(arm, table=arm.table.with_free([n for n in arm.table.names if n[0] == "j" and n[-5:] != ".gain"]))
    rng, m = np.random.default_rng(0), 150
    true = arm.with_values({n: arm.table[n].value + rng.normal(0, 1e-3) for n in arm.table.free})
    tracker = Frame("tracker", (1.0, 2.0, 0.3, 0.1, 0.2, 1.0), (True,) * 6)
    smr = Frame("smr", (0.0, 0.0, 0.05, 0.0, 0.0, 0.0), (True,) * 6, "tool")
    seen = Observations(
        "pose", np.arange(m), np.zeros((m, 6)), np.full((m, 6), 2e-5), tracker, (smr,), np.zeros(m, dtype=int)
    )
    where = Configurations(tuple(map(str, range(m))), rng.uniform(-2, 2, (m, 11)))
    data = synthesise(true, DataSet(where, (seen,)), rng)
    made = problem(arm, data)
    seen_columns = analyse(made, made.start)
    made = made.with_free(seen_columns.basis if hasattr(seen_columns, "basis") else seen_columns.kept)
    x = least_squares(made).x
    split = leave_one_out_rounds(data)
    return lambda: unseen(made, x, split, ("m", "rad")), made


def leave_one_out():
    """Every one of 150 poses left out once."""
    call, made = left_out()
    wall, cpu = _times(call)
    return [{"poses": 150, "parameters": made.n, "wall_s": wall, "cpu_s": cpu}]


COLD = """
import sys, time
sys.path.insert(0, sys.argv[1])
import numpy as np
a = time.perf_counter()
from robocal.geometry import _kernels as g
from robocal.geometry.path import _kernels as p_
from robocal.estimate import _kernels as e
from robocal.measure import _kernels as m
import job as jobs
from robocal_worker import problem_of
from robocal.estimate.least_squares import least_squares
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet, Frame, Observations
j = jobs.make(0)
least_squares(problem_of(jobs.nominal(), jobs.NAMES, jobs.FREE, j.q, j.positions, jobs.SIGMA))
from robocal_worker import arm_of
n = len(j.q)
free = (True,) * 6
pose = Observations("pose", np.arange(n), np.zeros((n, 6)), np.ones((n, 6)), Frame("a", (1.0, 0, 0, 0, 0, 0), free))
hand = Observations("pose", np.arange(n), np.zeros((n, 6)), np.ones((n, 6)), Frame("b", (1.0, 0, 0, 0, 0, 0), free,
"tool"),
                    (Frame("c", (0.0,) * 6, free, "base"),), np.zeros(n, int))
p = problem(arm_of(jobs.nominal()), DataSet(Configurations(tuple(map(str, range(n))), j.q), (pose, hand)))
p.retract(p.start, np.full((1, p.n), 1e-3)); p.normal(p.start)
print(time.perf_counter() - a)
"""

# A reachable pose, a grid with margins and tensions by every method: what cable robots need beside that.
COLD_CABLES = """
import sys, time
sys.path.insert(0, sys.argv[1])
import numpy as np
import cable_worker as c
from robocal.cables.tension import METHODS
a = time.perf_counter()
c.reach(np.random.default_rng(0), 1)
found = c.grid(c.ROBOT, c.DEMAND, c.cables.SIDES, (2, 2, 2), True)
pose = c.ROBOT.home[None]
for method in METHODS:
    c.distribute(c.structure_of(c.ROBOT, pose), c.cables.weight(1), c.cables.LIMITS, method).missing()
print(time.perf_counter() - a)
"""


def compilation():
    """Seconds to compile the kernels with an empty cache, and to load them from it: those of arms, then those of cables."""
    here = os.path.dirname(os.path.abspath(__file__))
    rows = []
    with tempfile.TemporaryDirectory() as cache:
        env = os.environ | {"ROBOCAL_CACHE_DIR": cache}
        for kernels, code in (("arms", COLD), ("cables", COLD_CABLES)):
            for what in ("cold", "warm, from the cache"):
                done = subprocess.run(
                    [sys.executable, "-c", code, here], env=env, capture_output=True, text=True, check=True
                )
                rows.append({"what": f"kernels of {kernels}, {what}", "wall_s": float(done.stdout.split()[-1])})
    return rows


def start_up():
    """CPU seconds of `robocal --help` as a whole process."""
    cpu = []
    for _ in range(5):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-m", "robocal", "--help"], capture_output=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return [{"what": "robocal --help", "cpu_s_median": statistics.median(cpu), "cpu_s_max": max(cpu)}]


def sections():
    """All of them, by name."""
    return {f.__name__: f() for f in (batch, leave_one_out, forward_kinematics, scaling, compilation, start_up)}


if __name__ == "__main__":
    import json

    print(json.dumps(sections(), indent=1))
