"""Bodies as faces that can be drawn: the hull of anchors however flat it is, and a surface thinned to what a page can hold;
cables as lines: straight from platform anchor to frame anchor, or onto a pulley and round it."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from robocal._types import Array, Ints
from robocal.cables.boundary import Surface, directions, triangulate_directions
from robocal.cables.geometry import CableRobot
from robocal.cables.pulley import run, taut

__all__ = ["courses", "decimate", "hull_loops", "wheels"]

MOST = 1500


def hull_loops(points: Array) -> list[Array]:
    """The faces (k, 3) of the convex hull of points (n, 3), each in order: polygons of a body, one polygon of a plate, one
    line of two ends, or one point."""
    middle = points.mean(axis=0)
    _, size, axes = np.linalg.svd(points - middle, full_matrices=False)
    rank = int((size > 1e-6 * max(float(size[0]), 1e-12)).sum()) if size[0] > 1e-9 else 0
    flat = (points - middle) @ axes.T
    if rank == 0:
        return [points[:1]]
    if rank == 1:
        return [points[[int(flat[:, 0].argmin()), int(flat[:, 0].argmax())]]]
    if rank == 2:
        return [points[ConvexHull(flat[:, :2]).vertices]]
    found = ConvexHull(points)
    # Triangles of one plane are one face.
    planes: dict[tuple[float, ...], set[int]] = {}
    for plane, corners in zip(found.equations, found.simplices, strict=True):
        planes.setdefault(tuple(np.round(plane, 6)), set()).update(corners.tolist())
    return [_around(points[sorted(corners)], np.array(plane[:3])) for plane, corners in planes.items()]


def _around(corners: Array, normal: Array) -> Array:
    """The corners of one plane face in order, turning left seen from where the normal points."""
    arm = corners - corners.mean(axis=0)
    u = arm[0] / np.linalg.norm(arm[0])
    angle = np.arctan2(arm @ np.cross(normal, u), arm @ u)
    return np.asarray(corners[np.argsort(angle)])


def decimate(surface: Surface) -> tuple[Array, Ints]:
    """Vertices and at most MOST faces of a surface: fewer rays from the same start, spread as evenly."""
    if len(surface.faces) <= MOST:
        return surface.vertices, surface.faces
    arm = surface.vertices - surface.start
    size = np.linalg.norm(arm, axis=1)
    kept = np.flatnonzero(size > 0.0)
    way = arm[kept] / size[kept, None]
    chosen = np.unique((directions((MOST + 4) // 2) @ way.T).argmax(axis=1))
    try:
        faces = triangulate_directions(way[chosen])
    except QhullError:  # a surface without volume has nothing to show
        return surface.vertices, surface.faces[:0]
    return surface.vertices[kept[chosen]], faces


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
