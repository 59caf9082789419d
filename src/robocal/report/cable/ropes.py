"""The course of each cable: straight from platform anchor to frame anchor, or onto its pulley and round it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import CableRobot
from robocal.cables.pulley import run

__all__ = ["courses", "wheels"]

Array = NDArray[np.float64]


def courses(robot: CableRobot, ends: Array, pieces: int = 24) -> list[Array]:
    """Points (n, 3) m along every cable from its platform anchor `ends` (m, 3) m to its frame anchor, with `pieces` pieces on the free
    segment and seven points on a pulley (`cables/pulley.py` has the formulas)."""
    share = np.linspace(0.0, 1.0, pieces + 1)[:, None]
    if robot.pulleys is None:
        return [b + share * (a - b) for a, b in zip(robot.a, ends, strict=True)]
    radius, n, side, h, s = _planes(robot, ends)
    full, u = run(ends - robot.a, (radius, n))
    free = np.sqrt(np.maximum((s - radius) ** 2 + h * h - radius**2, 0.0))
    leaves = ends - free[:, None] * u
    out = []
    for i, r in enumerate(radius.tolist()):
        if not (r > 0.0 and np.isfinite(full[i])):
            out.append(ends[i] + share * (robot.a[i] - ends[i]))
            continue
        turn = np.linspace((full[i] - free[i]) / r, 0.0, 7)[1:, None]
        arc = robot.a[i] + r * ((1.0 - np.cos(turn)) * side[i] + np.sin(turn) * n[i])
        out.append(np.concatenate([ends[i] + share * (leaves[i] - ends[i]), arc]))
    return out


def wheels(robot: CableRobot, ends: Array) -> list[Array]:
    """The rims (25, 3) m of the pulleys, as they swivel towards `ends` (m, 3) m."""
    if robot.pulleys is None:
        return []
    radius, n, side, _, _ = _planes(robot, ends)
    turn = np.linspace(0.0, 2.0 * np.pi, 25)[:, None]
    rims = zip(radius.tolist(), robot.a, side, n, strict=True)
    return [a + r * ((1.0 - np.cos(turn)) * e + np.sin(turn) * axis) for r, a, e, axis in rims if r > 0.0]


def _planes(robot: CableRobot, ends: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Radius (m,), swivel axis (m, 3), the direction across it towards the platform anchor (m, 3), and the platform anchor's
    coordinates along and across (m,)."""
    assert robot.pulleys is not None
    d, n = ends - robot.a, np.asarray(robot.pulleys.axis, float)
    h = (d * n).sum(axis=1)
    across = d - h[:, None] * n
    s = np.linalg.norm(across, axis=1)
    return np.asarray(robot.pulleys.radius, float), n, across / np.where(s > 0.0, s, np.inf)[:, None], h, s
