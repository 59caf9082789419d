"""Inverse kinematics in order of importance: what a task leaves free serves the next one.

    dq = J_1^+ r_1 + (J_2 N_1)^+ (r_2 - J_2 dq_1) + ...,   N_k = N_{k-1} - (J_k N_{k-1})^+ J_k N_{k-1},   N_0 = I

Tasks: the position, the orientation, nearness to given joint values. So an arm with fewer than six axes meets the
position and turns as far as it can, and one with seven stays where the controller had it. Source: Siciliano and
Slotine, A general framework for managing multiple tasks in highly redundant robotic systems (1991).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robocal._types import Array, Bools
from robocal.arms.chain import Chain
from robocal.geometry import so3

__all__ = ["by_priority"]

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
