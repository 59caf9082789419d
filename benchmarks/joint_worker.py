"""robocal on the joint jobs. Argument: families for markers as local blocks, columns for markers as free columns."""

import sys

import numpy as np
from protocol import serve

from robocal.cables.geometry import cable_robot
from robocal.estimate.least_squares import least_squares
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.vision.camera import SYMBOLS

FREE = tuple(s for s in SYMBOLS if s != "k3")
SIX = (True,) * 6


def problem_of(job, way="families"):
    """The problem of a job."""
    views, count = len(job.views), len(job.view)
    robot = cable_robot("eight cables", job.anchors, job.platform, free=("ax", "ay", "az", "l0"))
    targets = tuple(Frame(f"m{i}", tuple(v), SIX if i else (False,) * 6) for i, v in enumerate(job.markers))
    pixels = Observations(
        "pixels", np.repeat(job.view, 4), job.uv.reshape(-1, 2), np.full((4 * count, 2), job.corner),
        Frame("eye", tuple(job.eye), SIX, "tool"), targets, np.repeat(job.marker, 4), extra={"point": np.tile(job.corners, (count, 1))},
        options={"camera": "lens", "intrinsics": tuple(job.lens), "free": FREE},
    )  # fmt: skip
    lengths = Observations(
        "lengths", np.repeat(np.arange(views), 8), job.length.reshape(-1, 1), np.full((8 * views, 1), job.sigma),
        extra={"cable": np.tile(np.arange(8), views)},
    )  # fmt: skip
    where = Configurations(tuple(map(str, range(views))), start=job.views)
    local = tuple(t.name for t in targets[1:]) if way == "families" else ()
    made = problem(robot, DataSet(where, (pixels, lengths)), local_targets=local)
    table = made.table.with_priors({f"lens.{s}": float(p) for s, p in zip(FREE, job.lens_prior, strict=True)})
    table = table.with_covariance([f"eye.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")], job.eye_covariance)
    return made.with_table(table).with_loss(job.loss)


def prepare(job):
    made = problem_of(job, WAY)

    def solve():
        return least_squares(made)

    def answer(solution):
        return {
            "cost": float(solution.cost[0]),
            "iterations": int(solution.iterations[0]),
            "corners": 4 * len(job.view),
        }

    return solve, answer


if __name__ == "__main__":
    WAY = sys.argv[1]
    serve(prepare, f"markers as {WAY}", ("numpy", "numba", "scipy"))
