"""How fast a machine moved along the path on which it was measured."""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.diagnose.limits import PATH_CONFIGURATIONS, PATH_SHARE, PATH_STEP
from robocal.measure.data import Configurations

__all__ = ["joint_rates"]


def joint_rates(configurations: Configurations) -> tuple[Array, bool] | None:
    """The speed of every joint (m, n), and whether it is per second (else per row); nought where a neighbour is far; None where
    no path was measured."""
    q, t = configurations.joints, configurations.columns.get("time")
    if q is None or len(q) < PATH_CONFIGURATIONS or not np.isfinite(q).all():
        return None
    timed = t is not None and bool(np.isfinite(t).all() and np.ptp(t) > 0)
    order = np.argsort(t, kind="stable") if timed and t is not None else np.arange(len(q))
    way, clock = q[order], t[order] if timed and t is not None else np.arange(len(q), dtype=np.float64)
    spread = q.std(axis=0)
    place = way / np.where(spread > 0, spread, 1.0)
    step = np.linalg.norm(np.diff(place, axis=0), axis=1)
    near = step < PATH_STEP * np.sqrt(2 * (spread > 0).sum())
    inside = np.flatnonzero(near[:-1] & near[1:] & (clock[2:] > clock[:-2])) + 1
    if len(inside) < PATH_SHARE * len(q):
        return None
    speed = np.zeros_like(q)
    gap = (clock[inside + 1] - clock[inside - 1])[:, None]
    speed[order[inside]] = (way[inside + 1] - way[inside - 1]) / gap
    return (speed, timed) if speed.any() else None
