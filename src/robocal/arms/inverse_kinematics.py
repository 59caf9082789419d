"""Inverse kinematics by damped least squares, for many targets at once and any arm.

    min_q 1/2 |r(q)|^2   with   r = (p - p*, L log(R R*^T))   or   r = p - p*
    (J^T J + lam D) dq = -J^T r,   lower <= q <= upper

L is the arm's reach, so that a radian weighs like a reach. lam follows the cost (Levenberg-Marquardt); a joint at its
limit that would leave it is held. All targets step in lock step, the unsolved ones start again from other points of a
fixed low-discrepancy sequence, so the answer is the same every time. Sources: Wampler, Manipulator inverse kinematic
solutions based on vector formulations and damped least-squares methods (1986); Sugihara, Solvability-unconcerned
inverse kinematics by the Levenberg-Marquardt method (2011).

Inverse kinematics in order of importance: what a task leaves free serves the next one.

    dq = J_1^+ r_1 + (J_2 N_1)^+ (r_2 - J_2 dq_1) + ...,   N_k = N_{k-1} - (J_k N_{k-1})^+ J_k N_{k-1},   N_0 = I

Tasks: the position, the orientation, nearness to given joint values. So an arm with fewer than six axes meets the
position and turns as far as it can, and one with seven stays where the controller had it. Source: Siciliano and
Slotine, A general framework for managing multiple tasks in highly redundant robotic systems (1991).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.arms.chain import Chain, Extra
from robocal.errors import ModelError
from robocal.geometry import so3

__all__ = ["Reached", "by_priority", "inverse_point", "inverse_pose"]

TOLERANCE = (1e-9, 1e-9)  # m, rad
ITERATIONS = 80
AT_ONCE = 1000  # targets, each with a start
LONGEST = 0.5  # largest change of a joint in one step, in rad or m: beyond it the linear model is a guess


@record
class Reached:
    """Joint values (m, n), whether the tolerances are met (m,), and what is left: position (m,) in m, angle (m,) in
    rad."""

    joints: Array
    success: Bools
    position: Array
    angle: Array


def inverse_pose(
    chain: Chain, poses: ArrayLike, *, start: ArrayLike | None = None, restarts: int = 64, extra: Extra = None
) -> Reached:
    """Joint values that bring the tool to T_base_tool (m, 4, 4), within the joint limits.

    `start` (n,) or (m, n) is tried first, then the middle of the limits, then `restarts` others; `extra` are named
    columns (m,) or scalars. A target that is not reached keeps the best joint values found. Raises ModelError for wrong
    shapes.
    """
    t = np.asarray(poses, float)
    t = t[None] if t.ndim == 2 else t
    if t.ndim != 3 or t.shape[1:] != (4, 4):
        raise ModelError("targets are not poses", found=t.shape, expected="(m, 4, 4)")
    return _search(_Task(chain, t[:, :3, 3], t[:, :3, :3], extra), start, restarts)


def inverse_point(
    chain: Chain, points: ArrayLike, *, start: ArrayLike | None = None, restarts: int = 64, extra: Extra = None
) -> Reached:
    """Joint values that bring the tool's origin to points (m, 3) in base coordinates, however it is turned.

    For arms with fewer than six joints, or where the orientation does not matter. The rest is as in `inverse_pose`. Raises
    ModelError for wrong shapes.
    """
    p = np.atleast_2d(np.asarray(points, float))
    if p.ndim != 2 or p.shape[1] != 3:
        raise ModelError("targets are not points", found=p.shape, expected="(m, 3)")
    return _search(_Task(chain, p, None, extra), start, restarts)


class _Task:
    """Residual and Jacobian of chosen targets."""

    def __init__(self, chain: Chain, point: Array, turn: Array | None, extra: Extra) -> None:
        self.chain, self.point = chain, np.ascontiguousarray(point)
        self.turn = None if turn is None else np.ascontiguousarray(turn)
        self.entries = chain.program.joint_entries(chain.joint_names)
        self.theta = chain.table.values[None]
        self.extra = {k: np.broadcast_to(np.asarray(v, float), (len(point),)) for k, v in (extra or {}).items()}
        low, high = chain.limits.T
        self.low, self.high = low, high
        # Where nothing bounds a joint, starts come from one turn, or from one metre to either side.
        wide = np.array([np.pi if j.type == "revolute" else 1.0 for j in chain.joints])
        self.first = np.where(np.isfinite(low), low, np.where(np.isfinite(high), high - 2 * wide, -wide))
        self.last = np.where(np.isfinite(high), high, self.first + 2 * wide)
        self.reach = 1.0
        if len(point):
            some = np.stack([self.sample(i) for i in range(16)])
            spread = self.evaluate(some, np.zeros(16, dtype=np.int64), seen=True)[2]
            size = float(np.linalg.norm(spread - spread.mean(axis=0), axis=1).max())
            self.reach = size if size > 1e-6 else 1.0

    def sample(self, i: int) -> Array:
        """Point i of the R-sequence (Roberts, 2018) between the limits, (n,)."""
        n = len(self.first)
        golden = 2.0
        for _ in range(60):
            golden = (1.0 + golden) ** (1.0 / (n + 1))
        u = (0.5 + (i + 1) * golden ** -np.arange(1.0, n + 1)) % 1.0
        return np.asarray(self.first + u * (self.last - self.first))

    def evaluate(self, q: Array, which: Ints, seen: bool = False) -> tuple[Array, Array, Array, Array]:
        """r (k, d), J (k, d, n), position (k, 3) or its error (k,), angle (k,) at q (k, n) for targets `which` (k,)."""
        phi = self.chain.phi(q, {k: v[which] for k, v in self.extra.items()})
        t, jac = self.chain.program.run(self.theta, phi[None], self.entries, q.shape[1])
        p, j, angle = t[0, :, :3, 3], jac[0], np.zeros(len(q))
        gap, at = p - self.point[which], p
        if self.turn is not None:
            from robocal.geometry._kernels import pose_gaps

            gap = np.empty((len(q), 6))
            pose_gaps(t[0], j, self.point, self.turn, which, self.reach, gap, angle)
        if not seen:
            at = np.linalg.norm(gap[:, :3], axis=1)
        return gap, j[:, : gap.shape[1]], at, angle


def _search(task: _Task, start: ArrayLike | None, restarts: int) -> Reached:
    m, n = len(task.point), len(task.chain.joints)
    best = Reached(np.zeros((m, n)), np.zeros(m, dtype=bool), np.full(m, np.inf), np.full(m, np.inf))
    cost = np.full(m, np.inf)
    # Not quite the middle: there the arm may be stretched, and every step is zero.
    tries = [np.clip(0.5 * (task.first + task.last) + 0.05 * (1.0 + np.arange(n) % 3), task.low, task.high)]
    tries += [task.sample(i) for i in range(restarts)]
    given = None if start is None else np.asarray(start, float)
    if given is not None and given.shape not in ((n,), (m, n)):
        raise ModelError("wrong shape of start", found=given.shape, expected=f"({n},) or ({m}, {n})")
    tries = tries if given is None else [given, *tries]
    while tries and len(left := np.flatnonzero(~best.success)):
        # A few targets that are left try many starts at once: a step costs about as much for one of them as for all.
        some, tries = tries[: (many := max(1, AT_ONCE // len(left)))], tries[many:]
        q0 = np.concatenate([np.broadcast_to(attempt, (m, n))[left] for attempt in some])
        ended = _descend(task, np.clip(q0, task.low, task.high), np.tile(left, len(some)))
        for q, value, position, angle in zip(*(np.split(part, len(some)) for part in ended), strict=True):
            better = ~best.success[left] & (value < cost[left])
            at = left[better]
            best.joints[at], cost[at] = q[better], value[better]
            best.position[at], best.angle[at] = position[better], angle[better]
            best.success[at] = (position[better] <= TOLERANCE[0]) & (angle[better] <= TOLERANCE[1])
    return best


def _descend(task: _Task, q: Array, which: Ints) -> tuple[Array, Array, Array, Array]:
    """Levenberg-Marquardt from q (k, n) for targets `which` (k,): q, cost, position error and angle, each with k
    rows. Of several starts of a target those behind one that reached it go no further."""
    r, j, position, angle = task.evaluate(q, which)
    cost = 0.5 * np.einsum("kd,kd->k", r, r)
    # Of the rows that go on: which they are, where they stand, r, J and damping; only their numbers are moved.
    active, here, lam = np.arange(len(q)), q.copy(), np.full(len(q), 1e-2)
    first = np.full(len(task.point), len(q))  # of every target, the first row that reached it
    for _ in range(ITERATIONS):
        reached = (position[active] <= TOLERANCE[0]) & (angle[active] <= TOLERANCE[1])
        np.minimum.at(first, which[active[reached]], active[reached])
        going = ~reached & (lam < 1e10) & (active < first[which[active]])
        if not going.all():
            active, here, r, j, lam = active[going], here[going], r[going], j[going], lam[going]
        if not len(active):
            break
        step = _step(task, here, r, j, lam)
        new = np.clip(here + step, task.low, task.high)
        r2, j2, position2, angle2 = task.evaluate(new, which[active])
        cost2 = 0.5 * np.einsum("kd,kd->k", r2, r2)
        lower = cost2 < cost[active]
        lam = np.where(lower, np.maximum(lam * 0.1, 1e-12), 8.0 * lam)
        if lower.all():
            at = active
            q[at], cost[at], position[at], angle[at] = new, cost2, position2, angle2
        else:
            at, back = active[lower], np.flatnonzero(~lower)
            q[at], cost[at], position[at], angle[at] = new[lower], cost2[lower], position2[lower], angle2[lower]
            new[back], r2[back], j2[back] = here[back], r[back], j[back]
        here, r, j = new, r2, j2
    return q, cost, position, angle


def _step(task: _Task, q: Array, r: Array, j: Array, lam: Array) -> Array:
    """The damped step (k, n), in which no joint leaves its limit, shortened where it is long."""
    jt = np.swapaxes(j, 1, 2)
    g = (jt @ r[..., None])[..., 0]
    a = jt @ j.copy()  # of a matrix and its own transpose numpy makes a slower product
    diagonal = np.einsum("kii->ki", a)  # a view
    damp = lam[:, None] * (diagonal + 1e-3 * diagonal.mean(axis=1, keepdims=True) + 1e-300)
    held = ((q <= task.low) & (g > 0)) | ((q >= task.high) & (g < 0))
    if len(some := np.flatnonzero(held.any(axis=1))):
        still = held[some]
        a[some] = np.where(still[:, :, None] | still[:, None, :], 0.0, a[some])
        damp[held], g[held] = 1.0, 0.0
    diagonal += damp
    step = -np.linalg.solve(a, g[..., None])[..., 0]
    return np.asarray(step * np.minimum(1.0, LONGEST / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300)))


STEPS = 40


def by_priority(
    chain: Chain, target: Array, near: Array, start: Array, *, oriented: bool, extra: Mapping[str, Array] | None
) -> Array:
    """Joint values (m, n) within the limits that serve position, then orientation, then nearness to `near` (m, n).

    `target` (m, 4, 4) are poses T_base_tool, `start` (m, n) is where the steps begin: they follow the linear model and
    find the solution beside it, not another branch. `extra` are named columns (m,).
    """
    low, high = chain.limits.T
    q = np.array(start, float)
    n = q.shape[1]
    for _ in range(STEPS):
        pose, jac = chain.pose(q, extra), chain.jacobian(q, extra)
        tasks = [(jac[:, :3], target[:, :3, 3] - pose[:, :3, 3])]
        if oriented:
            turn = so3.log(target[:, :3, :3] @ np.swapaxes(pose[:, :3, :3], 1, 2))
            tasks.append((jac[:, 3:], turn))
        tasks.append((np.broadcast_to(np.eye(n), (len(q), n, n)), near - q))
        # A joint at its limit that would leave it is held, and the others share its part.
        held = np.zeros(q.shape, dtype=bool)
        for _ in range(n):
            step = _priority_step(tasks, held)
            leaving = ((q <= low) & (step < 0)) | ((q >= high) & (step > 0))
            if not (leaving & ~held).any():
                break
            held |= leaving
        step *= np.minimum(1.0, 0.3 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
        q = np.clip(q + step, low, high)
        if np.abs(step).max(initial=0.0) < 1e-12:
            break
    return np.asarray(q)


def _priority_step(tasks: list[tuple[Array, Array]], held: Bools) -> Array:
    """The step (m, n) that serves the tasks (J, r) in order, each in the null space of those before it."""
    m, n = held.shape
    step = np.zeros((m, n))
    null = np.where(held[:, :, None] | held[:, None, :], 0.0, np.eye(n))
    for j, r in tasks:
        inside = j @ null
        # Directions of which a task sees next to nothing belong to the next one.
        pinv = np.linalg.pinv(inside, rcond=1e-4)
        strong = np.linalg.norm(inside, axis=(1, 2)) > 1e-6
        pinv = np.where(strong[:, None, None], pinv, 0.0)
        step = step + (pinv @ (r - (j @ step[..., None])[..., 0])[..., None])[..., 0]
        null = null - pinv @ inside
    return step
