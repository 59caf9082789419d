"""How surely a lens that was found says where a point is seen, as the spread of a pixel.

    b = (lens, poses of the views)          C = cov(b), with the poses eliminated view by view
    dq = J_lens dlens + J_point mean_v( dT_v T_v^-1 X )

A point that stands still in the targets' frames is seen elsewhere when lens and poses move together: what both say alike of it cancels,
as f and distance do. The mean over the views stands for the one frame that all of them are in. Source: mrcal, "Projection uncertainty"
(Kogan; method mean-pcam).
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.estimate.problem import Problem
from robocal.geometry import se3, so3
from robocal.measure.machine import Rig
from robocal.prove.decision import Decision
from robocal.vision.camera import project

__all__ = ["pixel_covariance"]


def pixel_covariance(made: Decision[Rig], points: Array, numbers: Array, symbols: tuple[str, ...], far: bool = False) -> Array:
    """Covariances (m, 2, 2) in px^2 of where points (m, 3) in the camera's frame are seen; `far`: they are directions. `numbers` are those
    of the lens, in the order of `symbols`."""
    fit = made.need_fit
    off = fit.total
    names = tuple(n for n in off.names if n in fit.problem.table)  # a scale of the target moves the poses alone
    spread = off.covariance[np.ix_(*2 * [[off.names.index(n) for n in names]])]
    problem = fit.problem.with_free(names)
    x = fit.solution.x
    lin = problem.linearize(x)
    views = fit.problem.configurations
    poses = se3.from_vector(problem.values_of(0, x)[0].reshape(views, 6)) if problem.families else np.zeros((0, 4, 4))
    # Of each view: what its own pose says, and what it shares with the lens.
    block = np.einsum("ni,nj->nij", lin.jl, lin.jl)
    cross = np.einsum("ni,nj->nij", lin.jl, lin.j)
    own = np.zeros((views, *block.shape[1:]))
    shared = np.zeros((views, *cross.shape[1:]))
    np.add.at(own, lin.local, block)
    np.add.at(shared, lin.local, cross)
    used = np.flatnonzero(np.bincount(lin.local, minlength=views))
    inverse = np.linalg.inv(own[used])
    scale = _scale(made, problem)
    answer = -inverse @ shared[used]  # dpose / dlens
    out = np.empty((len(points), 2, 2))
    jp, ji = project(points, numbers)[1:]
    at = [symbols.index(n.rpartition(".")[2]) for n in names]
    for k, (point, to_point, to_lens) in enumerate(zip(points, jp, ji[:, :, at], strict=True)):
        lever = point - (0.0 if far else poses[used, :3, 3])
        move = np.concatenate([np.zeros((len(used), 3, 3)) if far else np.repeat(np.eye(3)[None], len(used), 0), -so3.skew(np.broadcast_to(lever, (len(used), 3)))], axis=2)
        g = to_lens + to_point @ (move @ answer).mean(axis=0)
        rest = (move @ inverse @ np.swapaxes(move, 1, 2)).sum(axis=0) * scale / len(used) ** 2
        out[k] = g @ spread @ g.T + to_point @ rest @ to_point.T
    return out


def _scale(made: Decision[Rig], problem: Problem) -> float:
    """What turns the covariance of the stated noise into that of what was left, views that differ among themselves included."""
    names = made.need_fit.problem.free
    at = [made.need_fit.total.names.index(n) for n in names]
    stated, left = np.diag(made.need_fit.uncertainty.covariance), np.diag(made.need_fit.total.noise)[at]
    return float(np.median(left / stated)) if len(names) else 1.0
