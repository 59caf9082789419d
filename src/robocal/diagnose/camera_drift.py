"""A camera that moved steadily while its views were taken, too slowly for a step: its frame with a speed of its own.

    r = J x + t J_f v,    share = 1 - |r - J x - t J_f v|^2 / |r|^2,    t = -1 at the first view ... 1 at the last

J_f are the columns of its frame. Errors of an arm that nobody calibrated look like this for a part of the squares, the larger the more the
order of the views goes along one joint. Six numbers that explain nearly all of some thousand pixels are a motion of the camera, or of what
carries its target.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.diagnose.check_registry import Context, Finding, When, check, doubt
from robocal.diagnose.vision_limits import CAMERA_DRIFT, CAMERA_DRIFT_VIEWS
from robocal.estimate.elimination import triangle
from robocal.estimate.problem import Problem
from robocal.estimate.terms import Linear
from robocal.fit.noise import owners
from robocal.geometry import se3, so3
from robocal.measure.machine import Model
from robocal.parameters import FRAME_SYMBOLS
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__ = ["camera_drift", "steady_motion"]

EPS = float(np.finfo(float).eps)


def steady_motion(problem: Problem, lin: Linear, own: Bools, at: Sequence[int], views: Ints) -> tuple[float, Array]:
    """The share of the squares of rows `own` (N,) that a steady motion of the frame in columns `at` over the `views` explains, and half of
    that motion, (6,)."""
    time = np.where(own, np.interp(lin.configuration, views, np.linspace(-1, 1, len(views))), 0.0)
    scales = np.concatenate([problem.scales, problem.scales[at], [1.0]])
    root = triangle(np.hstack([lin.j, lin.j[:, at] * time[:, None], lin.r[:, None]])) * scales
    step = np.linalg.lstsq(root[:, :-1], -root[:, -1], rcond=len(lin.r) * EPS)[0]
    less = float(lin.r @ lin.r) - float(np.sum((root[:, -1] + root[:, :-1] @ step) ** 2))
    return less / float(lin.r[own] @ lin.r[own]), step[problem.n :] * problem.scales[at]


@check("camera-drift", When.FIT, order=235, needs=("fit",))
def camera_drift(context: Context[Model]) -> Iterator[Finding]:
    """Every camera whose frame is free and of which a steady motion explains most of what is left."""
    fit = context.need_fit
    problem, lin = fit.problem, context.jacobian
    if problem.blocks or lin.jm.shape[1]:
        return
    # A row of a term is one observation; which terms are of which camera is said by their order.
    counts = [int(t.used.sum()) * t.scale.shape[1] for t in problem.terms]
    camera = np.repeat([number for number, _ in owners(fit.data, problem)], counts)
    if len(camera) != len(lin.r):
        return
    for number, obs in enumerate(fit.data.observations):
        if obs.kind != "pixels" or obs.frame is None:
            continue
        names = [f"{obs.frame.name}.{s}" for s in FRAME_SYMBOLS]
        views = np.unique(obs.configuration if obs.used is None else obs.configuration[obs.used])
        own = camera == number
        if len(views) < CAMERA_DRIFT_VIEWS or not set(names) <= set(problem.free) or not own.any():
            continue
        at = [problem.free.index(n) for n in names]
        share, step = steady_motion(problem, lin, own, at, views)
        if share <= CAMERA_DRIFT:
            continue
        ends = []
        for way in (-1.0, 1.0):
            move = np.zeros((1, problem.n))
            move[0, at] = way * step
            x = problem.retract(fit.solution.x, move)[0]
            ends.append(se3.inverse(se3.from_vector(np.array([x[problem.table.index[n]] for n in names]))))
        first, last = ends if obs.frame.mount == "base" else map(se3.inverse, ends)
        shift = float(np.linalg.norm(last[:3, 3] - first[:3, 3]))
        turn = float(np.linalg.norm(so3.log(last[:3, :3] @ first[:3, :3].T)))
        yield doubt(
            Code.CAMERA_DRIFT, group=obs.label, shift=Quantity(shift), turn=Quantity(turn, "rad"), share=min(share, 1.0)
        )
