"""robocal on the cable jobs. Argument: which way (the keys of WAYS)."""

import sys

import cable_job as cables
import numpy as np
from protocol import serve

from robocal.cables.boundary import statics_along
from robocal.cables.cable_lengths import inverse
from robocal.cables.forward import forward
from robocal.cables.geometry import cable_robot
from robocal.cables.interference import box
from robocal.cables.pose_list import PoseBox, reachable_poses
from robocal.cables.prepared import Prepared
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.cables.workspace import Demand, grid
from robocal.geometry import se3

ROBOT = cable_robot("eight crossed cables", cables.A, cables.B, limits=cables.LIMITS, mass=cables.MASS)
DEMAND = Demand(masses=np.array([cables.MASS]))


def tension(job):
    """From structure matrices and wrenches, as the peers are given them."""

    def solve():
        return distribute(job.structure, job.wrench, cables.LIMITS)

    return solve, lambda found: {"tension": found.tension.tolist()}


def tension_of_poses(job):
    """The same from the poses: structure matrices and weights included."""
    pose = se3.compose(job.rotation, job.position)

    def solve():
        weight = gravity_wrench(pose, cables.MASS, ROBOT.com)
        return distribute(structure_of(ROBOT, pose), weight, cables.LIMITS)

    return solve, lambda found: {"tension": found.tension.tolist()}


def tension_singly(job):
    """The same pose by pose, as a controller asks: structure matrix and weight included."""
    pose = [np.ascontiguousarray(p) for p in se3.compose(job.rotation, job.position)]
    ready = Prepared(ROBOT)

    def solve():
        return [ready.tension(p) for p in pose]

    return solve, lambda found: {"tension": [h.tension.tolist() for h in found]}


def placed(job, singly):
    """Poses from lengths, each from its own start: one call each, or all in one."""
    begin = [np.ascontiguousarray(p) for p in se3.compose(job.begin_rotation, job.begin_position)]
    lengths = [np.ascontiguousarray(y) for y in job.length]
    ready, table, start = Prepared(ROBOT), np.array(lengths), np.array(begin)

    def solve():
        if singly:
            return [ready.forward(y, x).pose for y, x in zip(lengths, begin, strict=True)]
        return forward(ROBOT, table, start).pose

    return solve, lambda found: {"place": [p[:3, 3].tolist() for p in found]}


def reach(rng, count):
    """Reachable poses with statics and certified interference, and their tensions and cable lengths."""
    made = reachable_poses(
        ROBOT.a,
        ROBOT.b,
        count,
        rng,
        feasible=statics_along(ROBOT, DEMAND),
        start=ROBOT.home,
        box=PoseBox(0.5 * cables.SCALE * np.ptp(ROBOT.a, axis=0), np.full(3, cables.TURN)),
        diameter=cables.DIAMETER,
        body=box(cables.HALF),
        relief=cables.RELIEF,
    )
    pose = made.poses
    pull = distribute(structure_of(ROBOT, pose), gravity_wrench(pose, cables.MASS, ROBOT.com), cables.LIMITS)
    length, _ = inverse(ROBOT, pose)
    return made.furthest, pull.tension, length


def poses(job, at_once):
    """As many poses as the job has motions, drawn from the job's seed, in lists of `at_once`."""
    count = len(job.translation)

    def solve():
        rng = np.random.default_rng(job.seed)
        return [np.concatenate(x) for x in zip(*(reach(rng, at_once) for _ in range(0, count, at_once)), strict=True)]

    def answer(found):
        return {"furthest": found[0].tolist(), "tension": found[1].tolist(), "length": found[2].tolist()}

    return solve, answer


def cells(job, with_margins):
    """Every cell of the grid."""
    counts = (job.cells,) * 3

    def solve():
        return grid(ROBOT, DEMAND, cables.SIDES, counts, with_margins)

    def answer(found):
        out = {"feasible": found.inside.ravel()[job.sample].tolist(), "share": float(found.inside.mean())}
        return out | ({"margin": found.margin.ravel()[job.hulls].tolist()} if with_margins else {})

    return solve, answer


WAYS = {
    "tension": (tension, "one batch of structure matrices and wrenches"),
    "tension of poses": (tension_of_poses, "one batch of poses"),
    "tension singly": (tension_singly, "a call per pose, prepared"),
    "placed": (lambda job: placed(job, True), "a call per pose, prepared"),
    "placed at once": (lambda job: placed(job, False), "one batch"),
    "list": (lambda job: poses(job, len(job.translation)), "one list"),
    "one": (lambda job: poses(job, 1), "one call per pose"),
    "grid": (lambda job: cells(job, False), "all cells"),
    "margins": (lambda job: cells(job, True), "all cells with capacity margins"),
}

if __name__ == "__main__":
    way, how = WAYS[sys.argv[1]]
    serve(way, how, ("robocal", "numpy", "numba"))
