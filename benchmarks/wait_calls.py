"""What one call of Python takes in a state of the project: CPU seconds, the median of several after one that compiles.

    PYTHONPATH=STATE/src python benchmarks/wait_calls.py CALL

The jobs are those of the benchmarks here, for every state; MOVED says what an older one calls its modules.
"""

import importlib
import statistics
import sys
import time
from types import SimpleNamespace

LISTS = 12_500  # of eight cables each: 10^5 calibrations of one
POSES = 20
MOVED = {
    "robocal.prove.folds": "robocal.calibrate.folds",
    "robocal.prove.split": "robocal.calibrate.split",
    "robocal.prove.identify": "robocal.calibrate.identify",
    "robocal.fit.options": "robocal.calibrate.options",
}


def rename():
    """An older state answers to the names of today."""
    for today, before in MOVED.items():
        try:
            importlib.import_module(today)
        except ModuleNotFoundError:
            sys.modules[today] = importlib.import_module(before)


def placed(singly):
    """500 poses of eight cables from their lengths, each from its own start: one call each, or all in one."""
    import cable_job
    import numpy as np

    from robocal.cables.forward import forward
    from robocal.cables.geometry import cable_robot
    from robocal.cables.prepared import Prepared
    from robocal.geometry import se3

    job = SimpleNamespace(**cable_job.place_job(500))
    robot = cable_robot("eight cables", cable_job.A, cable_job.B, limits=cable_job.LIMITS, mass=cable_job.MASS)
    begin = [np.ascontiguousarray(p) for p in se3.compose(job.begin_rotation, job.begin_position)]
    lengths = [np.ascontiguousarray(y) for y in job.length]
    ready, table, start = Prepared(robot), np.array(lengths), np.array(begin)
    if singly:
        return lambda: [ready.forward(y, x).pose for y, x in zip(lengths, begin, strict=True)]
    return lambda: forward(robot, table, start).pose


def batch():
    """10 000 calibrations of the 56-pose job, each with its own noise, as one problem."""
    import job as jobs
    import numpy as np
    from robocal_worker import problem_of

    from robocal.estimate.least_squares import least_squares

    instance = jobs.make(0)
    clean = jobs.position(instance.true, instance.q)
    noisy = clean + np.random.default_rng(1).normal(scale=jobs.SIGMA, size=(10_000, *clean.shape))
    made = problem_of(jobs.nominal(), jobs.NAMES, jobs.FREE, instance.q, noisy, jobs.SIGMA)
    start = np.repeat(made.start, len(noisy), axis=0)
    return lambda: least_squares(made, start)


def leave_one_out():
    """Every one of 150 poses of an arm of eleven axes left out once."""
    import robocal_sections

    return robocal_sections.left_out()[0]


def cross_validation(way):
    """Five folds of the 56-pose job: of its 19 parameters, or of a whole identification."""
    import job as jobs
    import robocal_worker

    instance = jobs.make(0)
    job = SimpleNamespace(
        nominal=jobs.nominal(), names=list(jobs.NAMES), free=jobs.FREE, q=instance.q, positions=instance.positions, sigma=jobs.SIGMA
    )  # fmt: skip
    return robocal_worker.WAYS[way][0](job)[0]


def joint(views, grid):
    """Corners of markers, cable lengths, lens and anchors in one estimate."""
    import joint_job
    import joint_worker

    from robocal.estimate.least_squares import least_squares

    made = joint_worker.problem_of(SimpleNamespace(**joint_job.make(views, grid)))
    return lambda: least_squares(made)


def cable_calibrations():
    """10^5 cables, each from 20 poses."""
    import cable_job
    import numpy as np

    from robocal.cables.calibration.per_cable import per_cable
    from robocal.cables.geometry import cable_robot
    from robocal.geometry import se3

    robot = cable_robot("eight cables", cable_job.A, cable_job.B, limits=cable_job.LIMITS, mass=cable_job.MASS)
    rng = np.random.default_rng(0)
    move = np.concatenate(
        [rng.uniform(-0.7, 0.7, (LISTS, POSES, 3)), rng.uniform(-0.25, 0.25, (LISTS, POSES, 3))], axis=2
    )
    move[..., :3] += cable_job.A.mean(axis=0)
    pose = se3.from_vector(move)
    ends = np.einsum("lpij,cj->lpci", pose[..., :3, :3], cable_job.B) + pose[..., None, :3, 3]
    read = np.linalg.norm(ends - cable_job.A, axis=3) + rng.normal(scale=1e-3, size=(LISTS, POSES, len(cable_job.A)))
    return lambda: per_cable(robot, pose, read)


CALLS = {
    "batch of 10 000 calibrations": (batch, 5),
    "leave-one-out, 150 poses of eleven axes": (leave_one_out, 5),
    "cross-validation of 56 poses, five folds": (lambda: cross_validation("folds"), 25),
    "cross-validation of 56 poses, identify --folds 5": (lambda: cross_validation("identify"), 15),
    "joint estimate, 100 views of 85 markers": (lambda: joint(100, (17, 5)), 9),
    "joint estimate, 1000 views of 108 markers": (lambda: joint(1000, (12, 9)), 3),
    "forward kinematics, 500 poses one by one": (lambda: placed(True), 15),
    "forward kinematics, 500 poses in a batch": (lambda: placed(False), 15),
    "cable calibrations, 100 000": (cable_calibrations, 3),
}


def measure(name):
    """CPU seconds of a call."""
    make, runs = CALLS[name]
    rename()
    call, seconds = make(), []
    for _ in range(runs + 1):
        began = time.process_time()
        call()
        seconds.append(time.process_time() - began)
    return statistics.median(seconds[1:])


if __name__ == "__main__":
    print(measure(sys.argv[1]))
