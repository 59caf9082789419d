"""What errors of a robot's poses do to frames that were fitted alone, where the poses are given and not computed from joints.

    r = J x + Z e + n,    e ~ N(0, k^2 I),    n ~ N(0, v^2)        whitened; Z_i = J_i S, the pose of configuration i in S = (1 mm, 2 mrad)

Every pose has an error of its own. An orthogonal change of the rows of each configuration takes Z_i to its singular values d, six rows
at most, and leaves rows without any. So V = v^2 (1 + l d^2), l = k^2 / v^2, is diagonal, and the restricted likelihood costs little:

    -2 log L(l) = sum log(1 + l d^2) + log |X' V^-1 X| + (N - n) log y' P y,      cov(x) = v^2 X+ (1 + l d^2) X+'

Source: Patterson and Thompson (1971); the size of the errors: ISO 9283 absolute accuracy of arms that were not calibrated.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.diagnose.limits import ARM_EXPLAINS, ROBOT_PLACE, ROBOT_TURN
from robocal.estimate.elimination import reweight
from robocal.estimate.terms import Linear
from robocal.fit.fit import Fit
from robocal.measure.base import problem as build
from robocal.measure.machine import Rig

__all__ = ["PoseShare", "pose_share"]

RATIOS = np.concatenate([[0.0], np.logspace(-6, 6, 241)])  # grid: of k^2 to v^2
RANK = 1e-10  # tolerance: of the largest singular value: a direction that no row tells


@record
class PoseShare:
    """`square`: what the frames leave, whitened; `robot`: what poses that are off by S would leave; `covariance` (n, n) of the fitted
    frames with errors of the poses, None where noise explains what is left; `size`: these errors, in S."""

    square: float
    robot: float
    covariance: Array | None
    size: float


def pose_share(fit: Fit) -> PoseShare:
    """Of a fit to poses that are given, in which frames alone are free."""
    problem, x = fit.problem, fit.solution.x
    values = dict(zip(problem.table.names, x[0].tolist(), strict=False))
    every = build(Rig(), fit.data, values=values).with_weights(problem.weights).with_free(problem.free)
    lin = reweight(every.linearize(every.start), every)
    held = (
        every.prior_root
        @ np.column_stack([np.eye(every.n), every.difference(every.start)[0]])
        * np.append(every.scales, 1.0)
    )
    design, y, d = _rows(lin, every.scales, held)
    u, size, vt = np.linalg.svd(design, full_matrices=False)
    kept = size > RANK * size[0]
    basis = u[:, kept]
    count = max(len(lin.r) - int(kept.sum()), 1)
    spread = 1 + RATIOS[:, None] * d**2
    weight = 1 / spread
    a = np.einsum("ki,ia,ib->kab", weight, basis, basis, optimize=True)
    b = (weight * y) @ basis
    rest = (weight * y) @ y - np.einsum("ka,ka->k", b, np.linalg.solve(a, b[..., None])[..., 0])
    variance = np.maximum(rest, np.finfo(float).tiny) / count
    likelihood = -0.5 * (np.log(spread).sum(axis=1) + np.linalg.slogdet(a)[1] + count * np.log(variance))
    best = int(np.argmax(likelihood))
    square = float(rest[0])
    robot = float(d**2 @ (1 - np.sum(basis**2, axis=1)))
    if not likelihood[best] - likelihood[0] > ARM_EXPLAINS:
        return PoseShare(square, robot, None, 0.0)
    inverse = (vt[kept].T / size[kept]) @ basis.T * every.scales[:, None]
    noise = variance[best] * spread[best]
    noise[len(noise) - len(held) :] = 1.0  # what is known beforehand has its own sigma, whatever the readings leave
    covariance = (inverse * noise) @ inverse.T
    return PoseShare(square, robot, covariance, float(np.sqrt(variance[best] * RATIOS[best])))


def _rows(lin: Linear, scales: Array, held: Array) -> tuple[Array, Array, Array]:
    """X (M, n) in expected errors, y (M,) and d (M,): rows that say the same as all of them, and priors (k, n + 1), which come last."""
    error = np.array([ROBOT_PLACE] * 3 + [ROBOT_TURN] * 3)
    both = np.hstack([lin.j * scales, lin.r[:, None]])
    order = np.argsort(lin.local, kind="stable")
    edges = np.flatnonzero(np.append(True, np.diff(lin.local[order]) != 0))
    tops, ends, sizes = [], [], []
    for rows in np.split(order, edges[1:]):
        left, d, _ = np.linalg.svd(lin.jl[rows] * error, full_matrices=False)
        top = left.T @ both[rows]
        tops.append(top)
        sizes.append(d)
        ends.append(np.asarray(np.linalg.qr(both[rows] - left @ top, mode="r")))
    end = np.vstack([np.asarray(np.linalg.qr(np.vstack(ends), mode="r")), held])
    out = np.vstack([*tops, end])
    return out[:, :-1], out[:, -1], np.concatenate([*sizes, np.zeros(len(end))])
