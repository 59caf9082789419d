"""What one call of Python takes in a state of the project: CPU seconds, the median of several after one that compiles.

    PYTHONPATH=STATE/src python benchmarks/wait_calls.py STATE/benchmarks CALL

The jobs are those of the state's own benchmarks, whose workers know what its modules are called.
"""

import statistics
import sys
import time
from types import SimpleNamespace

LISTS = 12_500  # of eight cables each: 10^5 calibrations of one
POSES = 20


def placed(singly):
    """500 poses of eight cables from their lengths."""
    import cable_job
    import cable_worker

    job = SimpleNamespace(**cable_job.place_job(500))
    return cable_worker.placed(job, singly)[0]


def leave_one_out():
    """Every one of 150 poses of an arm of eleven axes left out once; its own clock."""
    import robocal_sections

    return lambda: robocal_sections.leave_one_out()[0]["cpu_s"]


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
    from cable_worker import ROBOT

    from robocal.cables.calibration.per_cable import per_cable
    from robocal.geometry import se3

    rng = np.random.default_rng(0)
    move = np.concatenate(
        [rng.uniform(-0.7, 0.7, (LISTS, POSES, 3)), rng.uniform(-0.25, 0.25, (LISTS, POSES, 3))], axis=2
    )
    move[..., :3] += cable_job.A.mean(axis=0)
    pose = se3.from_vector(move)
    ends = np.einsum("lpij,cj->lpci", pose[..., :3, :3], cable_job.B) + pose[..., None, :3, 3]
    read = np.linalg.norm(ends - cable_job.A, axis=3) + rng.normal(scale=1e-3, size=(LISTS, POSES, len(cable_job.A)))
    return lambda: per_cable(ROBOT, pose, read)


CALLS = {
    "forward kinematics, 500 poses one by one": (lambda: placed(True), 15),
    "forward kinematics, 500 poses in a batch": (lambda: placed(False), 15),
    "leave-one-out, 150 poses of eleven axes": (leave_one_out, 1),
    "joint estimate, 40 views of 35 markers": (lambda: joint(40, (7, 5)), 7),
    "cable calibrations, 100 000": (cable_calibrations, 3),
}


def measure(name):
    """CPU seconds of a call; what has a clock of its own returns them."""
    make, runs = CALLS[name]
    call, seconds = make(), []
    if runs == 1:
        return call()
    for _ in range(runs + 1):
        began = time.process_time()
        call()
        seconds.append(time.process_time() - began)
    return statistics.median(seconds[1:])


if __name__ == "__main__":
    sys.path.insert(0, sys.argv[1])
    print(measure(sys.argv[2]))
