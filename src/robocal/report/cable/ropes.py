"""The course of each cable: straight from platform anchor to frame anchor, or onto its pulley and round it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import CableRobot
from robocal.cables.pulley import run, taut

__all__ = ["courses", "wheels"]

Array = NDArray[np.float64]
PIECES = 24


def courses(robot: CableRobot, ends: Array) -> list[Array]:
    """Points (n, 3) m along every cable from its platform anchor `ends` (m, 3) m to its frame anchor, with PIECES pieces on the free
    segment and seven points on a pulley (`cables/pulley.py` has the formulas)."""
    share = np.linspace(0.0, 1.0, PIECES + 1)[:, None]
    if robot.pulleys is None:
        return [b + share * (a - b) for a, b in zip(robot.a, ends, strict=True)]
    radius, n = robot.pulleys.radius, robot.pulleys.axis
    free, wrap, _, side = taut(ends - robot.a, robot.pulleys)
    _, u = run(ends - robot.a, robot.pulleys)
    leaves = ends - free[:, None] * u
    out = []
    for i, r in enumerate(radius.tolist()):
        if not (r > 0.0 and np.isfinite(free[i])):
            out.append(ends[i] + share * (robot.a[i] - ends[i]))
            continue
        turn = np.linspace(wrap[i], 0.0, 7)[1:, None]
        arc = robot.a[i] + r * ((1.0 - np.cos(turn)) * side[i] + np.sin(turn) * n[i])
        out.append(np.concatenate([ends[i] + share * (leaves[i] - ends[i]), arc]))
    return out


def wheels(robot: CableRobot, ends: Array) -> list[Array]:
    """The rims (25, 3) m of the pulleys, as they swivel towards `ends` (m, 3) m."""
    if robot.pulleys is None:
        return []
    radius, n = robot.pulleys.radius, robot.pulleys.axis
    side = taut(ends - robot.a, robot.pulleys)[3]
    turn = np.linspace(0.0, 2.0 * np.pi, 25)[:, None]
    rims = zip(radius.tolist(), robot.a, side, n, strict=True)
    return [a + r * ((1.0 - np.cos(turn)) * e + np.sin(turn) * axis) for r, a, e, axis in rims if r > 0.0]
