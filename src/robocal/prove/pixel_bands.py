"""How surely a lens that was found says where a point is seen, as the spread of a pixel.

    b = (lens, poses of the views)          C = cov(b), with the poses eliminated view by view
    dq = J_lens dlens + J_point mean_v( dT_v T_v^-1 X )

A point that stands still in the targets' frames is seen elsewhere when lens and poses move together: what both say alike of it cancels,
as f and distance do. The mean over the views stands for the one frame that all of them are in. Source: mrcal, "Projection uncertainty"
(Kogan; method mean-pcam).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array
from robocal.geometry import se3, so3
from robocal.measure.machine import Rig
from robocal.prove.decision import Decision

__all__ = ["pixel_covariance"]


def pixel_covariance(
    made: Decision[Rig], points: Array, to_point: Array, to_lens: Array, names: Sequence[str], far: bool = False
) -> Array:
    """Covariances (m, 2, 2) in px^2 of where points (m, 3) in the camera's frame are seen; `far`: they are directions. Derivatives of
    a pixel by its point (m, 2, 3) and by numbers of the lens (m, 2, k), which are called `names`."""
    fit, off = made.need_fit, made.need_fit.total
    # A target that is printed too large is too far away, and seen at the same pixels.
    at = [k for k, n in enumerate(off.names) if n in fit.problem.table]
    known, hidden = tuple(off.names[k] for k in at), off.hidden[np.ix_(at, at)]
    spread = off.noise[np.ix_(at, at)] + hidden @ hidden.T
    numbers = np.zeros(
        (len(points), 2, len(known))
    )  # what else the views share, as places of markers, moves the poses alone
    own = [k for k, n in enumerate(known) if n in names]
    numbers[:, :, own] = to_lens[:, :, [names.index(known[k]) for k in own]]
    problem, x = fit.problem.with_free(known), fit.solution.x
    lin = problem.linearize(x)
    views = problem.configurations
    poses = se3.from_vector(problem.values_of(0, x)[0].reshape(views, 6))
    # Of each view: what its own pose says, and what it shares with the lens.
    mine, shared = np.zeros((views, 6, 6)), np.zeros((views, 6, len(known)))
    np.add.at(mine, lin.local, lin.jl[:, :, None] * lin.jl[:, None, :])
    np.add.at(shared, lin.local, lin.jl[:, :, None] * lin.j[:, None, :])
    used = np.unique(lin.local)
    poses, inverse = poses[used], np.linalg.inv(mine[used])
    answer = -inverse @ shared[used]  # dpose / dlens
    lever = np.repeat(points[:, None], len(used), axis=1) - (0.0 if far else poses[:, :3, 3])
    shift = np.broadcast_to(np.zeros((3, 3)) if far else np.eye(3), (*lever.shape, 3))
    move = np.concatenate([shift, -so3.skew(lever)], axis=3)  # (m, V, 3, 6)
    g = numbers + to_point @ (move @ answer).mean(axis=1)
    rest = _scale(made) / len(used) ** 2 * (move @ inverse @ np.swapaxes(move, 2, 3)).sum(axis=1)
    return np.asarray(g @ spread @ np.swapaxes(g, 1, 2) + to_point @ rest @ np.swapaxes(to_point, 1, 2))


def _scale(made: Decision[Rig]) -> float:
    """What turns the covariance of the stated noise into that of what was left, views that differ among themselves included."""
    names, off = made.need_fit.problem.free, made.need_fit.total
    stated, left = (
        np.diag(made.need_fit.uncertainty.covariance),
        np.diag(off.noise)[[off.names.index(n) for n in names]],
    )
    return float(np.median(left / stated)) if names else 1.0
