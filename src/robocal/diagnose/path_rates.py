"""How fast a machine moved where configurations were taken along a path: joint values, or poses of its own, in the order of time.

    v_i = (q_{i+1} - q_{i-1}) / (t_{i+1} - t_{i-1})

It is told per second where times were recorded, else per row; only where neighbours in time stand near each other, as on a path. Where
configurations were taken one by one, the way between two of them says nothing of a speed.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.diagnose import limits
from robocal.estimate.problem import Problem
from robocal.estimate.terms import Linear
from robocal.geometry import se3, so3
from robocal.measure.data import Configurations

__all__ = ["joint_rates", "pose_rates", "time_order"]


def joint_rates(configurations: Configurations) -> tuple[Array, bool] | None:
    """The speed of every joint (m, n), and whether it is per second (else per row); nought where a neighbour is far; None where
    no path was measured."""
    q = configurations.joints
    if q is None or len(q) < limits.PATH_CONFIGURATIONS or not np.isfinite(q).all():
        return None
    order, clock, timed = time_order(configurations)
    way = q[order]
    spread = q.std(axis=0)
    step = np.diff(way / np.where(spread > 0, spread, 1.0), axis=0)
    inside = _inside(step, float((spread > 0).sum()), clock)
    if inside is None:
        return None
    speed = np.zeros_like(q)
    gap = (clock[inside + 1] - clock[inside - 1])[:, None]
    speed[order[inside]] = (way[inside + 1] - way[inside - 1]) / gap
    return (speed, timed) if speed.any() else None


def pose_rates(configurations: Configurations, problem: Problem, x: Array, lin: Linear) -> tuple[Array, bool] | None:
    """The same of poses of their own at x (1, P), as twists (m, l) of the components that are free. How near two poses are is
    told by what the readings see of the way: `lin` are their rows at x."""
    axes = list(problem.families[0].axes)
    pose = se3.from_vector(problem.values_of(0, x)[0])
    if len(pose) < limits.PATH_CONFIGURATIONS or not np.isfinite(pose).all():
        return None
    order, clock, timed = time_order(configurations)
    seen = lin.jl[lin.local >= 0]
    _, s, v = np.linalg.svd(np.linalg.qr(seen, mode="r"))
    weight = (s[:, None] * v).T

    def between(a: Ints, b: Ints) -> Array:
        turn = so3.log(pose[b, :3, :3] @ np.swapaxes(pose[a, :3, :3], -1, -2))
        return np.concatenate([pose[b, :3, 3] - pose[a, :3, 3], turn], axis=1)[:, axes]

    middle = np.full(len(order), order[len(order) // 2])
    spread = float(((between(middle, order) @ weight).var(axis=0)).sum())
    inside = _inside(between(order[:-1], order[1:]) @ weight, spread, clock)
    if inside is None:
        return None
    speed = np.zeros((len(pose), len(axes)))
    gap = (clock[inside + 1] - clock[inside - 1])[:, None]
    speed[order[inside]] = between(order[inside - 1], order[inside + 1]) / gap
    return (speed, timed) if speed.any() else None


def time_order(configurations: Configurations) -> tuple[Ints, Array, bool]:
    """The configurations in the order of time, the time of each, and whether it was recorded (else their rows stand for it)."""
    t = configurations.columns.get("time")
    if t is not None and np.isfinite(t).all() and np.ptp(t) > 0:
        order = np.argsort(t, kind="stable")
        return order, t[order], True
    rows = np.arange(len(configurations))
    return rows, rows.astype(np.float64), False


def _inside(step: Array, variance: float, clock: Array) -> Ints | None:
    """Which places in the order of time have near neighbours on either side, from the steps (m - 1, d) between them and their variance
    in all; None where few have."""
    near = np.linalg.norm(step, axis=1) < limits.PATH_STEP * np.sqrt(2 * variance)
    inside = np.flatnonzero(near[:-1] & near[1:] & (clock[2:] > clock[:-2])) + 1
    return inside if len(inside) >= limits.PATH_SHARE * (len(step) + 1) else None
