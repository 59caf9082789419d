"""What errors of a robot's poses do to frames that were fitted alone, where the poses are given and not computed from joints.

    r = J x + P e + R w + n,    e ~ N(0, p^2),  w ~ N(0, q^2),  n ~ N(0, v^2)        whitened

Every pose is off by a shift e and a turn w of its own, in units of ROBOT_PLACE and ROBOT_TURN. An orthogonal change of the rows of each
configuration leaves six that its pose moves, so V = 1 + a P P' + b R R', a = p^2 / v^2, b = q^2 / v^2, is of blocks of six, and the
restricted likelihood of a and b costs little; N - n = M numbers are left beside the frames.

    -2 log L = log |V| + log |X' V^-1 X| + M log y' Q y,      v^2 = y' Q y / M,      cov(x) = v^2 X+ V X+'

Source: Patterson and Thompson (1971); the size of the errors: ISO 9283 absolute accuracy of arms that were not calibrated.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.diagnose.vision_limits import ARM_EXPLAINS, ROBOT_PLACE, ROBOT_TURN
from robocal.estimate.elimination import reweight
from robocal.estimate.terms import Linear
from robocal.fit.fit import Fit
from robocal.measure.base import problem as build
from robocal.measure.machine import Model, find_poses

__all__ = ["PoseShare", "pose_share"]

RATIOS = np.concatenate([[0.0], np.logspace(-6, 6, 97)])  # grid: of p^2 and q^2 to v^2
SWEEPS = 4  # grid: over one ratio, then over the other
MOST = 1e12  # tolerance: of a P P': beyond, the 1 beside it is lost in rounding, and V is singular
RANK = 1e-10  # tolerance: of the largest singular value: a direction that no row tells


@record
class PoseShare:
    """`square`: what the frames leave, whitened; `robot`: what poses that are off as is usual would leave; `covariance` (n, n) of the
    fitted frames with errors of the poses, None where noise explains what is left; `errors`: these, m and rad."""

    square: float
    robot: float
    covariance: Array | None
    errors: tuple[float, float] | None


def pose_share(model: Model, fit: Fit) -> PoseShare:
    """Of a fit to poses that are given, in which frames alone are free, and what else the model has."""
    problem, x = fit.problem, fit.solution.x
    values = dict(zip(problem.table.names, x[0].tolist(), strict=False))
    every = build(find_poses(model), fit.data, values=values).with_weights(problem.weights).with_free(problem.free)
    lin = reweight(every.linearize(every.start), every)
    now = np.column_stack([np.eye(every.n), every.difference(every.start)[0]])
    held = every.prior_root @ now * np.append(every.scales, 1.0)
    rows = _rows(lin, every.scales, held)
    return rows.share(len(lin.r), every.scales)


@record(eq=False)
class _PoseRows:
    """Rows that say the same as all: of m configurations X (m, 6, n), y (m, 6) and their poses' columns (m, 6, 6); and the rest, (k, n) and
    (k,), the last `known` of which are priors."""

    design: Array
    value: Array
    pose: Array
    rest: Array
    left: Array
    known: int

    def share(self, count: int, scales: Array) -> PoseShare:
        m, n = len(self.design), self.rest.shape[1]
        u, size, vt = np.linalg.svd(np.vstack([self.design.reshape(6 * m, n), self.rest]), full_matrices=False)
        kept = size > RANK * size.max(initial=0.0)  # none where nothing was fitted
        u = u[:, kept]
        basis, end = u[: 6 * m].reshape(m, 6, u.shape[1]), u[6 * m :]
        count = max(count - int(kept.sum()), 1)

        def likelihood(a: Array, b: Array) -> tuple[Array, Array]:
            """Log L and v^2 of ratios (K,)."""
            v = self._spread(a, b)
            both = np.linalg.solve(
                v,
                np.broadcast_to(np.concatenate([basis, self.value[..., None]], axis=2), (len(a), m, 6, u.shape[1] + 1)),
            )
            inner = np.einsum("mri,kmrj->kij", basis, both[..., :-1]) + end.T @ end
            cross = np.einsum("mri,kmr->ki", basis, both[..., -1]) + end.T @ self.left
            square = np.einsum("mr,kmr->k", self.value, both[..., -1]) + self.left @ self.left
            square = square - np.einsum("ki,ki->k", cross, np.linalg.solve(inner, cross[..., None])[..., 0])
            variance = np.maximum(square, np.finfo(float).tiny) / count
            size = np.linalg.slogdet(v)[1].sum(axis=1) + np.linalg.slogdet(inner)[1]
            return -0.5 * (size + count * np.log(variance)), variance

        # Of poses that were computed noise is 1e-12 m, and a robot's error beside it is no number any more.
        ratios = RATIOS[np.max(self.pose**2, initial=0.0) * RATIOS <= MOST]
        told, variance = likelihood(ratios, ratios)
        none, square = float(told[0]), float(variance[0]) * count
        best = np.array([ratios[told.argmax()]] * 2)
        for sweep in range(SWEEPS):
            tried = np.repeat(best[None], len(ratios), axis=0)
            tried[:, sweep % 2] = ratios
            told, variance = likelihood(*tried.T)
            best, most, v = tried[told.argmax()], float(told.max()), float(variance[told.argmax()])
        robot = float(np.sum(self.pose**2) - np.sum(np.einsum("mri,mrj->mij", basis, self.pose) ** 2))
        if not most - none > ARM_EXPLAINS:
            return PoseShare(square, robot, None, None)
        inverse = (vt[kept].T / size[kept] * scales[:, None]) @ u.T
        own, other = inverse[:, : 6 * m].reshape(-1, m, 6), inverse[:, 6 * m :]
        spread = self._spread(*best[:, None])[0]
        covariance = v * np.einsum("imr,mrs,jms->ij", own, spread, own, optimize=True)
        # What is known beforehand has its own sigma, whatever the readings leave.
        weight = np.full(len(self.left), v)
        weight[len(weight) - self.known :] = 1.0
        covariance = covariance + (other * weight) @ other.T
        place, turn = np.sqrt(v * best) * (ROBOT_PLACE, ROBOT_TURN)
        return PoseShare(square, robot, covariance, (float(place), float(turn)))

    def _spread(self, a: Array, b: Array) -> Array:
        """V (K, m, 6, 6)."""
        place, turn = (p @ np.swapaxes(p, 1, 2) for p in (self.pose[..., :3], self.pose[..., 3:]))
        return np.asarray(np.eye(6) + a[:, None, None, None] * place + b[:, None, None, None] * turn)


def _rows(lin: Linear, scales: Array, held: Array) -> _PoseRows:
    """Rows in expected errors; `held` (k, n + 1) are priors."""
    error = np.array([ROBOT_PLACE] * 3 + [ROBOT_TURN] * 3)
    both = np.hstack([lin.j * scales, lin.r[:, None]])
    order = np.argsort(lin.local, kind="stable")
    edges = np.flatnonzero(np.append(True, np.diff(lin.local[order]) != 0))
    tops, poses, ends = [], [], []
    for rows in np.split(order, edges[1:]):
        left, d, vt = np.linalg.svd(lin.jl[rows] * error, full_matrices=False)
        top, pose = np.zeros((6, both.shape[1])), np.zeros((6, 6))
        top[: len(d)], pose[: len(d)] = left.T @ both[rows], d[:, None] * vt
        tops.append(top)
        poses.append(pose)
        ends.append(np.asarray(np.linalg.qr(both[rows] - left @ top[: len(d)], mode="r")))
    end = np.vstack([np.asarray(np.linalg.qr(np.vstack(ends), mode="r")), held])
    every = np.stack(tops)
    return _PoseRows(every[..., :-1], every[..., -1], np.stack(poses), end[:, :-1], end[:, -1], len(held))
